"""What the page costs with many dolls, in the server's process and in a real browser.

python test/page_crowds.py [DOLLS ...]

The dolls of `field` turn where they stand, as a recording, so that nothing is simulated and every
bone is elsewhere in every picture. Without a GPU the browser's pictures a second are those of
software rendering; the script's time, which a GPU does not shorten, is told beside them.
"""
from __future__ import annotations

import contextlib
import dataclasses
import math
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import browser  # noqa: E402
import numpy as np  # noqa: E402
from page_client import PageClient, served, wait  # noqa: E402
from page_cost import cpu  # noqa: E402

from ragdoll_ros.files.scene import load_scene  # noqa: E402
from ragdoll_ros.model import rotation  # noqa: E402
from ragdoll_ros.model.scene import Scene  # noqa: E402
from ragdoll_ros.viewer.sources.playback import Playback  # noqa: E402
from ragdoll_ros.viewer.sources.recording import Recording  # noqa: E402

SECONDS = 8.0
"""That a measurement lasts."""

RUNS = 1
"""Measurements, of which the median is told."""

LAST = 600.0
"""s of the recording: longer than anything here takes."""

COUNT = """() => {
  const node = Object.values(window.__viserMutable.nodeRefFromName).flatMap(node => {
    const found = [];
    node?.traverse(mesh => { if (mesh.isInstancedMesh2) found.push(mesh); });
    return found;
  })[0];
  window.pictures = 0;
  let last = '';
  const look = () => {
    const at = node.getMatrixAt(0).elements.join();
    if (at !== last) window.pictures += 1;
    last = at;
    requestAnimationFrame(look);
  };
  look();
}"""
"""Counts pictures in which the first bone is elsewhere than in the one before."""


class Cost(NamedTuple):
    """What one page costs; a picture is one state of all bones."""

    opening: float
    """s from the address to all bones drawn."""
    server: float
    """ms of a processor for each picture that is sent."""
    size: float
    """kB of each."""
    pictures: float
    """Each second in the browser."""
    script: float
    """ms of the page's own thread for each picture there."""


def field(dolls: int) -> Scene:
    """The dolls of `field` nearest to the world's origin."""
    scene = load_scene('field')
    nearest = sorted(scene.dolls, key=lambda placement: math.hypot(*placement.position))
    return dataclasses.replace(scene, dolls=nearest[:dolls])


def turning(scene: Scene) -> Recording:
    """Every bone turns by one radian a second about its doll's vertical."""
    poses = [placement.bone_pose(bone) for placement in scene.dolls
             for bone in placement.doll.bones]
    positions, orientations = (np.array(column) for column in zip(*poses, strict=True))
    centres = np.array([placement.position for placement in scene.dolls])[scene.doll_of_bone]
    times = np.arange(0, LAST, 10.0)
    turns = [rotation.from_axis_angle((0, 0, 1), 0.4 * k) for k in range(len(times))]
    return Recording(
        scene, times,
        np.array([centres + rotation.rotate(turn, positions - centres) for turn in turns]),
        np.array([rotation.multiply(turn, orientations) for turn in turns]))


def serve(dolls: int) -> None:
    """Serve the page until SIGTERM."""
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    with served(Playback(turning(field(dolls)))) as page:
        print(page.server.get_port(), flush=True)
        stop.wait()


@contextlib.contextmanager
def server(dolls: int) -> Iterator[tuple[subprocess.Popen, int]]:
    """A process that serves, and its port."""
    process = subprocess.Popen([sys.executable, __file__, 'serve', str(dolls)], cwd=ROOT,
                               stdout=subprocess.PIPE, text=True)
    try:
        yield process, int(process.stdout.readline())
    finally:
        process.terminate()
        process.communicate()


def sent(process: subprocess.Popen, port: int) -> tuple[float, float]:
    """Milliseconds of the server's processor time, and kB, for each picture."""
    client = PageClient(port)
    wait(lambda: client.windows > 30)
    windows, size, had = client.windows, client.bytes, cpu(process)
    time.sleep(SECONDS)
    windows, size, had = client.windows - windows, client.bytes - size, cpu(process) - had
    client.close()
    return 1e3 * had / windows, size / windows / 1e3


def seen(context: object, port: int, scene: Scene) -> tuple[float, float, float]:
    """Seconds to open the page; pictures a second, and ms of its thread for each."""
    since = time.monotonic()
    with browser.opened(context, f'http://127.0.0.1:{port}', scene) as view:
        opening = time.monotonic() - since
        meter = context.new_cdp_session(view.page)
        meter.send('Performance.enable')
        view.page.evaluate(COUNT)
        view.page.wait_for_timeout(3000)
        before = _metrics(view, meter)
        view.page.wait_for_timeout(1e3 * SECONDS)
        spent, busy, pictures = (b - a for a, b in zip(before, _metrics(view, meter), strict=True))
    return opening, pictures / spent, 1e3 * busy / pictures


def _metrics(view: browser.View, meter: object) -> tuple[float, float, int]:
    """Instant and s that the page's thread has been busy, and the pictures so far."""
    metrics = meter.send('Performance.getMetrics')['metrics']
    values = {each['name']: each['value'] for each in metrics}
    return values['Timestamp'], values['TaskDuration'], view.page.evaluate('window.pictures')


def measure(context: object, dolls: int) -> Cost:
    """Median of some runs."""
    scene = field(dolls)
    runs = []
    for _ in range(RUNS):
        with server(dolls) as (process, port):
            server_ms, size = sent(process, port)
            opening, pictures, script = seen(context, port, scene)
            runs.append(Cost(opening, server_ms, size, pictures, script))
    return Cost(*(statistics.median(column) for column in zip(*runs, strict=True)))


def main(counts: list[int]) -> None:
    """Print the table."""
    print(f'{"dolls":>6}{"opens, s":>10}{"server, ms":>12}{"kB":>8}{"pictures/s":>12}'
          f'{"page, ms":>10}')
    browser.SHARPNESS, browser.PLAIN = 1, '() => {}'
    with browser.chromium() as context:
        for dolls in counts:
            cost = measure(context, dolls)
            print(f'{dolls:6}{cost.opening:10.1f}{cost.server:12.2f}{cost.size:8.1f}'
                  f'{cost.pictures:12.1f}{cost.script:10.1f}', flush=True)


if __name__ == '__main__':
    if sys.argv[1:2] == ['serve']:
        serve(int(sys.argv[2]))
    else:
        main([int(each) for each in sys.argv[1:]] or [1, 100, 1000])

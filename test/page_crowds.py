"""What the page costs with many dolls, in the server's process and in a real browser.

python test/page_crowds.py [DOLLS ...]

The dolls of `field` turn where they stand, as a recording, so that nothing is simulated and every
bone is elsewhere in every picture. Without a GPU the browser draws in software; beside the pictures
a second that it makes so stand those that it makes where nothing is left to do but the drawing
itself, which a GPU would take.
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
from ragdoll_ros.recordings.recording import Recording  # noqa: E402
from ragdoll_ros.viewer.sources.playback import PlaybackSource  # noqa: E402

SECONDS = 5.0
"""That a measurement lasts."""

RUNS = 3
"""Measurements, of which the median is told."""

LAST = 600.0
"""s of the recording: longer than anything here takes."""

MESHES = """() => {
  const found = new Set();
  window.__viserMutable.scene.traverse(mesh => { if (mesh.isInstancedMesh2) found.add(mesh); });
  return [...found];
}"""

INSTANCES = f'({MESHES})().reduce((sum, mesh) => sum + mesh.instancesCount, 0)'

COUNT = f'() => {{ const [node] = ({MESHES})(); ' + """
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

LEAVE_OUT = """() => {
  for (const name of ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced'])
    WebGL2RenderingContext.prototype[name] = () => {};
}"""
"""Has the page do all but the drawing itself."""


class Cost(NamedTuple):
    """What one page costs; a picture is one state of all bones."""

    opening: float
    """s from the address to all bones drawn."""
    server: float
    """ms of a processor for each picture that is sent."""
    size: float
    """kB of each."""
    drawn: float
    """Pictures each second in the browser, drawn by its processor."""
    undrawn: float
    """And without the drawing itself."""


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
    with served(PlaybackSource(turning(field(dolls)))) as page:
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
    """Seconds to open the page; pictures a second, drawn and undrawn."""
    since = time.monotonic()
    view = browser.View(context, f'http://127.0.0.1:{port}')
    parts = sum(len(bone.shape.primitives) for bone in scene.bones)
    view.wait(lambda: view.page.evaluate(INSTANCES) == parts)
    view.page.evaluate(COUNT)
    view.wait(lambda: view.page.evaluate('window.pictures') > 1)
    opening = time.monotonic() - since
    drawn = pictures(view)
    view.page.evaluate(LEAVE_OUT)
    undrawn = pictures(view)
    view.close()
    return opening, drawn, undrawn


def pictures(view: browser.View) -> float:
    """Each second, after as long a time to come to a steady pace."""
    view.page.wait_for_timeout(1e3 * SECONDS)
    count, since = view.page.evaluate('window.pictures'), time.monotonic()
    view.page.wait_for_timeout(1e3 * SECONDS)
    return (view.page.evaluate('window.pictures') - count) / (time.monotonic() - since)


def measure(context: object, dolls: int) -> Cost:
    """Median of some runs."""
    scene = field(dolls)
    runs = []
    for _ in range(RUNS):
        with server(dolls) as (process, port):
            server_ms, size = sent(process, port)
            opening, drawn, undrawn = seen(context, port, scene)
            runs.append(Cost(opening, server_ms, size, drawn, undrawn))
    return Cost(*(statistics.median(column) for column in zip(*runs, strict=True)))


def main(counts: list[int]) -> None:
    """Print the table."""
    print(f'{"dolls":>6}{"opens, s":>10}{"server, ms":>12}{"kB":>8}{"drawn/s":>10}'
          f'{"undrawn/s":>11}')
    browser.SHARPNESS, browser.PLAIN = 1, '() => {}'
    with browser.chromium(draws=True) as context:
        for dolls in counts:
            cost = measure(context, dolls)
            print(f'{dolls:6}{cost.opening:10.1f}{cost.server:12.2f}{cost.size:8.1f}'
                  f'{cost.drawn:10.1f}{cost.undrawn:11.1f}', flush=True)


if __name__ == '__main__':
    if sys.argv[1:2] == ['serve']:
        serve(int(sys.argv[2]))
    else:
        main([int(each) for each in sys.argv[1:]] or [1, 100, 1000])

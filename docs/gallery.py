"""Make the cards of the page's gallery: pictures of the shipped scenes, and what a tick costs.

make gallery, or python docs/gallery.py [SCENE ...] for the pictures of some.
"""
from __future__ import annotations

import io
import json
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import browser  # noqa: E402
import numpy as np  # noqa: E402
from page_client import served  # noqa: E402
from PIL import Image  # noqa: E402

from ragdoll_ros.files.scene import load_scene  # noqa: E402
from ragdoll_ros.physics.simulation import Simulation  # noqa: E402
from ragdoll_ros.viewer.gallery.cost import FOLDER, reference_cost  # noqa: E402
from ragdoll_ros.viewer.page import Page  # noqa: E402
from ragdoll_ros.viewer.sources.simulation import SimulationSource  # noqa: E402

SIZE = 240, 150
"""Pixels of a picture."""

SCENES = {'drop': (0.42, 0.7, 1), 'man_faints': (0.75, 0.7, 1), 'woman_faints': (0.75, 0.7, 1),
          'character_falls': (0.45, 0.8, 1), 'walker_faints': (2.35, 0.95, 1),
          'walker_stumbles': (1.0, 0.95, 1),
          'ponytail': (0.42, 0.6, 1), 'article': (0.6, 0.6, 1), 'flight': (0.0, 0.7, 1),
          'crowd': (0.9, 0.6, 1), 'pile': (0.6, 0.6, 16), 'field': (0.4, 0.3, 1000),
          'stairs': (1.1, 0.8, 1), 'table': (0.6, 0.8, 1), 'bathroom': (0.8, 0.9, 1),
          'chair': (0.5, 0.8, 1), 'slope': (1.0, 0.9, 1), 'rubble': (0.5, 0.8, 1),
          'terrain': (0.7, 0.8, 1), 'robot': (0.5, 0.9, 1), 'door': (0.55, 0.8, 1)}
"""Instant of the picture, s; distance of the camera, relative to the home view; and how many
processors can share a tick: its separate clusters."""

TURNS = {'ponytail': 130.0, 'robot': -60.0, 'walker_faints': -40.0,
         'walker_stumbles': -40.0}
"""Degrees about the vertical by which the camera is turned from the home view, to see the hair,
the blow, or the stride.
"""

DURATION = 3.0
"""s that are measured; a scene is at its busiest within."""


def picture(page: Page, distance: float, turn: float) -> bytes:
    """WebP of what a page shows from another ``distance``, from a side ``turn`` degrees away."""
    client = next(iter(page.server.get_clients().values()))
    camera = client.camera
    middle = np.array(camera.look_at)
    x, y, z = distance * (camera.position - middle)
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    camera.position = middle + np.array([x * cos - y * sin, x * sin + y * cos, z])
    camera.look_at = middle
    image = client.get_render(2 * SIZE[1], 2 * SIZE[0], transport_format='png', timeout=100.0)
    rgba = Image.fromarray(image).convert('RGBA')
    white = Image.new('RGBA', rgba.size, 'white')
    stream = io.BytesIO()
    Image.alpha_composite(white, rgba).convert('RGB').resize(SIZE, Image.LANCZOS).save(
        stream, 'webp', quality=80, method=6)
    return stream.getvalue()


def take_pictures(names: list[str]) -> None:
    """Write the picture of each scene at its instant."""
    browser.SHARPNESS, browser.PLAIN = 1, '() => {}'
    source = SimulationSource(load_scene('flight'))
    source.pause(True)
    with browser.chromium(draws=True) as context, served(source) as page:
        view = browser.View(context, f'http://127.0.0.1:{page.server.get_port()}')
        for name, (instant, distance, _) in ((name, SCENES[name]) for name in names):
            source.load(name)
            for _ in range(round(instant / load_scene(name).step)):
                source.step()
            view.wait(lambda name=name, end=instant: page.frame and page.frame.scene.name == name
                      and page.frame.time >= end - 1e-9)
            view.key('h')
            view.page.wait_for_timeout(2000)
            (FOLDER / f'{name}.webp').write_bytes(
                picture(page, distance, TURNS.get(name, 0.0)))
        view.close()


def cost(name: str) -> float:
    """Processor time of a tick in the busiest second of a scene, ms."""
    costs = []
    with Simulation(load_scene(name), engine='rigid') as simulation:
        for _ in range(round(DURATION / simulation.step)):
            begin = time.thread_time()
            simulation.advance()
            costs.append(time.thread_time() - begin)
        width = round(1 / simulation.step)
    return 1e3 * float(np.convolve(costs, np.ones(width) / width, 'valid').max())


def main(names: list[str]) -> None:
    """Take the pictures of these scenes, or of all and measure their costs."""
    take_pictures(names or list(SCENES))
    if not names:
        costs = {'reference': [round(reference_cost(), 4), 1]}
        costs |= {name: [round(cost(name), 4), threads]
                  for name, (*_, threads) in SCENES.items()}
        (FOLDER / 'costs.json').write_text(json.dumps(costs, indent=1) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main(sys.argv[1:])

"""Draw docs/walker_faints.png and docs/walker_stumbles.png with the page: the walker of config/,
from its stride to the fall.

python docs/walker_picture.py [SCENE ...]
"""
from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import browser  # noqa: E402
import numpy as np  # noqa: E402
from page_client import served  # noqa: E402
from PIL import Image, ImageDraw, ImageFont  # noqa: E402

from ragdoll_ros.files.scene import load_scene  # noqa: E402
from ragdoll_ros.viewer.page import Page  # noqa: E402
from ragdoll_ros.viewer.sources.simulation import SimulationSource  # noqa: E402

INSTANTS = {'walker_faints': (1.25, 1.5, 1.75, 2.0, 2.2, 2.4, 2.7, 3.5),
            'walker_stumbles': (0.0, 0.3, 0.6, 0.9, 1.2, 1.4, 1.6, 2.2)}
"""s, by scene."""
SIZE = 240, 330
"""Pixels of each part, which is drawn twice as large."""
EYE, LOOK_AT = np.array((0.9, -4.1, 1.2)), np.array((0.0, 0.0, 0.85))
"""Of the camera, m, relative to the middle of the picture, which moves on with the walker."""


def part(page: Page, x: float, label: str) -> Image.Image:
    """What the page shows around ``x`` m."""
    client = next(iter(page.server.get_clients().values()))
    middle = np.array((x, 0.0, 0.0))
    client.camera.position, client.camera.look_at = EYE + middle, LOOK_AT + middle
    client.camera.fov = 0.5
    image = client.get_render(2 * SIZE[1], 2 * SIZE[0], transport_format='png', timeout=100.0)
    rgba = Image.fromarray(image).convert('RGBA')
    drawn = Image.alpha_composite(Image.new('RGBA', rgba.size, 'white'), rgba).convert('RGB')
    drawn = drawn.resize(SIZE, Image.LANCZOS)
    ImageDraw.Draw(drawn).text((10, 8), label, 'black', ImageFont.load_default(18))
    return drawn


def draw(name: str) -> None:
    """Write the picture of a scene."""
    scene, source = load_scene(name), SimulationSource(load_scene(name))
    source.pause(True)
    parts, ticks = [], 0
    with browser.chromium(draws=True) as context, served(source) as page:
        view = browser.View(context, f'http://127.0.0.1:{page.server.get_port()}')
        view.wait(lambda: page.frame and page.stage.skins.handles)
        view.page.wait_for_timeout(3000)
        for instant in INSTANTS[name]:
            for _ in range(round(instant / scene.step) - ticks):
                source.step()
            ticks = round(instant / scene.step)
            view.wait(lambda end=instant: page.frame.time >= end - 1e-9)
            view.page.wait_for_timeout(500)
            parts.append(part(page, float(page.frame.state.positions[0, 0]), f'{instant:g} s'))
        view.close()
    whole = Image.new('RGB', (SIZE[0] * len(parts), SIZE[1]), 'white')
    for index, each in enumerate(parts):
        whole.paste(each, (SIZE[0] * index, 0))
    whole.quantize(128).save(ROOT / f'docs/{name}.png', optimize=True)


if __name__ == '__main__':
    browser.SHARPNESS, browser.PLAIN = 1, '() => {}'
    for scene_name in sys.argv[1:] or INSTANTS:
        draw(scene_name)

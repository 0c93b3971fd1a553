"""Takes the pictures of the viewer's page, docs/viewer_*.png, in headless Chromium.

make pictures, or python docs/viewer.py FOLDER
"""
from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import browser  # noqa: E402
import fit_rigs  # noqa: E402
import numpy as np  # noqa: E402

from ragdoll_ros.fit import command as fit  # noqa: E402
from ragdoll_ros.scene_file import load_scene  # noqa: E402

SIZE = {'width': 1000, 'height': 600}

CAMERA = '?initialCameraPosition=3.4,-0.7,1.35&initialCameraLookAt=0,0.45,0.8'
"""In front of the doll, which stands beside the panel then."""


@contextmanager
def page(context: browser.BrowserContext, scene: str) -> Iterator[browser.View]:
    """Open a page on a scene, paused at its start, without viser's word on slow drawing."""
    with browser.serving('--port', '0', '--scene', scene, '--folder', tempfile.gettempdir()) as url:
        view = browser.View(context, url + CAMERA)
        view.page.locator('.mantine-Notification-closeButton').click()
        view.key(' ')
        view.button('Go on').wait_for()
        view.key('r')
        shot(view)
        yield view
        view.close()


def shot(view: browser.View) -> bytes:
    """Give what the page shows, as PNG, once its pictures have come to rest."""
    last = b''
    while (picture := view.page.screenshot()) != last:
        last = picture
        view.page.wait_for_timeout(1500)
    return picture


def step(view: browser.View, ticks: int) -> None:
    """Go on by some ticks."""
    for _ in range(ticks):
        view.key('n')


def fall(context: browser.BrowserContext, folder: Path) -> None:
    """The default doll, pushed aside after its feet have touched the ground."""
    with page(context, 'drop') as view:
        step(view, 36)
        view.key('ArrowRight')
        step(view, 10)
        (folder / 'viewer_fall.png').write_bytes(shot(view))


def grab(context: browser.BrowserContext, folder: Path) -> None:
    """The doll hanging by a forearm from the pointer."""
    scene = load_scene('drop')
    at = np.array(scene.bones[scene.bone_index('left_forearm')].position)
    with page(context, 'drop') as view:
        mouse = view.page.mouse
        mouse.move(*view.pixels([at])[0])
        mouse.down()
        mouse.move(*view.pixels([np.add(at, (0, 0, 0.1))])[0])
        shot(view)
        view.key(' ')
        mouse.move(*view.pixels([np.add(at, (0, -0.5, 0.35))])[0], steps=10)
        view.page.wait_for_timeout(4000)
        view.key(' ')
        (folder / 'viewer_grab.png').write_bytes(shot(view))
        mouse.up()


def edit(context: browser.BrowserContext, folder: Path) -> None:
    """The editor with a chosen thigh in its bind pose."""
    with page(context, 'drop') as view:
        view.tab('Edit')
        view.press('Edit')
        view.button('Drop it').wait_for()
        thigh = next(bone for bone in load_scene('drop').bones if bone.name == 'left_thigh')
        view.page.mouse.click(*view.pixels([thigh.position])[0])
        view.see('Joint to torso')
        (folder / 'viewer_edit.png').write_bytes(shot(view))


def skin(context: browser.BrowserContext, folder: Path) -> None:
    """A fitted character, its skin on the falling bones."""
    with tempfile.TemporaryDirectory() as inbox:
        rig, doll = Path(inbox, 'mannequin.glb'), Path(inbox, 'mannequin.yaml')
        rig.write_bytes(fit_rigs.mannequin().glb())
        fit.main([str(rig), '-o', str(doll)])
        with page(context, str(doll)) as view:
            step(view, 34)
            view.key('ArrowRight')
            step(view, 12)
            (folder / 'viewer_skin.png').write_bytes(shot(view))


def main(folder: Path) -> None:
    """Take all pictures."""
    browser.SIZE.update(SIZE)
    with browser.chromium() as context:
        for picture in (fall, grab, edit, skin):
            picture(context, folder)


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)

"""Take the pictures of the viewer's page, docs/viewer_*.png, in headless Chromium.

make pictures, or python docs/viewer.py FOLDER
"""
from __future__ import annotations

import contextlib
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import browser  # noqa: E402
import fit_rigs  # noqa: E402
import numpy as np  # noqa: E402

from ragdoll_ros.files.scene import load_scene  # noqa: E402
from ragdoll_ros.fit import command as fit  # noqa: E402

SIZE = {'width': 1000, 'height': 600}


def look(view: browser.View, away: float, high: float, at: float, azimuth: float = -0.2) -> None:
    """Place the camera before the doll.

    It stands ``away`` m from the doll and ``high`` m above the ground, ``azimuth`` rad to the
    doll's left, and looks at the height ``at``, m.
    """
    eye = (away * np.cos(azimuth), away * np.sin(azimuth), high)
    view.look(eye, (0.0, 0.0, at))
    shot(view)


@contextlib.contextmanager
def page(context: browser.BrowserContext, scene: str) -> Iterator[browser.View]:
    """Open a page on a scene, paused at its start, without viser's warning on slow drawing."""
    with browser.serving('--port', '0', '--scene', scene, '--folder', tempfile.gettempdir()) as url:
        view = browser.View(context, url)
        view.page.locator('.mantine-Notification-closeButton').click()
        # The first fall begins once the page has drawn its start.
        view.button('Pause').wait_for()
        view.key(' ')
        view.button('Play').wait_for()
        view.key('r')
        shot(view)
        yield view
        view.close()


def shot(view: browser.View) -> bytes:
    """Screenshot of the page, PNG, once its content is still."""
    last = b''
    while (picture := view.page.screenshot()) != last:
        last = picture
        view.page.wait_for_timeout(1500)
    return picture


def step(view: browser.View, ticks: int) -> None:
    """Advance by some ticks."""
    for _ in range(ticks):
        view.key('n')


def fall(context: browser.BrowserContext, folder: Path) -> None:
    """The default doll, pushed aside after its feet have touched the ground."""
    with page(context, 'drop') as view:
        look(view, 2.7, 1.2, 0.65)
        step(view, 24)
        view.page.keyboard.down('ArrowRight')
        step(view, 12)
        (folder / 'viewer_fall.png').write_bytes(shot(view))
        view.page.keyboard.up('ArrowRight')


def grab(context: browser.BrowserContext, folder: Path) -> None:
    """The doll hangs by a forearm from the pointer, which pulls it aside."""
    scene = load_scene('drop')
    at = np.array(scene.bones[scene.bone_index('left_forearm')].position)
    with page(context, 'drop') as view:
        look(view, 3.2, 1.2, 0.95)
        mouse = view.page.mouse
        mouse.move(*view.pixels([at])[0])
        mouse.down()
        mouse.move(*view.pixels([np.add(at, (0, -0.3, 0.4))])[0], steps=5)
        view.key(' ')
        view.page.wait_for_timeout(3000)
        view.key(' ')
        view.button('Play').wait_for()
        mouse.move(*view.pixels([np.add(at, (0, -1.0, 0.5))])[0], steps=5)
        shot(view)
        step(view, 9)
        (folder / 'viewer_grab.png').write_bytes(shot(view))
        mouse.up()


def edit(context: browser.BrowserContext, folder: Path) -> None:
    """The editor with a chosen thigh in its bind pose."""
    with page(context, 'drop') as view:
        look(view, 2.2, 1.3, 0.85, azimuth=0.5)
        view.tab('Edit')
        view.press('Edit')
        view.button('Run').wait_for()
        thigh = next(bone for bone in load_scene('drop').bones if bone.name == 'left_thigh')
        view.page.mouse.click(*view.pixels([thigh.position])[0])
        view.see('Joint to torso')
        (folder / 'viewer_edit.png').write_bytes(shot(view))


def skin(context: browser.BrowserContext, folder: Path) -> None:
    """A fitted character with transparent bones around its skin, pushed aside."""
    with tempfile.TemporaryDirectory() as inbox:
        rig, doll = Path(inbox, 'mannequin.glb'), Path(inbox, 'mannequin.yaml')
        rig.write_bytes(fit_rigs.mannequin().glb())
        with contextlib.redirect_stdout(None):
            fit.main([str(rig), '-o', str(doll)])
        with page(context, str(doll)) as view:
            look(view, 3.1, 1.2, 0.75)
            view.page.get_by_label('Bones').check()
            view.page.mouse.move(10, 10)
            step(view, 30)
            view.page.keyboard.down('ArrowRight')
            step(view, 12)
            (folder / 'viewer_skin.png').write_bytes(shot(view))
            view.page.keyboard.up('ArrowRight')


def field(context: browser.BrowserContext, folder: Path) -> None:
    """A thousand dolls, without the panel."""
    with page(context, 'field') as view:
        look(view, 11.0, 5.0, 1.0)
        step(view, 60)
        shot(view)
        picture = view.page.locator('canvas').first.bounding_box()
        (folder / 'viewer_field.png').write_bytes(view.page.screenshot(clip=picture))


def main(folder: Path) -> None:
    """Take all pictures."""
    browser.SIZE.update(SIZE)
    # The tests draw half the pixels, without shadows.
    browser.SHARPNESS, browser.PLAIN = 1, '() => { window.ragdollKeepsQuality = true; }'
    browser.PATIENCE = 100.0
    with browser.chromium(draws=True) as context:
        for picture in (fall, grab, edit, skin, field):
            picture(context, folder)


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)

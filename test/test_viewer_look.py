"""The picture itself, with its light and shadows: what one would put into a talk."""
from __future__ import annotations

import browser
import imageio.v3 as iio
import numpy as np
import pytest

pytest.importorskip('viser')
from browser import View, chromium
from page_client import served
from test_viewer_seen import surfaces

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.drawing.stage import KEY
from ragdoll_ros.viewer.sources.simulation import SimulationSource

SCENE = load_scene('drop')

KEEP = '() => { window.ragdollKeepsQuality = true; }'

CASTS = 'window.__viserMutable.scene.children.filter(each => each.castShadow && each.shadow).length'
"""How many lights cast shadows: viser makes three of the main one."""

DPR = 'window.__viserMutable.scene.__r3f.root.getState().viewport.dpr'

SLOW_DOWN = """() => {
  window.ragdollKeepsQuality = false;
  const next = window.ragdollTestNext = window.requestAnimationFrame;
  window.requestAnimationFrame = draw => setTimeout(() => next(draw), 120);
  const draw = () => {
    if (!window.ragdollTestNext) return;
    window.__viserMutable.requestRender();
    requestAnimationFrame(draw);
  };
  draw();
}"""
"""From here on a picture takes 120 ms, in which nothing computes, and one follows the other."""

SPEED_UP = """() => {
  window.requestAnimationFrame = window.ragdollTestNext;
  delete window.ragdollTestNext;
}"""

SHADOWS = """cast => {
  window.__viserMutable.scene.traverse(node => { if (node.shadow && node.parent.isScene)
    node.castShadow = cast; });
  window.__viserMutable.requestRender();
}"""


@pytest.fixture(scope='module')
def seen():
    """A page at its start, paused, and the view of it with all that a user sees."""
    kept = browser.SHARPNESS, browser.PLAIN
    browser.SHARPNESS, browser.PLAIN = 1, KEEP
    try:
        with served(SimulationSource(SCENE)) as page, chromium() as context:
            page.source.pause(True)
            view = View(context, f'http://127.0.0.1:{page.server.get_port()}')
            view.wait(lambda: np.isfinite(view.bodies(SCENE)).all())
            yield page, view
            assert not view.errors
            view.close()
    finally:
        browser.SHARPNESS, browser.PLAIN = kept


def still(view):
    """Colours (h, w, 3) of the page once they stay."""
    taken = []

    def same():
        taken.append(view.page.screenshot())
        return len(taken) > 1 and taken[-1] == taken[-2]

    with view.drawing():
        view.wait(same)
    return iio.imread(taken[-1])[..., :3].astype(float)


def around(picture, pixel, radius=1):
    """Mean colour (3,) near a pixel."""
    x, y = np.round(pixel).astype(int)
    return picture[y - radius:y + radius + 1, x - radius:x + radius + 1].mean(axis=(0, 1))


def shadow_of(point):
    """Where the shadow of a point (3,) m lies on the ground."""
    return point - np.array(KEY) * point[2] / KEY[2]


@pytest.mark.parametrize('size', [(1280, 800), (1440, 900), (390, 844), (2560, 1440)],
                         ids=lambda size: f'{size[0]}x{size[1]}')
def test_the_doll_fills_the_picture_and_is_all_in_it(seen, size):
    """More than half of its height or width, with a margin on each side."""
    page, view = seen
    view.page.set_viewport_size({'width': size[0], 'height': size[1]})
    points = np.concatenate([points for points, _ in surfaces(page.frame, False)])

    def shares():
        canvas = view.page.locator('canvas').first.bounding_box()
        return (view.pixels(points) - (canvas['x'], canvas['y'])) / (
            canvas['width'], canvas['height'])

    def fits():
        found = shares()
        return (found.min() > 0.03 and found.max() < 0.97
                and 0.5 < np.ptp(found, axis=0).max() < 0.94)

    view.wait(fits)


def test_a_soft_shadow_lies_where_the_light_throws_it(seen):
    """At its middle the ground is darker than beside it, and than without shadows; its edge is no
    line of pixels, which hard shadows have.
    """
    page, view = seen
    view.page.set_viewport_size(browser.SIZE)
    torso = page.frame.state.positions[SCENE.bone_index('torso')]
    middle, beside = shadow_of(torso), shadow_of(torso) + np.array((0.0, 0.6, 0.0))
    view.look(torso + np.array((3.0, -0.8, 2.0)), middle)
    picture = still(view)
    pixels = view.pixels([middle, beside])
    shadow, ground = (around(picture, pixel) for pixel in pixels)
    assert ground.min() > 225 and np.ptp(ground) < 8
    assert 20 < ground.mean() - shadow.mean() < 110
    along = np.linspace(*pixels, 400).round().astype(int)
    values = picture[along[:, 1], along[:, 0]].mean(axis=1)
    span = values - shadow.mean()
    soft = np.unique(along[(span > 0.2 * np.ptp(values)) & (span < 0.8 * np.ptp(values))], axis=0)
    assert len(soft) >= 4
    view.page.evaluate(SHADOWS, False)
    assert around(still(view), pixels[0]).mean() > ground.mean() - 6
    view.page.evaluate(SHADOWS, True)


@pytest.mark.parametrize('bone', ['torso', 'left_thigh', 'right_thigh'])
def test_a_bone_has_the_colour_that_its_file_gives(seen, bone):
    """Where light falls on it, red, green and blue within 0.15 of 1."""
    page, view = seen
    view.page.set_viewport_size(browser.SIZE)
    at = page.frame.state.positions[SCENE.bone_index(bone)]
    view.look(at + np.array((2.0, -0.6, 0.6)), at)
    drawn = around(still(view), view.pixels([at])[0], 3) / 255
    given = SCENE.bones[SCENE.bone_index(bone)].color[:3]
    assert drawn == pytest.approx(given, abs=0.15)


def test_a_force_is_seen_with_its_newtons_though_a_body_is_before_it(seen):
    """After a fall, 30 pixels of the arrows' colour, which nothing else has, and a label of N.

    The arrows begin below the bodies and run through them.
    """
    page, view = seen
    view.page.set_viewport_size(browser.SIZE)
    page.display.contacts.value = True
    page.source.pause(False)
    view.wait(lambda: page.frame.time > 1.5)
    page.source.pause(True)
    view.key('h')
    # Tick by tick until something presses: it may have been stopped between two impacts.
    label = view.wait(lambda: page.server.scene.get_handle_by_name('/scene/newtons_labels/0')
                      or page.source.step())
    assert label.text.endswith(' N')

    def is_orange():
        red, green, blue = np.moveaxis(still(view)[:, :500], 2, 0)
        return ((red > 200) & (green > 80) & (green < 190) & (blue < 60)).sum() > 30

    view.wait(is_orange)
    page.display.contacts.value = False
    page.source.reset()


@pytest.mark.parametrize(('chances', 'pictures', 'slow'), [
    (15, 15, True), (28, 20, True), (60, 60, False), (60, 1, False), (15, 2, False)])
def test_only_a_page_that_draws_all_it_can_is_slow(seen, chances, pictures, slow):
    """Not one at rest, which draws once a second, nor one whose script is busy."""
    _, view = seen
    assert view.page.evaluate('counts => window.ragdollIsSlow(...counts)',
                              [chances, pictures, 1.5]) == slow


def test_a_slow_page_drops_its_shadows_then_resolution_and_says_so(seen):
    """Of 120 ms for each picture; another size of the window begins anew."""
    _, view = seen
    note = view.page.locator('.ragdoll-quality')
    view.page.set_viewport_size(browser.SIZE)
    view.page.evaluate(SLOW_DOWN)
    try:
        view.page.wait_for_function(f'{CASTS} === 0')
        view.wait(lambda: 'without shadows' in note.inner_text())
        view.page.wait_for_function(f'{DPR} < 0.5 * devicePixelRatio')
        view.wait(lambda: '40 % of the resolution' in note.inner_text())
    finally:
        view.page.evaluate(SPEED_UP)
    view.page.set_viewport_size({'width': 700, 'height': 520})
    view.page.wait_for_function(f'{CASTS} === 3 && {DPR} >= 0.7 * devicePixelRatio')
    view.wait(lambda: not note.is_visible())
    view.page.evaluate(KEEP)

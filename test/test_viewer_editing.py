"""Editing in headless Chromium: what a user clicks, types, drags and uploads."""
import fit_rigs
import numpy as np
import pytest
from browser import View, chromium
from test_fit_broken import BROKEN
from test_viewer_browser import SCENE, START, Viewer

from ragdoll_ros.scene_file import load_scene
from ragdoll_ros.viewer.editor import changes

SHIN = SCENE.bone_index('left_shin')


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('folder')


@pytest.fixture(scope='module')
def view(folder):
    viewer = Viewer('--scene', 'drop', '--folder', str(folder))
    with chromium() as context:
        view = View(context, viewer.url)
        view.page.get_by_role('tab', name='Edit').click()
        press(view, 'Edit')
        view.wait(lambda: stands(view, START))
        choose(view, 'left_shin')
        yield view
        assert not view.errors
    assert viewer.end() == 0


def press(view, button):
    view.page.get_by_role('button', name=button).first.click()


def choose(view, bone):
    view.page.get_by_label('bone', exact=True).click()
    view.page.get_by_role('option', name=bone, exact=True).click()


def field(view, label):
    """Input beside a label of the panel."""
    return view.page.locator(
        f'xpath=(//label[normalize-space()="{label}"]/ancestor::*[.//input][1]//input)[1]')


def fill(view, label, text):
    field(view, label).fill(text)
    field(view, label).press('Tab')


def stands(view, positions):
    """Whether the bodies are drawn there; a page gets numbers of 32 bits, 1e-6 m at 2 m."""
    bodies = view.bodies(SCENE)
    return bodies is not None and abs(bodies - positions).max() < 1e-6


def place(view, bone):
    """Where a body is drawn, (3,) m; where it began while the page changes the scene."""
    bodies = view.bodies(SCENE)
    return START[bone] if bodies is None else bodies[bone]


def said(view, text):
    view.page.get_by_text(text).first.wait_for()


def test_a_mass_and_a_limit_are_edited_saved_loaded_and_undone(view, folder):
    fill(view, 'mass, kg', '7.5')
    fill(view, 'limits 1, °', '-5, 100')
    press(view, 'Update')
    said(view, 'Undo: numbers of left_shin')
    fill(view, 'file', 'mine')
    press(view, 'Save')
    said(view, 'saved mine.yaml')
    saved = load_scene(str(folder / 'mine.yaml'))
    assert changes.find(saved, 'left_shin')[1].mass == 7.5
    assert np.degrees(changes.joint_of(saved, 'left_shin').limits) == pytest.approx(
        np.array([[-5, 100]]))
    view.page.keyboard.press('Control+z')
    said(view, 'Redo: numbers of left_shin')
    view.wait(lambda: float(field(view, 'mass, kg').input_value()) == 5)
    assert field(view, 'limits 1, °').input_value() == '0, 126'
    press(view, 'Load')
    said(view, 'loaded mine')
    view.wait(lambda: float(field(view, 'mass, kg').input_value()) == 7.5)
    press(view, 'Undo')
    view.wait(lambda: float(field(view, 'mass, kg').input_value()) == 5)


def test_a_faulty_value_is_refused_where_it_stands(view):
    fill(view, 'mass, kg', '-3')
    fill(view, 'limits 1, °', '30, 10')
    press(view, 'Update')
    said(view, 'LimitsReversed: (30.0, 10.0); expected lower <= upper')
    error = view.page.get_by_text('NotPositive: -3.0; expected above zero').bounding_box()
    # Right below the field, above the next one.
    mass, place = (field(view, 'mass, kg').bounding_box(),
                   view.page.get_by_text('place, m', exact=True).bounding_box())
    assert mass['y'] < error['y'] < place['y']
    assert field(view, 'mass, kg').input_value() == '-3'
    fill(view, 'mass, kg', '5')
    fill(view, 'limits 1, °', '0, 126')
    press(view, 'Update')
    view.page.get_by_text('expected lower').wait_for(state='detached')


def test_a_body_is_dragged_by_its_handle_and_dropped(view):
    """By the arrow that points up, by 0.2 m."""
    at = START[SHIN]
    (x0, y0), (x1, y1) = view.pixels(at + np.outer((0.2, 0.4), (0, 0, 1)))
    mouse = view.page.mouse
    mouse.move(x0, y0)
    mouse.down()
    for k in range(1, 11):
        mouse.move(x0 + (x1 - x0) * k / 10, y0 + (y1 - y0) * k / 10)
    mouse.up()
    view.wait(lambda: place(view, SHIN)[2] - at[2] > 0.05)
    moved = view.bodies(SCENE)
    # Along that axis alone, as far as whole pixels and ten steps of the mouse go; all else stays.
    assert moved[SHIN] - at == pytest.approx((0, 0, 0.2), abs=0.03)
    assert abs(np.delete(moved - START, SHIN, axis=0)).max() < 1e-6
    press(view, 'Undo')
    view.wait(lambda: stands(view, START))
    press(view, 'Drop it')
    view.wait(lambda: place(view, 0)[2] < START[0, 2] - 0.1)
    press(view, 'Edit')
    view.wait(lambda: stands(view, START))


def upload(view, button, name, content):
    with view.page.expect_file_chooser() as chooser:
        press(view, button)
    chooser.value.set_files({'name': name, 'mimeType': '', 'buffer': content})


def test_rubbish_is_refused_and_a_character_is_fitted(view, folder):
    for name in ('garbage.glb', 'truncated_json.glb', 'no_skin.glb'):
        upload(view, 'Fit a character', name, BROKEN[name])
        said(view, f'{name}: 1 fault')
    upload(view, 'Upload a scene or doll', 'rubbish.yaml', b'[1, 2')
    said(view, 'rubbish.yaml: 1 fault')
    upload(view, 'Fit a character', 'bird.glb', fit_rigs.document(fit_rigs.RIGS['bird']).glb())
    said(view, 'fitted bird.glb')
    assert (folder / 'bird.glb').exists()
    view.wait(lambda: view.page.evaluate(
        "Object.keys(window.__viserMutable.nodeRefFromName).includes('/scene/skins/0')"))
    press(view, 'Undo')
    view.wait(lambda: stands(view, START))

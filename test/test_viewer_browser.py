"""The page in headless Chromium: what a user sees and does, on a viewer in a process of its own."""
from __future__ import annotations

import contextlib
import dataclasses
import itertools
import re
import time
import zipfile

import fit_rigs
import imageio.v3 as iio
import numpy as np
import pytest
from browser import PATIENCE, SHARPNESS, View, chromium, opened, serving, start_of
from conftest import ROOT
from samples import FLAIL_SDF
from test_fit_broken import BROKEN

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.robots.sdf_dolls import read_sdf
from ragdoll_ros.model.scene import all_above_ground
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.mcap_file import load_recording, recording_bytes
from ragdoll_ros.recordings.recording import Recording
from ragdoll_ros.recordings.save import FORMATS

SCENE = load_scene('drop')
START = start_of(SCENE)


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


@pytest.fixture(scope='module')
def states():
    """The scene's states, tick by tick from 0 until it is at rest, by a simulation here."""
    with Simulation(SCENE) as simulation:
        states = [simulation.state]
        while not simulation.asleep:
            states.append(simulation.advance())
    return states


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('dolls')


@pytest.fixture(scope='module')
def url(folder):
    """Where a viewer of its own serves the default scene."""
    with serving('--port', '0', '--scene', 'drop', '--folder', str(folder)) as url:
        yield url


@pytest.fixture(scope='module')
def view(browser, url):
    with opened(browser, url, SCENE, first=True) as view:
        yield view


def go_on(view):
    view.key(' ')
    view.button('Pause').wait_for()


def index_of(bodies, states):
    """Which tick is drawn; 0 if none."""
    off = abs(np.array([state.positions for state in states]) - bodies).max(axis=(1, 2))
    return int(off.argmin()) if off.min() < 1e-6 else 0


def far(view, bodies, distance):
    """Whether each body is further than ``distance`` m from where it was."""
    return (np.linalg.norm(view.bodies(SCENE) - bodies, axis=1) > distance).all()


def test_sees_ten_bodies_fall(states, view):
    """All move, and what is drawn is a tick of the fall as a simulation here has it.

    A page gets numbers of 32 bits: 1e-6 m at 2 m.
    """
    assert len(START) == 10
    view.hold_at(SCENE, START)
    go_on(view)
    view.wait(lambda: far(view, START, 0.1))
    drawn = view.wait(lambda: index_of(view.bodies(SCENE), states))
    view.wait(lambda: index_of(view.bodies(SCENE), states) > drawn)


@pytest.mark.parametrize(('act', 'axis', 'sign'), [
    (lambda view: view.press('↑'), 0, -1), (lambda view: view.press('↓'), 0, 1),
    (lambda view: view.press('←'), 1, -1), (lambda view: view.press('→'), 1, 1),
    (lambda view: view.key('ArrowUp'), 0, -1)], ids=['up', 'down', 'left', 'right', 'key'])
def test_a_button_or_a_key_pushes(view, act, axis, sign):
    """A tap gives the doll 1 m/s: the torso is 0.2 m off before it lies; nothing else takes it
    that way before it has touched the ground.
    """
    view.hold_at(SCENE, START)
    act(view)
    go_on(view)
    view.wait(lambda: view.bodies(SCENE)[0][axis] * sign > 0.2)


@pytest.mark.parametrize('click', [
    lambda view: view.press('Reset'),
    pytest.param(lambda view: view.page.get_by_label('Contacts').click(), marks=pytest.mark.slow),
    pytest.param(lambda view: view.page.locator('.mantine-Slider-root').first.click(),
                 marks=pytest.mark.slow)], ids=['button', 'checkbox', 'slider'])
def test_what_was_clicked_gives_the_keys_back(view, click):
    """Else Space would press it again, and the arrow keys would move it, or nothing."""
    view.hold_at(SCENE, START)
    click(view)
    view.key('ArrowLeft')
    go_on(view)
    view.wait(lambda: view.bodies(SCENE)[0][1] < -0.2)


@pytest.mark.slow  # test_viewer.py has what the camera is told
def test_the_camera_follows_on_demand(view):
    """Pushed away the doll is at the middle of the picture, and after a reset again."""
    canvas = view.page.locator('canvas').first.bounding_box()
    middle = np.array((canvas['width'], canvas['height'])) / 2
    masses = [bone.mass for bone in SCENE.bones]

    def off():
        centre = np.average(view.bodies(SCENE), axis=0, weights=masses)
        return np.linalg.norm(view.pixels([centre])[0] - middle)

    view.hold_at(SCENE, START)
    view.page.get_by_role('checkbox', name='Follow').check()
    view.wait(lambda: off() < 2)
    view.key('ArrowLeft')
    go_on(view)
    view.wait(lambda: view.bodies(SCENE)[0][1] < -0.2)
    view.key(' ')
    view.button('Play').wait_for()
    view.wait(lambda: off() < 2)
    view.hold_at(SCENE, START)
    view.wait(lambda: off() < 2)
    view.page.get_by_role('checkbox', name='Follow').uncheck()


def test_pause_holds_and_step_makes_one_tick(view, states):
    view.hold_at(SCENE, START)
    for tick in (1, 2):
        view.press('Step')
        view.wait(lambda tick=tick: abs(
            view.bodies(SCENE) - states[tick].positions).max() < 1e-6)
    go_on(view)
    view.wait(lambda: far(view, states[2].positions, 0.1))


@pytest.mark.slow  # test_viewer.py has two pages without a browser
def test_two_pages_show_and_steer_the_same(browser, url, view):
    view.hold_at(SCENE, START)  # before the other one: what moves is drawn twice
    with opened(browser, url, SCENE) as other:
        other.wait(lambda: abs(other.bodies(SCENE) - START).max() < 1e-6)
        go_on(other)
        for each in (view, other):
            each.wait(lambda each=each: far(each, START, 0.1))


def open_recording(view):
    """Open the folder with what saves a run."""
    if not view.button('Screenshot').count():
        view.page.get_by_text('Recording', exact=True).click()


def test_a_run_is_recorded(view, states, tmp_path):
    """From the start on, each recorded pose is the simulation's at that tick, to the bit."""
    open_recording(view)
    view.hold_at(SCENE, START)
    view.press('Record')
    view.button('Stop and download').wait_for()
    go_on(view)
    view.wait(lambda: far(view, START, 0.3))  # a quarter of a second, 15 pictures
    with view.page.expect_download() as download:
        view.press('Stop and download')
    download.value.save_as(tmp_path / 'run.mcap')
    view.hold_at(SCENE, START)
    recording = load_recording(tmp_path / 'run.mcap')
    assert recording.scene == SCENE and len(recording) > 5
    for time_, positions in zip(recording.times, recording.positions, strict=True):
        tick = min(round(time_ / SCENE.step), len(states) - 1)  # it lies still from there on
        np.testing.assert_array_equal(positions, states[tick].positions)


def test_the_run_is_saved(view, states, tmp_path):
    """What *Export* sends: each format, and in the recording the simulation's poses to the bit, all
    since the last reset.
    """
    view.hold_at(SCENE, START)
    go_on(view)
    view.wait(lambda: far(view, START, 0.1))
    open_recording(view)
    with view.page.expect_download() as download:
        view.press('Export: glTF, BVH, CSV, MCAP')
    download.value.save_as(tmp_path / 'run.zip')
    with zipfile.ZipFile(tmp_path / 'run.zip') as package:
        assert package.namelist() == [f'run{suffix}' for suffix in FORMATS]
        package.extractall(tmp_path)
    recording = load_recording(tmp_path / 'run.mcap')
    table = np.array([state.positions for state in states])
    assert len(recording) > 5 and all((table == each).all(axis=(1, 2)).any()
                                      for each in recording.positions[-3:])
    assert abs(recording.positions[0] - START).max() < 1e-6


def test_a_time_is_typed(view, states):
    """As people do, who take a while between the click and each key; and time stands there."""
    view.tab('Play')
    view.hold_at(SCENE, START)
    go_on(view)
    field = view.page.get_by_label('Time', exact=True)
    for text in ('0.5', '0,25'):
        view.press('Live')
        view.wait(lambda: float(field.input_value()) > 1)
        field.click()
        view.key('Control+a')
        view.page.wait_for_timeout(1000)
        for key in text:
            view.key(key)
            view.page.wait_for_timeout(300)
        text = text.replace(',', '.')
        assert field.input_value() == text
        tick = round(float(text) / SCENE.step)
        view.wait(lambda tick=tick: index_of(view.bodies(SCENE), states) == tick)
        seen = view.bodies(SCENE)
        view.page.wait_for_timeout(1000)
        assert field.input_value() == text and (view.bodies(SCENE) == seen).all()
        view.page.mouse.click(20, 20)
    field.click()
    field.fill('9999')
    note = view.page.get_by_text('This run is kept from 0.00 to')
    note.wait_for()
    view.page.mouse.click(20, 20)
    note.wait_for(state='hidden')
    view.press('Live')
    view.button('Pause').wait_for()


@pytest.mark.slow  # test_viewer_playback.py plays without a browser
def test_a_run_is_played_back(browser, states, tmp_path):
    """To its last pose, where it stays."""
    made = [states[tick] for tick in (0, 10, 20)]
    recording = Recording(SCENE, np.array((0, 10, 20)) * SCENE.step,
                          np.array([state.positions for state in made]),
                          np.array([state.orientations for state in made]))
    (tmp_path / 'run.mcap').write_bytes(recording_bytes(recording))
    with (serving('--port', '0', '--play', str(tmp_path / 'run.mcap')) as url,
          opened(browser, url, SCENE) as page):
        page.wait(lambda: abs(page.bodies(SCENE) - recording.positions[-1]).max() < 1e-6)
        page.page.get_by_text(re.compile(r'run\.mcap: [0-9.]+ of [0-9.]+ s')).wait_for()
        page.page.get_by_text('A recorded run.').wait_for()
        for words in ('Strength, N', 'Scene', 'Engine', 'Settings'):
            assert not page.page.get_by_text(words, exact=True).count()


def test_the_view_is_saved_as_png(view, tmp_path):
    """As large as the page is drawn, white beside the doll, and not where the torso is seen.

    Viser draws three quarters of the pixels each way at least where a page is slow.
    """
    view.hold_at(SCENE, START)
    open_recording(view)
    with view.drawing(), view.page.expect_download() as download:
        view.press('Screenshot')
    download.value.save_as(tmp_path / 'view.png')
    picture = iio.imread(tmp_path / 'view.png')
    canvas = view.page.locator('canvas').first.bounding_box()
    share, width = picture.shape[0] / canvas['height'], canvas['width']
    x, y = (view.pixels(START[:1])[0] * share).astype(int)
    # Viser rounds both sides to pixels, and draws any share of them where a page is slow.
    assert picture.shape[0] + 1 > 0.75 * SHARPNESS * canvas['height'] and picture.shape[2] == 3
    assert picture.shape[1] == pytest.approx(share * width, abs=1)
    assert (picture[2, 2] == 255).all() and picture[y, x].min() < 200


def edited():
    """The default scene with an arm of 7.5 kg whose first axis is limited to -90 to 30 degrees."""
    placement = SCENE.dolls[0]
    doll = placement.doll.replace_bone('left_upper_arm', mass=7.5)
    limits = (tuple(np.radians((-90, 30)).tolist()), tuple(np.radians((-90, 90)).tolist()))
    joints = tuple(dataclasses.replace(joint, limits=limits) if joint.child == 'left_upper_arm'
                   else joint for joint in doll.joints)
    doll = dataclasses.replace(doll, joints=joints)
    return dataclasses.replace(SCENE, dolls=(dataclasses.replace(placement, doll=doll),))


def saved(view, folder, name):
    """What the page saves under a name."""
    view.field('File').fill(name)
    view.press('Save')
    view.see(f'saved {name}.yaml')
    return load_scene(str(folder / f'{name}.yaml'))


def choose(view, name):
    """Choose a bone by a click on it, where it stands at the start; its numbers are shown then."""
    index = SCENE.bone_index(name)
    view.page.mouse.click(*view.pixels(START[index:index + 1])[0])
    view.wait(lambda: view.field('Bone').input_value() == name
              and float(view.field('Mass, kg').input_value()) == SCENE.bones[index].mass)


def test_a_body_and_its_joint_are_edited_saved_undone_and_loaded(view, folder):
    """What is saved is what the edit would give here; a faulty value is refused below its field."""
    view.hold_at(SCENE, START)
    view.tab('Edit')
    choose(view, 'left_upper_arm')
    view.field('Mass, kg').fill('-1')
    view.press('Update')
    view.see('mass must be above 0 kg, not -1')
    assert (view.top(view.field('Mass, kg')) < view.top(view.page.get_by_text('mass must be'))
            < view.top(view.field('Position, m')))
    assert saved(view, folder, 'untouched') == SCENE
    view.field('Mass, kg').fill('7.5')
    view.field('Limits 1, °').fill('-90, 30')
    view.press('Update')
    view.see('Undo: numbers of left_upper_arm')
    assert saved(view, folder, 'edited') == edited()
    view.key('Control+z')
    view.see('Redo: numbers of left_upper_arm')
    assert saved(view, folder, 'undone') == SCENE
    view.field('File').fill('edited')
    view.press('Load')
    view.see('loaded edited')
    assert saved(view, folder, 'loaded') == edited()


def test_a_colour_is_typed_or_refused(view, folder):
    """By a name that viser does not know; what is none is told at its field, and once more by
    Update, as the field shows the colour before by then; a click into the picker forgets it.
    """
    view.hold_at(SCENE, START)
    view.tab('Edit')
    choose(view, 'head')
    field, names, blue = view.field('Colour'), map(str, itertools.count()), (30, 144, 255)

    def color():
        scene = saved(view, folder, 'color_' + next(names))
        return tuple(round(255 * part) for part in scene.bones[scene.bone_index('head')].color[:3])

    def type_there(text):
        field.fill(text)
        field.blur()
    for text, meant in (('rebeccapurple', (102, 51, 153)), ('30 144 255', blue)):
        field.fill(text)
        view.press('Update')
        view.wait(lambda meant=meant: field.input_value() == f'rgb{meant}' and color() == meant)
    words = view.page.get_by_text('colour must be')
    for text in ('redd', '#1e90f', 'rgb(300, 2, 3)'):
        type_there(text)
        words.wait_for()
        assert words.text_content().endswith(f', not {text}')
        view.wait(lambda: field.input_value() == f'rgb{blue}')
        view.press('Update')
        assert color() == blue
        words.wait_for()
        view.press('Update')
        words.wait_for(state='hidden')
        assert color() == blue
    type_there('redd')
    words.wait_for()
    field.click()
    view.page.locator('.mantine-ColorInput-saturation').click()
    words.wait_for(state='hidden')
    view.press('Update')
    view.wait(lambda: color() != blue)


def test_what_is_edited_falls(view):
    """What is drawn from then on is the edited doll's fall, as a simulation here has it."""
    view.tab('Play')
    view.hold_at(SCENE, START)
    with Simulation(edited()) as simulation:
        states = [simulation.state, *(simulation.advance() for _ in range(100))]
    go_on(view)
    view.wait(lambda: index_of(view.bodies(SCENE), states) > 35)


HANDLES = """() => {
  const nodes = window.__viserMutable.nodeRefFromName;
  const toWorld = nodes[''].matrixWorld.clone().invert();
  return Object.keys(nodes).filter(name => /^.editor.[0-9]+.body$/.test(name) && nodes[name])
    .map(name => toWorld.clone().multiply(nodes[name].matrixWorld).elements.slice(12, 15));
}"""
"""Where the handles are drawn, (1, 3) m, z up; of handles that are gone only their names stay."""


@pytest.mark.parametrize('height', [0.2, 0.06])
def test_a_body_is_dragged_by_its_handle(view, height):
    """By the arrow out of its top, by 0.2 m, as far as whole pixels and ten steps go; above the
    head, and where the head itself is before the arrow. From twice as far as the home view, which
    puts the arrow's tip under the banner in so small a window.
    """
    view.hold_at(SCENE, START)
    view.tab('Edit')
    choose(view, 'head')
    if view.button('Edit').count():
        view.press('Edit')
    view.page.locator('.ragdoll-edit-banner').wait_for()
    view.key('w')
    view.look((6.4, -1.8, 1.9), (0.0, 0.0, 1.0))
    head = SCENE.bone_index('head')
    view.wait(lambda: np.allclose(view.page.evaluate(HANDLES) or np.inf, START[head], atol=1e-6))
    (x0, y0), (x1, y1) = view.pixels(START[head] + np.outer((height, height + 0.2), (0, 0, 1)))
    view.page.mouse.move(x0, y0)
    view.page.mouse.down()
    view.page.mouse.move(x1, y1, steps=10)
    view.page.mouse.up()
    view.see('Undo: move head')
    view.wait(lambda: abs(view.bodies(SCENE)[head] - START[head]).max() > 0.1)
    moved = view.all_bodies(SCENE) - START
    assert moved[head] == pytest.approx((0, 0, 0.2), abs=0.03)
    assert abs(np.delete(moved, head, axis=0)).max() < 1e-6
    view.key('Control+z')
    view.wait(lambda: abs(view.bodies(SCENE) - START).max() < 1e-6)
    view.key('h')
    view.press('Run')
    view.page.locator('.ragdoll-edit-banner').wait_for(state='hidden')


CUT_OFF = """() => [...document.querySelectorAll('input')].filter(field => field.checkVisibility()
    && field.scrollWidth > field.clientWidth).map(field => field.value)"""


def test_numbers_are_seen_whole(view):
    """Three beside each other, as a fitted doll has them: to the micrometre."""
    view.hold_at(SCENE, START)
    view.tab('Edit')
    choose(view, 'right_shin')
    view.field('Position, m').fill('-0.123457, -1.123456, -0.888888')
    assert view.page.evaluate(CUT_OFF) == []


PLOTTED = """async () => {
  const charts = Object.values(window.__viserTestpoints?.uplots ?? {}).map(point => point.chart);
  const chart = charts.find(chart => chart.series.length === 3 && chart.ctx.canvas.width > 0);
  if (!chart) return null;
  chart.setData([[0, 1], [0, 888888], [0, 888888]]);
  await new Promise(requestAnimationFrame);
  const {width, height} = chart.ctx.canvas;
  const ink = chart.ctx.getImageData(0, 0, width, height).data.filter((_, k) => k % 4 === 3);
  return Array.from({length: width}, (_, x) => ink.some((a, k) => a && k % width === x));
}"""


def test_numbers_beside_a_plot_are_seen_whole(view):
    """Hundreds of thousands: what is drawn begins within the plot, not at its very edge."""
    view.hold_at(SCENE, START)
    view.tab('Plots')
    inked = view.wait(lambda: view.page.evaluate(PLOTTED))
    assert any(inked[:40]) and not any(inked[:2])


ENDS = """() => Object.values(window.__viserTestpoints?.uplots ?? {})
  .filter(({chart}) => chart.ctx.canvas.isConnected)
  .map(({chart}) => chart.scales.x.max === chart.data[0].at(-1) ? chart.scales.x.max : 0)"""
"""Where each plot that is seen ends, s; 0 if that is not where its last point is."""


def test_plots_are_drawn_of_another_scene(view):
    """What is younger than what was plotted before is plotted at once, on a scale of its own.

    A busy machine may look when it is as old: then that scene has its turn again.
    """
    from playwright.sync_api import TimeoutError as TooLate
    view.tab('Play')
    view.hold_at(SCENE, START)
    go_on(view)
    view.tab('Plots')
    view.wait(lambda: min(view.page.evaluate(ENDS), default=0) > 2)
    left, end = {'flight', 'drop'}, time.monotonic() + PATIENCE
    for scene in itertools.cycle(('flight', 'drop')):
        assert time.monotonic() < end, left
        view.tab('Play')
        view.row('Scene').locator('input').first.click()
        view.page.get_by_role('option', name=scene, exact=True).click()
        view.tab('Plots')
        # The page looks itself, with each picture: from here each look may come 2 s later.
        with contextlib.suppress(TooLate):
            view.page.wait_for_function(
                f'() => {{ const ends = ({ENDS})(); return ends.length === 3'
                ' && Math.min(...ends) > 0.5 && Math.max(...ends) < 2; }', timeout=10_000)
            left.discard(scene)
        if not left:
            break


def upload(view, button, name, content):
    with view.page.expect_file_chooser() as chooser:
        view.press(button)
    chooser.value.set_files({'name': name, 'mimeType': '', 'buffer': content})


NOTES = """() => [...document.querySelectorAll('.mantine-Notification-root')]
  .filter(note => note.textContent.startsWith('Uploading'))
  .map(note => [note.textContent.split(' ')[1], note.style.display])"""
"""Of uploads: each with its file's name, and how it is displayed."""


def test_a_page_tells_of_its_own_uploads_alone(browser, url, view):
    view.tab('Edit')
    upload(view, 'Upload a scene or doll', 'doll.yaml',
           (ROOT / 'config' / 'doll.yaml').read_bytes())
    view.wait(lambda: view.page.evaluate(NOTES) == [['doll.yaml', '']])
    other = View(browser, url)
    other.tab('Edit')
    other.wait(lambda: other.page.evaluate(NOTES) == [['undefined', 'none']])
    other.close()


@pytest.mark.slow  # test_editor_wire.py uploads both without a browser
def test_rubbish_is_refused_and_a_character_is_fitted(view):
    """What was uploaded is told by its name; the skin is in the page then."""
    view.tab('Edit')
    upload(view, 'Fit a character', 'no_skin.glb', BROKEN['no_skin.glb'])
    view.see('no_skin.glb: 1 error')
    upload(view, 'Fit a character', 'bird.glb', fit_rigs.document(fit_rigs.RIGS['bird']).glb())
    view.see('fitted bird.glb')
    view.wait(lambda: view.page.evaluate(
        'Object.keys(window.__viserMutable.nodeRefFromName).some('
        'name => /^.scene.skins.[0-9]+$/.test(name))'))


def test_a_robot_in_sdf_is_uploaded_and_falls(view, tmp_path):
    """The handle stands 0.4 m above the ground, the head over it; both are drawn as they fall."""
    path = tmp_path / 'flail.sdf'
    path.write_text(FLAIL_SDF)
    scene = all_above_ground('flail', [placement for placement, _ in read_sdf(path)])
    view.tab('Edit')
    upload(view, 'Fit a character', 'flail.sdf', FLAIL_SDF.encode())
    view.see('fitted flail.sdf: 2 bones')
    view.see('verdict: ')
    view.wait(lambda: np.isfinite(view.bodies(scene)).all())
    view.wait(lambda: view.bodies(scene)[1][2] < 0.5)
    view.hold_at(scene, np.array([[4, 5, 0.9], [4, 5, 1.7]]))


def test_an_sdf_in_which_nothing_moves_says_so(view):
    still = FLAIL_SDF.replace('<model name="flail">', '<model name="flail"><static>1</static>')
    view.tab('Edit')
    upload(view, 'Fit a character', 'still.sdf', still.encode())
    view.see('still.sdf: 1 error')
    view.see('expected a model that moves')

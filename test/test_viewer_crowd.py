"""The page with a thousand dolls: what it draws, sends and lists of them, and what is clicked."""
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip('viser')
import fit_rigs
from browser import chromium, opened, serving
from fit_rigs import RIGS
from page_client import batch_of, served, wait
from viser import _messages

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.recording import Recording
from ragdoll_ros.viewer.drawing import joint_limits, skin_meshes
from ragdoll_ros.viewer.drawing.joint_limits import ARC_SEGMENTS, JointLimits
from ragdoll_ros.viewer.drawing.stage import Stage
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.sources.source import Frame

FIELD = load_scene('field')
BONES = len(FIELD.bones)
CENTRES = np.array([placement.position for placement in FIELD.dolls])[FIELD.doll_of_bone]

UP = np.array((0.0, 0.0, 1.0))

MOVED = 700
"""The doll that moves where only one does."""


@pytest.fixture(scope='module')
def recording():
    """All bones stand apart at first; then one doll rises by 1 m and turns; then all have."""
    begin = CENTRES + np.arange(BONES)[:, None] % 10 * (0.1, 0.0, 0.2)
    one = np.zeros((BONES, 1))
    one[FIELD.bone_slices[MOVED]] = 1
    still, turned = np.array((0, 0, 0, 1.0)), np.array((0, 0, 0.6, 0.8))
    return Recording(
        FIELD, np.arange(3.0), np.array([begin, begin + one * UP, begin + UP]),
        np.array([np.tile(still, (BONES, 1)), np.where(one, turned, still),
                  np.tile(turned, (BONES, 1))]))


@pytest.fixture
def page(recording):
    """The recording, held at its start."""
    source = PlaybackSource(recording)
    source.pause(True)
    with served(source) as page:
        page.open(look_at=(20.0, 20.0, 0.8))
        wait(lambda: page.editor and page.frame is not None)
        yield page


def sent(page, bones):
    """Go to the next instant, and wait for its picture, a message of 28 bytes for each of so many
    bones; with it may come the first values of the panel, 4 kB.
    """
    client, time = page.clients[0], page.frame.time
    before = len(client.sizes)
    page.source.step()
    wait(lambda: page.frame.time == time + 1 and any(
        28 * bones <= size < 29 * bones + 8000 for size in client.sizes[before:]))


def drawn(page):
    """Places (n, 3) m and orientations (n, 4) x, y, z, w of all bones, as they are drawn."""
    places, orientations = np.full((BONES, 3), np.nan), np.full((BONES, 4), np.nan)
    for batch in page.stage.bodies.batches:
        assert np.isnan(places[batch.bones]).all(), 'each bone once'
        places[batch.bones] = batch.handle.batched_positions
        orientations[batch.bones] = batch.handle.batched_wxyzs[:, [1, 2, 3, 0]]
    return places, orientations


def test_ten_thousand_bones_are_drawn_in_ten_batches_where_they_are(page, recording):
    """To the 32 bits of a page's numbers: 4e-6 m at 50 m."""
    assert len(page.stage.bodies.batches) == 10
    for instant in range(3):
        places, orientations = drawn(page)
        assert np.abs(places - recording.positions[instant]).max() < 4e-6
        assert np.abs(orientations - recording.orientations[instant]).max() < 1e-7
        if instant < 2:
            sent(page, (2000, BONES)[instant])


def test_only_what_moves_is_sent(page):
    """28 bytes a bone where all move; where one doll does, those of the batches it is in."""
    sent(page, 2000)
    sent(page, BONES)


@pytest.mark.parametrize('doll', [1, MOVED, 1000])
@pytest.mark.parametrize('bone', ['head', 'right_shin'])
def test_a_click_chooses_the_bone_of_the_doll_that_it_hits(page, doll, bone):
    name = f'{FIELD.dolls[doll - 1].name}/{bone}'
    node, number, place = batch_of(page, name)
    page.clients[0].send(_messages.SceneNodeClickMessage(
        name=node, instance_index=number, ray_origin=tuple(np.add(place, (4, 0, 0))),
        ray_direction=(-1.0, 0.0, 0.0), screen_pos=(0.5, 0.5), modifier=None))
    wait(lambda: page.editor.panel.bone.value == name)
    assert page.editor.bone == name and len(page.editor.panel.bone.options) == 11


def test_joint_limits_are_those_of_the_dolls_that_are_looked_at(page):
    """25 of a thousand, 2.5 m apart: within 9 m of the point that the page looks at.

    A page is brought home as it opens, so it may have to look there more than once.
    """
    limits, state = JointLimits(page.server, FIELD), page.frame.state

    def shown():
        page.clients[0].look((20.0, 16.0, 3.0), (20.0, 20.0, 0.8))
        limits.show(state, np.zeros(len(FIELD.angle_names)))
        return page.server.scene.get_handle_by_name('/scene/limits').points

    wait(lambda: np.linalg.norm(shown()[..., :2] - (20, 20), axis=-1).max() < 9)
    dials = sum(pair is not None for joint in FIELD.dolls[0].doll.joints
                for pair in joint.angle_limits)
    assert len(shown()) == joint_limits.MAX_DOLLS * dials * (ARC_SEGMENTS + 1)


def test_dolls_without_a_skin_show_their_bones_beside_those_with_one(tmp_path, monkeypatch):
    """Skins beyond the most that are shown: the page tells, and their dolls have bones."""
    import viser
    monkeypatch.setattr(skin_meshes, 'MAX_SKINS', 1)
    model = str(fit_rigs.write(RIGS['bird'], tmp_path))
    doll = dataclasses.replace(fit_rigs.fitted('bird').doll, model=model)
    scene = Scene('s', (Placement(doll, 'a'), Placement(doll, 'b', (2, 0, 0))))
    poses = [placement.bone_pose(bone) for placement in scene.dolls for bone in doll.bones]
    state = State(*(np.array(column) for column in zip(*poses, strict=True)),
                  *np.zeros((2, len(poses), 3)))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    stage = Stage(server, Frame(scene, 0.0, state))
    for bones, skins, seen in ((False, True, 1), (True, True, 2), (False, False, 2)):
        stage.set_visible(bones=bones, skins=skins)
        shown = {int(scene.doll_of_bone[bone]) for batch in stage.bodies.batches
                 if batch.handle.visible for bone in batch.bones}
        assert shown == set(range(2 - seen, 2))
    server.stop()
    assert stage.skins.notes == ['skins of 1 dolls: the others show their bones']


def test_a_click_in_a_browser_hits_one_doll_of_several(tmp_path):
    """Each in front of a bone of another one."""
    crowd = load_scene('crowd')
    with Simulation(crowd) as simulation:
        start = simulation.state.positions
    with serving('--port', '0', '--scene', 'crowd', '--folder', str(tmp_path)) as url, \
            chromium() as context, opened(context, url, crowd, first=True) as view:
        view.hold_at(crowd, start)
        view.key('h')
        view.tab('Edit')
        for name in ('doll_8/torso', 'doll_7/torso', 'doll_7/head'):
            index = crowd.bone_index(name)
            view.page.mouse.click(*view.pixels(start[index:index + 1])[0])
            view.wait(lambda name=name: view.field('Bone').input_value() == name
                      and view.field('Doll').input_value() == name.split('/')[0])

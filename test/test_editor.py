"""The editor on a real viser server: what is set in its widgets is done, or refused in words."""
import dataclasses
import html
import os
import re
import threading
import time
from datetime import datetime

import fit_rigs
import numpy as np
import pytest
import yaml

viser = pytest.importorskip('viser')

from page_client import wait  # noqa: E402
from specimens import HAMMER  # noqa: E402
from test_fit_broken import BROKEN  # noqa: E402

from ragdoll_ros.files.doll import load_doll, save_doll  # noqa: E402
from ragdoll_ros.files.scene import load_scene, save_scene  # noqa: E402
from ragdoll_ros.fit.judging.finding import Finding  # noqa: E402
from ragdoll_ros.fit.judging.verdict import Verdict  # noqa: E402
from ragdoll_ros.model import errors, rotation  # noqa: E402
from ragdoll_ros.model.follow import Follow  # noqa: E402
from ragdoll_ros.model.ragdoll import Bone, Ragdoll, joint_frame  # noqa: E402
from ragdoll_ros.model.scene import Placement, Scene, above_ground  # noqa: E402
from ragdoll_ros.physics.simulation import Simulation  # noqa: E402
from ragdoll_ros.recordings.recording import Recording  # noqa: E402
from ragdoll_ros.viewer.editor import changes, scene_folder  # noqa: E402
from ragdoll_ros.viewer.editor.banner import Banner  # noqa: E402
from ragdoll_ros.viewer.editor.editor import Editor  # noqa: E402
from ragdoll_ros.viewer.sources.playback import PlaybackSource  # noqa: E402
from ragdoll_ros.viewer.sources.simulation import SimulationSource  # noqa: E402
from ragdoll_ros.viewer.sources.source import RequestedData  # noqa: E402
from ragdoll_ros.viewer.viser_internals import handle_id  # noqa: E402
from ragdoll_ros.viewer.widgets.form import AMBER, GREEN, MIXED, RED  # noqa: E402

DROP = load_scene('drop')


@pytest.fixture(scope='module')
def server():
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    yield server
    server.stop()


class Desk:
    """An editor and what it asked of its page."""

    def __init__(self, server, path, scene=DROP):
        server.gui.reset()
        server.scene.reset()
        self.asked = []
        self.reason = ''
        self.path = path
        self.editor = Editor(server, scene, lambda scene: self.use(scene), self.asked.append,
                             Banner(server.gui), path)
        self.panel, self.files = self.editor.panel, self.editor.files

    def use(self, scene):
        if self.reason:
            raise errors.RagdollError(self.reason)
        self.asked.append(scene)

    def bone(self, name):
        return changes.find(self.editor.scene, name)[1]

    def said(self):
        return html.unescape(self.files.message.content)


def errors_in(panel):
    """What is seen below the fields, by their keys."""
    return {key: said.content for form in (panel.body, panel.joint)
            for key, said in form.errors.items() if said.visible}


def enter(desk, key, text):
    """Type into a field and press Enter."""
    desk.panel.body[key].value = text
    desk.editor._on_enter(handle_id(desk.panel.body[key]))


@pytest.fixture
def desk(server, tmp_path):
    return Desk(server, tmp_path)


def test_a_mass_and_a_limit_are_edited_saved_loaded_and_undone(desk):
    desk.editor.select('left_shin')
    desk.panel.body['mass'].value = 7.5
    desk.panel.joint['limits_1'].value = '-5, 100'
    desk.editor.update()
    edited = desk.editor.scene
    assert desk.asked == [edited]
    assert desk.bone('left_shin').mass == 7.5
    assert np.degrees(changes.joint_of(edited, 'left_shin').limits) == pytest.approx(
        np.array([[-5, 100]]))
    desk.files.name.value = 'mine'
    desk.files.save()
    assert load_scene(str(desk.path / 'mine.yaml')) == edited
    desk.editor.undo()
    assert desk.editor.scene == DROP == desk.asked[-1]
    assert desk.panel.body['mass'].value == '5' and desk.panel.joint['limits_1'].value == '0, 126'
    desk.files.load()
    assert desk.editor.scene == edited == desk.asked[-1]
    assert desk.panel.body['mass'].value == '7.5'
    desk.editor.undo()
    desk.editor.undo()
    assert desk.editor.scene == DROP
    desk.editor.redo()
    assert desk.editor.scene == edited


@pytest.mark.parametrize(('typed', 'mass', 'friction'), [
    ([('mass', '3.5'), ('friction', '0.7'), ('restitution', '0.25')], 3.5, 0.7),
    ([('mass', '3.5'), ('mass', '5'), ('restitution', '0.25')], 5, None),
    ([('mass', '-1'), ('friction', '0.7'), ('mass', '3.5')], 3.5, 0.7)])
def test_all_that_is_entered_counts_however_long_a_change_takes(desk, typed, mass, friction):
    """The second is entered while the first is applied, the third before the second is."""
    begun, go_on, use = threading.Semaphore(0), threading.Semaphore(0), desk.use

    def use_late(scene):
        begun.release()
        assert go_on.acquire(timeout=60)
        use(scene)

    desk.editor.select('left_shin')
    desk.use = use_late
    first_is_refused = typed[0][1].startswith('-')
    enter(desk, *typed[0])
    if first_is_refused:
        wait(lambda: errors_in(desk.panel))
    else:
        assert begun.acquire(timeout=60)
    enter(desk, *typed[1])
    go_on.release()
    if not first_is_refused:
        assert begun.acquire(timeout=60)
    enter(desk, *typed[2])
    go_on.release(2)
    desk.editor._actions.run(int).result(60)
    assert (desk.bone('left_shin').mass, desk.bone('left_shin').friction) == (mass, friction)
    assert desk.bone('left_shin').restitution == (0.25 if typed[2][0] == 'restitution' else None)


def test_the_value_of_before_may_be_typed_while_another_is_applied(desk):
    begun, go_on, use = threading.Event(), threading.Event(), desk.use

    def use_late(scene):
        begun.set()
        assert go_on.wait(60)
        use(scene)

    desk.editor.select('left_shin')
    desk.use = use_late
    mass = desk.panel.body['mass']
    before = mass.value
    mass.value = '7'
    update = threading.Thread(target=desk.editor.update)
    update.start()
    assert begun.wait(60)
    mass.value = before
    go_on.set()
    update.join(60)
    assert desk.bone('left_shin').mass == 7
    assert mass.value == before
    desk.editor.update()
    assert desk.bone('left_shin').mass == float(before)


def test_a_change_is_current_though_the_page_draws_a_scene_from_elsewhere_first(desk):
    """That was loaded just before the change, and is drawn after it."""
    changed = changes.change_bone(DROP, 'head', mass=3.0)
    desk.editor.set_scene(changed, 'mass')
    desk.editor.show(load_scene('flight'))
    desk.editor.show(changed)
    assert desk.editor.scene == changed


def test_a_faulty_value_is_refused_where_it_stands_and_stays(desk):
    desk.editor.select('left_shin')
    desk.panel.body['mass'].value = -3.0
    desk.panel.body['friction'].value = '<b>much</b>'
    desk.panel.joint['limits_1'].value = '30, 10'
    desk.panel.joint['anchor'].value = (0.0, 0.1, 0.6)
    desk.editor.update()
    errors = errors_in(desk.panel)
    assert set(errors) == {'mass', 'friction', 'limits_1'}
    assert 'mass must be above 0 kg, not -3' in errors['mass']
    assert 'limits 1 must be lower &lt;= upper, not 30, 10' in errors['limits_1']
    # What was typed is text, no part of the page.
    assert '<b>' not in errors['friction'] and '&lt;b&gt;much' in errors['friction']
    assert desk.editor.scene == DROP and desk.asked == []
    assert desk.panel.body['mass'].value == '-3.0'
    assert desk.panel.joint['limits_1'].value == '30, 10'
    desk.panel.body['mass'].value = 3.0
    desk.panel.body['friction'].value = ''
    desk.panel.joint['limits_1'].value = '10, 30'
    desk.editor.update()
    assert errors_in(desk.panel) == {}
    assert desk.bone('left_shin').mass == 3
    assert changes.joint_of(desk.editor.scene, 'left_shin').anchor == (0, 0.1, 0.6)


@pytest.mark.parametrize(('key', 'text', 'words'), [
    ('rotation', '0 0 x', 'rotation must be 3 numbers, such as 0.1, 0.2, 0.3, not 0 0 x'),
    ('axis_1', '1 1 0', 'axis 1 must be perpendicular to axis 2, which is 1, 0, 0, not 1, 1, 0'),
    ('axis_2', '1 1 0', 'axis 2 must be perpendicular to axis 1, which is 0, 1, 0, not 1, 1, 0')])
def test_what_is_refused_is_told_in_words_at_the_field_that_was_changed(desk, key, text, words):
    desk.editor.select('left_thigh')
    form = desk.panel.joint if key.startswith('axis') else desk.panel.body
    form[key].value = text
    desk.editor.update()
    assert {key: re.sub('<.*?>', '', said) for key, said in errors_in(desk.panel).items()} == {
        key: words}


def fix_root(desk):
    """Fix the first doll's root by its field."""
    placement = desk.editor.scene.dolls[0]
    desk.editor.select(desk.editor.scene.qualified(placement, placement.doll.root.name))
    desk.panel.body['fixed_root'].value = True
    desk.editor.update()


def placed(scene, **fields):
    """The scene with fields of its first doll replaced."""
    return dataclasses.replace(scene, dolls=(
        dataclasses.replace(scene.dolls[0], **fields), *scene.dolls[1:]))


def test_a_root_is_fixed_to_the_world_saved_and_undone(server, tmp_path):
    scene = placed(DROP, spin=(0, 0, 0))
    desk, fixed = Desk(server, tmp_path, scene), placed(scene, fixed_root=True)
    desk.editor.select('left_shin')
    assert not any(desk.panel.body[key].visible for key in ('fixed_root', 'velocity', 'spin'))
    fix_root(desk)
    assert desk.editor.scene == fixed and desk.asked == [fixed]
    assert '>torso (fixed)<' in desk.panel.tree._html.content
    desk.files.name.value = 'hung'
    desk.files.save()
    assert load_scene(str(desk.path / 'hung.yaml')) == fixed
    desk.editor.undo()
    assert desk.editor.scene == scene and not desk.panel.body['fixed_root'].value
    assert '(fixed)' not in desk.panel.tree._html.content
    desk.editor.redo()
    assert desk.editor.scene == fixed and desk.panel.body['fixed_root'].value
    desk.panel.body['fixed_root'].value = False
    desk.editor.update()
    assert desk.editor.scene == scene


@pytest.mark.parametrize('key', ['velocity', 'spin'])
def test_a_root_is_fixed_once_the_doll_has_no_velocity(server, tmp_path, key):
    moving = placed(DROP, **{'spin': (0, 0, 0), key: (0.1, 0, -1 / 3)})
    desk = Desk(server, tmp_path, moving)
    fix_root(desk)
    assert {key: re.sub('<.*?>', '', said) for key, said in errors_in(desk.panel).items()} == {
        key: f'{key} must be none: the root is fixed, not 0.1, 0, -0.3333333'}
    assert desk.editor.scene == moving and desk.asked == []
    desk.panel.body[key].value = '0 0 0'
    desk.editor.update()
    assert desk.editor.scene == placed(DROP, spin=(0, 0, 0), fixed_root=True)


@pytest.mark.parametrize(('key', 'placement'), [
    ('follow', Placement(Ragdoll('hammer', (Bone('hammer', HAMMER, 1.0, (0, 0, 1)),)),
                         follow=Follow())),
    ('animation', dataclasses.replace(load_scene('walker_faints').dolls[0],
                                      velocity=(0, 0, 0)))])
def test_a_root_that_something_else_moves_is_not_fixed(server, tmp_path, key, placement):
    desk = Desk(server, tmp_path, Scene('moves', (placement,)))
    fix_root(desk)
    assert {key: re.sub('<.*?>', '', said) for key, said in errors_in(desk.panel).items()} == {
        'fixed_root': f'root fixed to the world must be off for a doll with {key}'}
    assert desk.asked == [] and not desk.editor.scene.dolls[0].fixed_root


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_an_engine_that_fixes_no_roots_is_told(server, tmp_path, engine):
    pytest.importorskip('pybullet' if engine == 'bullet' else 'mujoco')
    scene = placed(DROP, spin=(0, 0, 0))
    source, desk = SimulationSource(scene, engine), Desk(server, tmp_path, scene)
    try:
        desk.use = source.set_scene
        fix_root(desk)
        assert re.sub('<.*?>', '', desk.panel.message.content) == (
            f'engine: expected rigid, which holds roots that are fixed, not {engine}')
        assert desk.editor.scene == scene
        source.set_engine('rigid')
        desk.editor.update()
        assert desk.editor.scene.dolls[0].fixed_root
        with pytest.raises(errors.RagdollError, match='rigid, which holds roots that are fixed'):
            source.set_engine(engine)
    finally:
        source.close()


def test_a_bone_without_a_partner_is_told_as_such(desk):
    desk.editor.select('head')
    desk.panel.both.value = True
    desk.panel.body['mass'].value = 4.0
    desk.editor.update()
    assert re.sub('<.*?>', '', desk.panel.message.content) == (
        'both sides: expected a bone with a partner on the other side, not head')


@pytest.mark.parametrize(('name', 'content', 'words'), [
    ('x.yaml', b'bones: 3', 'bones: expected a list ('),
    ('x.yaml', b'dolls: 1\nb: [1, 2\nc: 3\n',
     "expected YAML (did not find expected ',' or ']'), not c: 3"),
    ('x.glb', b'abc', 'byte 0: expected glTF, as a .glb begins, not abc')])
def test_what_is_no_file_of_its_kind_is_told_in_words(desk, name, content, words):
    (desk.files.fit if name.endswith('glb') else desk.files.upload)(name, content)
    assert words in desk.said()


def test_a_number_that_is_shown_rounded_stays_as_it_is(server, tmp_path):
    """Beside one that was typed, which is used to the digit, and stays as it was typed."""
    desk = Desk(server, tmp_path, changes.set_pose(DROP, 'head', (1 / 3, 2 / 3, 1.5)))
    desk.editor.select('head')
    place = desk.panel.body['position']
    assert place.value == '0.3333333, 0.6666667, 1.5'
    place.value = '0.3333333, 0.6666667, 1.60000000001'
    desk.panel.body['mass'].value = '1 000,5 g'
    desk.editor.update()
    assert desk.bone('head').position == (1 / 3, 2 / 3, 1.60000000001)
    assert desk.bone('head').mass == 1.0005
    assert place.value.endswith(' 1.60000000001')
    assert desk.panel.body['mass'].value == '1 000,5 g'


def test_what_the_page_cannot_run_is_refused(desk):
    desk.editor.select('head')
    desk.reason = 'no node to take it'
    desk.panel.body['mass'].value = 2.0
    desk.editor.update()
    assert 'no node to take it' in desk.panel.message.content
    desk.editor.toggle()
    assert desk.editor.scene == DROP and not desk.editor.editing
    desk.reason = ''
    desk.editor.update()
    assert desk.bone('head').mass == 2
    desk.reason = 'gone'
    desk.editor.undo()
    assert desk.bone('head').mass == 2 and desk.panel.redo.label == 'Redo'


def test_both_sides(desk):
    desk.editor.select('left_upper_arm')
    desk.panel.both.value = True
    desk.panel.joint['limits_1'].value = '-20, 45'
    desk.editor.update()
    right = changes.joint_of(desk.editor.scene, 'right_upper_arm')
    assert np.degrees(right.limits[0]) == pytest.approx((-45, 20))
    desk.editor.select('head')
    desk.panel.body['mass'].value = 2.0
    desk.editor.update()
    assert 'partner on the other side' in desk.panel.message.content
    assert desk.bone('head').mass == 5


def test_another_kind_is_suggested_and_applied_by_update(desk):
    desk.editor.select('left_upper_arm')
    desk.panel.body['shape'].value = 'capsule'
    desk.panel.joint['kind'].value = 'hinge'
    # The arm is 0.05 m thick and 0.2 m long along y.
    assert desk.panel.body['radius'].value == '0.025'
    assert not desk.panel.body['size'].visible and not desk.panel.joint['axis_2'].visible
    assert desk.editor.scene == DROP
    desk.editor.update()
    bone = desk.bone('left_upper_arm')
    assert (bone.shape.radius, bone.shape.length) == pytest.approx((0.025, 0.15))
    along = rotation.rotate(bone.orientation, (0, 0, 1))
    assert abs(along[1]) == pytest.approx(1)
    assert changes.joint_of(desk.editor.scene, 'left_upper_arm').kind == 'hinge'


def test_the_root_has_no_joint_fields(desk):
    desk.editor.select('torso')
    assert not desk.panel.joint_folder.visible and desk.panel.body_folder.visible
    desk.editor.select(None)
    assert not desk.panel.body_folder.visible
    desk.editor.select('nobody')
    assert desk.editor.bone is None
    desk.editor.update()
    assert 'a bone of the list' in desk.panel.message.content


def test_several_bones_are_edited_as_one_step(desk):
    """What they share is shown, what differs is not applied until something is typed there."""
    names = ('head', 'left_shin', 'left_thigh')
    scene = changes.change_bone(DROP, 'head', friction=0.3)
    desk.editor.show(scene)
    for name in names:
        desk.editor.select(name, add=True)
    body, joint = desk.panel.body, desk.panel.joint
    assert body['mass'].value == '5' and body['friction'].value == MIXED
    assert not body['position'].visible and not joint['kind'].visible
    assert joint['damping'].visible and '3 bones' in desk.panel.advice.content
    body['mass'].value = '2.5'
    joint['damping'].value = '0.75'
    desk.editor.update()
    edited = desk.editor.scene
    assert [desk.bone(name).mass for name in names] == [2.5] * 3
    assert [changes.joint_of(edited, name).damping for name in names] == [0.75] * 3
    assert [desk.bone(name).friction for name in names] == [0.3, None, None]
    assert {bone.mass for bone in edited.bones if bone.name not in names} == {
        bone.mass for bone in DROP.bones if bone.name not in names}
    body['friction'].value = '0.4'
    desk.editor.update()
    assert [desk.bone(name).friction for name in names] == [0.4] * 3
    desk.editor.undo()
    assert desk.editor.scene == edited and body['friction'].value == MIXED
    desk.editor.undo()
    assert desk.editor.scene == scene
    body['friction'].value = '-1'
    desk.editor.update()
    assert set(errors_in(desk.panel)) == {'friction'} and desk.editor.scene == scene
    desk.editor.select('head', add=True)
    assert desk.editor.bones == names[1:]
    desk.editor.select('head')
    assert desk.editor.bones == ('head',) and body['position'].visible


def test_several_bones_are_outlined_without_handles(server, desk):
    desk.editor.toggle()
    desk.editor.select('head')
    desk.editor.select('left_shin', add=True)
    handles = desk.editor.handles
    assert handles.body is None and handles.size is None
    for number, name in enumerate(('head', 'left_shin')):
        frame = server.scene.get_handle_by_name(f'{handles.root}/{number}/frame')
        assert tuple(frame.position) == pytest.approx(desk.bone(name).position)
    desk.editor.select('head')
    assert handles.body is not None


def test_the_tree_has_each_bone_below_its_parent(server, tmp_path):
    """Of the doll at hand, in a scene of several; names are text."""
    doll = DROP.dolls[0].doll.renamed(lambda name: f'<b>{name}' if name == 'head' else name)
    scene = dataclasses.replace(DROP, dolls=tuple(
        dataclasses.replace(DROP.dolls[0], doll=doll, name=name) for name in ('one', 'two')))
    desk = Desk(server, tmp_path, scene)
    desk.editor.select('two/left_shin')
    rows = re.findall('aria-level="(.)" aria-selected="(.*?)" data-bone="(.*?)"',
                      desk.panel.tree._html.content)
    assert len(rows) == len(doll.bones)
    levels, seen = {}, []
    for level, selected, name in rows:
        name = html.unescape(name).removeprefix('two/')
        levels[name] = int(level)
        assert (selected == 'true') == (name == 'left_shin')
        parent = next((joint.parent for joint in doll.joints if joint.child == name), None)
        assert parent is None or (levels[name] == levels[parent] + 1 and parent in seen)
        seen.append(name)
    assert '<b>' not in desk.panel.tree._html.content


def test_without_a_bone_one_is_chosen_or_added(desk):
    assert 'Click on a bone' in desk.panel.advice.content and desk.panel.growth_folder.visible
    assert desk.panel.add.label == 'Add a bone to torso' and not desk.panel.remove.visible
    desk.editor.add_bone('tail')
    assert desk.editor.bones == ('tail',)
    assert changes.joint_of(desk.editor.scene, 'tail').parent == 'torso'
    assert desk.panel.add.label == 'Add a bone here' and desk.panel.remove.visible


def test_pairs_that_do_not_collide_are_typed(desk):
    """Pairs of other bones stay; one that no bone has is refused at the field."""
    doll = dataclasses.replace(DROP.dolls[0].doll, no_collision=(
        ('left_shin', 'right_shin'), ('torso', 'left_shin')))
    scene = dataclasses.replace(DROP, dolls=(dataclasses.replace(DROP.dolls[0], doll=doll),))
    desk.editor.show(scene)
    desk.editor.select('right_shin')
    field = desk.panel.body['no_collision']
    assert field.value == 'left_shin'
    field.value = 'left_shin, head; torso'
    desk.editor.update()
    assert 'passes through must be' in errors_in(desk.panel)['no_collision']
    field.value = 'left_shin, head, torso'
    desk.editor.update()
    pairs = {frozenset(pair) for pair in desk.editor.scene.dolls[0].doll.no_collision}
    assert pairs == {frozenset(pair) for pair in (
        ('left_shin', 'right_shin'), ('torso', 'left_shin'), ('right_shin', 'head'),
        ('right_shin', 'torso'))}
    assert len(desk.editor.scene.dolls[0].doll.no_collision) == 4
    field.value = ''
    desk.editor.update()
    assert desk.editor.scene.dolls[0].doll.no_collision == (('torso', 'left_shin'),)


def test_the_dropdown_chooses(desk):
    desk.panel.bone.value = 'head'
    assert desk.editor.bone == 'head' and desk.panel.body['radius'].value == '0.1'


def test_the_list_is_of_one_doll_in_a_crowd(server, tmp_path):
    """Ten thousand bones are no list: a doll is chosen first, which chooses its root."""
    scene = load_scene('field')
    desk = Desk(server, tmp_path, scene)
    panel, (first, *_, last) = desk.panel, scene.dolls
    assert panel.doll.visible and len(panel.doll.options) == 1000
    assert panel.bone.options == ('(no bone)', *scene.bone_names[:10])
    panel.doll.value = last.name
    assert desk.editor.bone == f'{last.name}/torso' == panel.bone.value
    assert panel.bone.options == ('(no bone)', *scene.bone_names[-10:])
    desk.editor.select(f'{first.name}/head')
    assert panel.doll.value == first.name and panel.bone.value == f'{first.name}/head'


def drag(handle, position=None, turn=None):
    """Move a handle as a page does: its pose, and the end of the gesture."""
    if position is not None:
        handle.position = position
    if turn is not None:
        handle.wxyz = np.asarray(turn)[[3, 0, 1, 2]]
    for callback in handle._impl_aux.update_cb:
        callback(viser.TransformControlsEvent(None, None, handle, 'end'))


def test_editing_holds_the_bind_pose_and_dropping_lets_go(desk):
    desk.editor.select('left_forearm')
    assert desk.editor.handles.body is None
    desk.editor.toggle()
    assert desk.asked == [True, DROP]
    assert desk.editor.handles.body is not None
    desk.panel.body['mass'].value = 1.0
    desk.editor.update()
    assert desk.asked[2:] == [True, desk.editor.scene]
    desk.editor.toggle()
    assert desk.asked[4:] == [desk.editor.scene, False]
    assert desk.editor.handles.body is None


@pytest.mark.parametrize('stood', [True, False])
def test_what_refuses_to_be_edited_is_as_it_was(desk, stood):
    """A recording, say: one that stood stands on, one that went goes on."""
    desk.editor.update_paused(paused=stood)
    desk.reason = 'a recording has one scene'
    desk.editor.toggle()
    assert desk.asked == ([True] if stood else [True, False])
    assert not desk.editor.editing and 'one scene' in desk.panel.message.content


def test_a_recording_at_its_end_is_not_started(server, tmp_path):
    """Nor held: started anew, it goes."""
    turns = np.tile((0, 0, 0, 1.0), (2, len(DROP.bones), 1))
    source = PlaybackSource(
        Recording(DROP, np.arange(2.0), np.zeros((2, len(DROP.bones), 3)), turns))
    source.set_real_time_factor(100)
    source.request(RequestedData(frames=True))
    wait(lambda: source.status.paused)
    # From here on it would take a quarter of an hour.
    source.set_real_time_factor(0.001)
    server.gui.reset()
    editor = Editor(server, DROP, source.set_scene, source.pause, Banner(server.gui), tmp_path)
    editor.update_paused(source.status.paused)
    editor.toggle()
    assert 'a recording has one scene' in editor.panel.message.content
    assert source.status.paused
    source.reset()
    assert not source.status.paused


def test_leaving_takes_the_handles_and_lets_the_time_stand(desk):
    desk.editor.select('left_forearm')
    desk.editor.toggle()
    asked = list(desk.asked)
    desk.editor.leave()
    assert not desk.editor.editing and desk.editor.handles.body is None and desk.asked == asked
    assert desk.panel.edit.label == 'Edit'


def test_handles_move_turn_and_resize(desk):
    desk.editor.select('left_forearm')
    desk.editor.toggle()
    drag(desk.editor.handles.body, (0.1, 0.55, 1.25))
    bone = desk.bone('left_forearm')
    assert bone.position == (0.1, 0.55, 1.25) and bone.orientation == rotation.IDENTITY
    assert desk.panel.body['position'].value == '0.1, 0.55, 1.25'
    assert desk.asked[-1] == desk.editor.scene
    turn = rotation.from_axis_angle((0, 0, 1), 0.5)
    drag(desk.editor.handles.body, turn=turn)
    assert desk.bone('left_forearm').position == bone.position
    assert desk.panel.body['rotation'].value == '0, 0, 28.64789'
    desk.editor.set_mode('size')
    assert desk.editor.handles.body is None
    # From the middle to a corner.
    drag(desk.editor.handles.size, (0.02, 0.15, 0.03))
    assert desk.bone('left_forearm').shape.size == pytest.approx((0.04, 0.3, 0.06))
    scene = desk.editor.scene
    drag(desk.editor.handles.size, (-0.02, 0.15, 0.03))
    assert 'above zero' in desk.panel.message.content and desk.editor.scene == scene
    assert tuple(desk.editor.handles.size.position) == pytest.approx((0.02, 0.15, 0.03))
    for _ in range(3):
        desk.editor.undo()
    assert desk.editor.scene == DROP


TABLE = load_scene('table')


def test_a_static_body_is_moved_sized_saved_and_undone(server, tmp_path):
    desk = Desk(server, tmp_path, TABLE)
    desk.editor.select_static('table')
    shown = {key for key in ('position', 'mass', 'friction') if desk.panel.body[key].visible}
    assert shown == {'position', 'friction'}, 'a static body has no mass'
    desk.panel.body['position'].value = '1 0.5 0.2'
    desk.panel.body['friction'].value = '0.25'
    desk.editor.update()
    edited = desk.editor.scene
    found = next(body for body in edited.bodies if body.name == 'table')
    assert (found.position, found.friction) == ((1, 0.5, 0.2), 0.25)
    before = next(body for body in TABLE.bodies if body.name == 'table')
    assert dataclasses.replace(found, position=before.position, friction=None) == before
    assert edited.dolls == TABLE.dolls
    desk.files.name.value = 'moved'
    desk.files.save()
    assert load_scene(str(tmp_path / 'moved.yaml')) == edited
    desk.editor.undo()
    assert desk.editor.scene == TABLE and desk.panel.body['position'].value != '1 0.5 0.2'


def test_static_bodies_come_and_go(desk):
    desk.editor.add_static('crate')
    crate, = desk.editor.scene.bodies
    assert desk.editor.static == desk.panel.static.value == 'crate'
    assert crate.shape.size == (0.4, 0.4, 0.4) and crate.position[2] == 0.2
    desk.panel.body['size'].value = '1 0.5 0.4'
    desk.editor.update()
    assert desk.editor.scene.bodies[0].shape.size == (1, 0.5, 0.4)
    desk.editor.suggest('shape', 'cylinder')
    assert desk.panel.body['length'].value == '1', 'the longest side becomes the length'
    desk.editor.add_static('world')
    assert desk.panel.body['size'].value == '0.4, 0.4, 0.4'
    desk.editor.undo()
    desk.editor.add_static('crate')
    assert 'unique' in html.unescape(desk.panel.message.content)
    desk.editor.select('left_shin')
    assert desk.editor.static is None and desk.panel.body['mass'].visible
    desk.editor.select_static('crate')
    assert desk.editor.bones == ()
    desk.editor.remove_static()
    assert desk.editor.scene == DROP and desk.editor.static is None
    desk.editor.undo()
    assert desk.editor.scene.bodies[0].name == 'crate'


def test_handles_move_and_size_a_static_body(desk):
    desk.editor.add_static('crate')
    desk.editor.toggle()
    handles = desk.editor.handles
    drag(handles.body, (2, 0, 0.2))
    assert desk.editor.scene.bodies[0].position == (2, 0, 0.2)
    desk.editor.set_mode('size')
    drag(handles.size, (0.5, 0.25, 0.2))
    assert desk.editor.scene.bodies[0].shape.size == pytest.approx((1, 0.5, 0.4))
    assert desk.editor.scene.dolls == DROP.dolls


def test_handles_go_in_steps_if_so_chosen(desk):
    """Of 1 cm along the body's own axes, of 5 degrees, and of 1 cm of an edge."""
    desk.editor.select('left_forearm')
    desk.editor.toggle()
    start, tilted = desk.bone('left_forearm'), rotation.from_axis_angle((1, 0, 0), 0.5)
    desk.panel.snap.value = True
    drag(desk.editor.handles.body, turn=tilted)
    assert desk.panel.body['rotation'].value == '30, 0, 0'
    along = rotation.rotate(rotation.from_axis_angle((1, 0, 0), np.pi / 6), (0, 0, 1))
    drag(desk.editor.handles.body, start.position + 0.0337 * along)
    assert np.subtract(desk.bone('left_forearm').position, start.position) == pytest.approx(
        0.03 * along)
    desk.editor.set_mode('size')
    x, y, z = start.shape.half_extents
    drag(desk.editor.handles.size, (x, y + 0.0233, z))
    assert desk.bone('left_forearm').shape.size == pytest.approx((2 * x, 2 * y + 0.05, 2 * z))
    desk.panel.snap.value = False
    drag(desk.editor.handles.size, (x, y + 0.0337, z))
    assert desk.bone('left_forearm').shape.size == pytest.approx((2 * x, 2 * y + 0.0674, 2 * z))


def test_a_click_on_a_handle_changes_and_replaces_nothing(desk):
    """Nor does a drag by less than a step, but that one goes back."""
    desk.editor.select('left_forearm')
    desk.editor.toggle()
    asked, root, start = list(desk.asked), desk.editor.handles.root, desk.bone('left_forearm')
    drag(desk.editor.handles.body)
    desk.panel.body['mass'].value = '2'
    assert desk.asked == asked and desk.editor.handles.root == root
    desk.panel.snap.value = True
    drag(desk.editor.handles.body, np.add(start.position, (0, 0, 0.004)))
    assert desk.asked == asked and desk.editor.handles.root != root
    assert tuple(desk.editor.handles.body.position) == start.position


@pytest.mark.parametrize(('name', 'edge', 'angle', 'limits'), [
    ('left_shin', (0, 1), 90, [(0, 90)]), ('left_shin', (0, 0), -20, [(-20, 126)]),
    ('head', (1, 0), -35, [(-60, 60), (-35, 60)])])
def test_a_range_is_dragged_by_its_edges(desk, name, edge, angle, limits):
    """To where the child would point: seen along the axis, its centre turned by that angle."""
    desk.editor.select(name)
    desk.editor.toggle()
    joint, bone = changes.joint_of(DROP, name), desk.bone(name)
    axis = np.array(joint.axes[edge[0]])
    arm = rotation.rotate(rotation.from_axis_angle(axis, np.radians(angle)),
                          np.subtract(bone.position, joint.anchor))
    pointer = joint.anchor + arm
    desk.editor.ranges.drag(edge, pointer + 2 * axis, pointer, False)
    assert desk.editor.scene == DROP
    desk.editor.ranges.drag(edge, pointer + 2 * axis, pointer, True)
    wait(lambda: desk.editor.scene != DROP)
    assert np.degrees(changes.joint_of(desk.editor.scene, name).limits) == pytest.approx(
        np.array(limits))
    desk.editor.undo()
    assert desk.editor.scene == DROP


def test_a_range_goes_in_steps_and_a_cone_stays_symmetric(desk):
    """What a joint cannot have, a lower limit above the upper one, is not taken."""
    desk.editor.select('left_shin')
    desk.panel.joint['kind'].value = 'ball'
    desk.editor.update()
    desk.editor.toggle()
    desk.panel.snap.value = True
    joint, edge = changes.joint_of(desk.editor.scene, 'left_shin'), (0, 1)
    assert set(desk.editor.ranges.spheres) == {(k, side) for k in range(3) for side in (0, 1)}
    axis = rotation.matrix(joint_frame(joint))[:, 0]
    arm = rotation.rotate(rotation.from_axis_angle(axis, np.radians(33)), np.subtract(
        desk.bone('left_shin').position, joint.anchor))
    before = desk.editor.scene
    desk.editor.ranges.drag(edge, joint.anchor + arm + axis, joint.anchor + arm, True)
    wait(lambda: desk.editor.scene != before)
    swing, twist = np.degrees(changes.joint_of(desk.editor.scene, 'left_shin').limits)
    assert swing == pytest.approx((-35, 35)) and twist == pytest.approx((-30, 30))
    desk.editor.select('right_shin')
    joint = changes.joint_of(desk.editor.scene, 'right_shin')
    arm = np.subtract(desk.bone('right_shin').position, joint.anchor)
    arm = rotation.rotate(rotation.from_axis_angle(joint.axes[0], np.radians(-40)), arm)
    asked = list(desk.asked)
    desk.editor.ranges.drag((0, 1), joint.anchor + arm + joint.axes[0], joint.anchor + arm, True)
    desk.editor.redo()
    assert desk.asked == asked


def test_a_body_of_several_shapes_is_shown_moved_and_saved(server, desk):
    """It has no handle for its size and no fields of a shape; the next body has them again."""
    scene = changes.change_bone(DROP, 'left_forearm', shape=HAMMER)
    desk.editor.show(scene)
    desk.editor.select('left_forearm')
    desk.editor.toggle()
    desk.editor.set_mode('size')
    assert desk.editor.handles.size is None
    assert not desk.panel.body['shape'].visible and not desk.panel.body['size'].visible
    desk.editor.set_mode('move')
    ghosts = [server.scene.get_handle_by_name(f'{desk.editor.handles.root}/frame/outline_{number}')
              for number in range(len(HAMMER.primitives))]
    for ghost, part in zip(ghosts, HAMMER.primitives, strict=True):
        assert tuple(ghost.position) == pytest.approx(part.position, abs=1e-12)
    drag(desk.editor.handles.body, (0.1, 0.55, 1.25))
    assert desk.bone('left_forearm') == dataclasses.replace(
        scene.bones[scene.bone_index('left_forearm')], position=(0.1, 0.55, 1.25))
    desk.files.name.value = 'hammer'
    desk.files.save()
    assert load_scene(str(desk.path / 'hammer.yaml')) == desk.editor.scene
    desk.editor.select('head')
    desk.editor.set_mode('size')
    assert desk.editor.handles.size is not None and desk.panel.body['shape'].visible


@pytest.mark.parametrize(('bone', 'corner', 'sizes'), [
    ('head', (0.2, 0, 0), {'radius': 0.2}),
    ('left_shin', (0.05, 0, 0.3), {'radius': 0.05, 'length': 0.5})])
def test_round_bodies_are_resized_along_their_own_sizes(desk, bone, corner, sizes):
    desk.editor.select(bone)
    if bone != 'head':
        desk.panel.body['shape'].value = 'capsule'
        desk.editor.update()
    desk.editor.toggle()
    desk.editor.set_mode('size')
    drag(desk.editor.handles.size, corner)
    assert vars(desk.bone(bone).shape) == pytest.approx(sizes)


def test_a_whole_limb_turns_about_its_joint(desk):
    desk.editor.select('left_upper_arm')
    desk.panel.limb.value = True
    desk.editor.toggle()
    anchor = changes.joint_of(DROP, 'left_upper_arm').anchor
    assert tuple(desk.editor.handles.body.position) == anchor
    drag(desk.editor.handles.body, turn=rotation.from_axis_angle((1, 0, 0), -np.pi / 2))
    # The arm stretched to the left hangs down now, forearm and all.
    assert changes.joint_of(desk.editor.scene, 'left_upper_arm').anchor == pytest.approx(anchor)
    for name in ('left_upper_arm', 'left_forearm'):
        away = changes.find(DROP, name)[1].position[1] - anchor[1]
        assert desk.bone(name).position == pytest.approx((0, anchor[1], anchor[2] - away))


def test_handles_stand_where_the_doll_is_shown(server, tmp_path):
    """A doll that begins in the ground is set onto it; its handles with it."""
    placement = dataclasses.replace(DROP.dolls[0], position=(0.3, 0.2, -0.9),
                                    orientation=(0, 0, 1, 1))
    scene = dataclasses.replace(DROP, dolls=(placement,))
    desk = Desk(server, tmp_path)
    desk.editor.show(scene)
    desk.editor.select('left_shin')
    desk.editor.toggle()
    room = server.scene.get_handle_by_name(desk.editor.handles.root)
    turn = np.array(room.wxyz)[[1, 2, 3, 0]]
    at = room.position + rotation.rotate(turn, desk.editor.handles.body.position)
    with Simulation(scene) as simulation:
        shown = simulation.state.positions[scene.bone_index('left_shin')]
    assert at == pytest.approx(shown, abs=1e-9)


def test_bones_come_and_go(desk):
    desk.editor.select('head')
    desk.editor.add_bone(' hat ')
    assert desk.editor.bone == 'hat' and 'hat' in desk.editor.scene.bone_names
    desk.editor.add_bone('hat')
    assert 'a unique name' in desk.panel.message.content
    desk.editor.remove_limb()
    assert desk.editor.scene == DROP and desk.editor.bone is None
    desk.editor.undo()
    assert 'hat' in desk.panel.bone.options


def test_undo_never_leads_out_of_the_scene_at_hand(desk):
    crowd = load_scene('crowd')
    desk.editor.select('head')
    desk.editor.show(crowd)
    assert desk.editor.scene == crowd and desk.editor.bone is None and desk.asked == []
    desk.editor.select(crowd.bone_names[-1])
    desk.panel.body['mass'].value = 3.0
    desk.editor.update()
    # The page shows at last what it was given: no step.
    desk.editor.show(desk.editor.scene)
    for _ in range(3):
        desk.editor.undo()
        assert desk.editor.scene == crowd
    assert desk.panel.undo.disabled


def test_a_change_of_settings_is_a_step_of_that_name(desk):
    desk.editor.show(dataclasses.replace(DROP, gravity=(0.0, 0.0, -1.6)))
    assert 'settings' in desk.panel.undo.label
    desk.editor.undo()
    assert desk.editor.scene == DROP


def test_a_page_that_draws_late_does_not_undo(desk):
    desk.editor.select('head')
    scenes = []
    for mass in (1.0, 2.0, 3.0):
        desk.panel.body['mass'].value = mass
        desk.editor.update()
        scenes.append(desk.editor.scene)
    # The first was never drawn; now the second is, when the third has been given already.
    desk.editor.show(scenes[1])
    desk.editor.show(scenes[2])
    assert desk.editor.scene is scenes[2]
    # Chosen elsewhere, the first is a step.
    desk.editor.show(scenes[0])
    assert desk.editor.scene is scenes[0]
    desk.editor.undo()
    assert desk.editor.scene is scenes[2]


def test_many_at_once_leave_one_consistent_history(desk):
    """Viser calls from 32 threads: each update is a step, none is lost, all can be undone."""
    desk.editor.select('head')

    def work(number):
        for k in range(20):
            mass = 1.0 + number + k / 100
            desk.editor.set_scene(changes.change_bone(DROP, 'head', mass=mass), 'm')
            desk.editor.select('torso' if k % 2 else 'head')

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    for _ in range(80):
        assert desk.editor.scene != DROP
        desk.editor.undo()
    assert desk.editor.scene == DROP


@pytest.mark.parametrize('name', ['', '../out', '/tmp/out', 'a/../../out', 'no/folder/x', '.',
                                  'a\0b', 'x' * 300, '\n'])
def test_nothing_is_saved_outside_the_folder(desk, name):
    desk.files.name.value = name
    desk.files.save()
    assert 'expected the name of a file inside' in desk.said()
    assert not (desk.path.parent / 'out.yaml').exists()
    assert list(desk.path.iterdir()) == []
    desk.files.load()
    assert 'expected the name of a file inside' in desk.said()


def test_a_link_does_not_lead_out(desk, tmp_path_factory):
    outside = tmp_path_factory.mktemp('outside')
    (desk.path / 'link').symlink_to(outside)
    desk.files.name.value = 'link/x'
    desk.files.save()
    assert 'expected the name of a file inside' in desk.said()
    assert list(outside.iterdir()) == []


def test_a_shipped_scene_loads_by_its_name(desk):
    desk.files.name.value = 'crowd'
    desk.files.load()
    assert desk.editor.scene == load_scene('crowd')


def test_what_is_saved_is_called_a_scene(desk):
    """Not a doll, which ragdoll_fit and `doll:` would take."""
    desk.files.save()
    assert load_scene(str(desk.path / 'scene.yaml')) == DROP
    with pytest.raises(errors.ModelErrors):
        load_doll(str(desk.path / 'scene.yaml'))


def test_another_file_is_written_over_at_the_second_asking(desk):
    """What the scene at hand was saved in or loaded from is written over without a word."""
    path = desk.path / 'mine.yaml'
    path.write_text("somebody else's")
    os.utime(path, (0, datetime(2025, 3, 4, 5, 6).timestamp()))
    desk.files.name.value = 'mine'
    desk.files.save()
    assert 'mine.yaml of 2025-03-04 05:06 exists' in desk.said()
    assert path.read_text() == "somebody else's"
    desk.files.save()
    assert load_scene(str(path)) == DROP
    desk.files.save()
    assert 'saved mine.yaml' in desk.said()


@pytest.mark.parametrize('other', ['from elsewhere', 'uploaded', 'fitted'])
def test_a_file_is_not_written_over_with_another_scene_unasked(desk, other):
    desk.files.name.value = 'mine'
    desk.files.save()
    if other == 'from elsewhere':
        desk.editor.show(load_scene('flight'))
    elif other == 'uploaded':
        desk.files.upload('drop.yaml', desk.files.folder.text(dataclasses.replace(
            DROP, gravity=(0.0, 0.0, -1.0))))
    else:
        desk.files.fit('bird.glb', fit_rigs.document(fit_rigs.RIGS['bird']).glb())
    assert desk.editor.scene != DROP
    desk.files.save()
    assert 'exists' in desk.said()
    assert load_scene(str(desk.path / 'mine.yaml')) == DROP
    desk.files.load()
    desk.files.save()
    assert 'saved mine.yaml' in desk.said()


def test_files_are_listed_with_their_dates_and_loaded_from_there(desk):
    for day, name in enumerate(('old', 'new'), 1):
        save_scene(load_scene('crowd'), desk.path / f'{name}.yaml')
        os.utime(desk.path / f'{name}.yaml', (0, datetime(2025, 1, day, 12).timestamp()))
    (desk.path / 'notes.txt').write_text('no scene')
    desk.files.name.value = 'newest'
    desk.files.save()
    first, newest, new, old = desk.files.saved.options
    assert newest.startswith('newest.yaml · 20') and first == desk.files.saved.value
    assert (new, old) == ('new.yaml · 2025-01-02', 'old.yaml · 2025-01-01')
    desk.files._load_listed(old)
    assert desk.editor.scene == load_scene('crowd') and desk.files.name.value == 'old.yaml'
    assert str(desk.path) in desk.files.place.content


def test_what_cannot_be_written_is_told(desk):
    (desk.path / 'taken.yaml').mkdir()
    desk.files.name.value = 'taken'
    desk.files.save()
    assert 'directory' in desk.said()


def test_a_scene_or_a_doll_is_uploaded(desk, tmp_path_factory):
    away = tmp_path_factory.mktemp('away')
    save_scene(load_scene('crowd'), away / 'crowd2.yaml')
    desk.files.upload('crowd2.yaml', (away / 'crowd2.yaml').read_bytes())
    assert desk.editor.scene == load_scene('crowd')
    doll = DROP.dolls[0].doll
    save_doll(doll, away / 'doll.yaml')
    desk.files.upload('C:\\fakepath\\doll.yaml', (away / 'doll.yaml').read_bytes())
    assert desk.editor.scene == above_ground(doll)
    desk.files.upload('named.yaml', b'dolls: [{doll: doll}]')
    assert desk.editor.scene.dolls[0].doll == load_doll('doll')


def test_an_uploaded_scene_reads_no_other_files(desk, tmp_path_factory):
    secret = tmp_path_factory.mktemp('secret') / 'secret.yaml'
    secret.write_text('token: abc123')
    (desk.path / 'own.yaml').write_text(yaml.safe_dump(
        {'bones': [{'name': 'b', 'shape': {'sphere': {'radius': 1}}, 'mass': 1,
                    'position': [0, 0, 0]}]}))
    for path in (str(secret), f'../{secret.parent.name}/secret.yaml', '/etc/hostname'):
        desk.files.upload('x.yaml', yaml.safe_dump({'dolls': [{'doll': path}]}).encode())
        assert 'dolls[0].doll' in desk.said() and 'abc123' not in desk.said()
    desk.files.upload('x.yaml', b'dolls: [{doll: own.yaml}]')
    assert desk.editor.scene.bone_names == ('b',)


@pytest.mark.parametrize('model', ['/etc/hostname', '../away/secret.glb', 'link.glb', 'a/../../x',
                                   '/dev/zero'])
@pytest.mark.parametrize('place', ['', 'dolls[0].doll.'])
def test_an_uploaded_doll_opens_no_other_files(desk, tmp_path_factory, model, place):
    """A character that lies here may be named, by the doll or by a doll within a scene."""
    secret = tmp_path_factory.mktemp('away') / 'secret.glb'
    secret.write_bytes(b'')
    (desk.path / 'link.glb').symlink_to(secret)
    made = yaml.safe_load(bone())

    def upload(model):
        doll = {**made, 'model': model}
        scene = {'dolls': [{'doll': doll}]} if place else doll
        desk.files.upload('x.yaml', yaml.safe_dump(scene).encode())

    upload(model)
    assert f'{place}model: expected' in desk.said() and f'inside {desk.path}' in desk.said()
    assert desk.editor.scene == DROP and desk.asked == []
    upload('here.glb')
    assert desk.editor.scene.dolls[0].doll.model == str(desk.path / 'here.glb')


@pytest.mark.parametrize('path', ['{}/r.urdf', 'file://{}/r.urdf', '../{name}/r.urdf', 'r.urdf',
                                  'package://{name}/r.urdf', 'link.urdf', '/dev/zero'])
def test_an_uploaded_scene_opens_no_other_robots(desk, tmp_path_factory, path):
    """One that lies here, and the shipped one, may be named."""
    urdf = ('<robot name="r"><link name="{}"><collision><geometry><sphere radius="1"/></geometry>'
            '</collision></link></robot>')
    away = tmp_path_factory.mktemp('away')
    (away / 'r.urdf').write_text(urdf.format('secret'))
    (desk.path.parent / 'r.urdf').write_text(urdf.format('secret'))
    (desk.path / 'link.urdf').symlink_to(away / 'r.urdf')
    (desk.path / 'here.urdf').write_text(urdf.format('open'))

    def upload(path):
        desk.files.upload('x.yaml', yaml.safe_dump({'dolls': [{'doll': 'doll'}], 'bodies': [
            {'name': 'a', 'urdf': path}]}).encode())
        return [body.name for body in desk.editor.scene.bodies]

    assert upload(path.format(away, name=away.name)) == []
    assert 'bodies[0].urdf' in desk.said() and f'inside {desk.path}' in desk.said()
    assert upload('here.urdf') == ['a_open']
    assert 'a_pedestal' in upload('robot.urdf')


BOMB = b'a: &a [x, x]\n' + b''.join(
    b'%c: &%c [*%c, *%c, *%c, *%c, *%c, *%c]\n' % (k + 1, k + 1, k, k, k, k, k, k)
    for k in range(97, 110)) + b'bones: [*n]\n'



def bone(mass='1', radius='1', name='b'):
    return (f'bones: [{{name: {name}, shape: {{sphere: {{radius: {radius}}}}}, mass: {mass}, '
            'position: [0, 0, 0]}]').encode()


NUMBERS = {'1e400': '1.0e+400', 'minus_1e400': '-1.0e+400', 'nan': '.nan', 'inf': '.inf',
           'quoted': "'1e400'", 'tiny': '1.0e-400', 'ten_thousand_digits': '9' * 10_000,
           'hex': '0x' + 'f' * 10_000, 'binary': '0b' + '1' * 5000, 'huge': '9' * 400,
           'sixties': ':'.join(['59'] * 3000), 'date': '2020-01-01', 'bool': 'yes', 'none': '~'}

RUBBISH = {'empty.yaml': b'', 'zeros.yaml': bytes(1000), 'binary.yaml': bytes(range(256)) * 50,
           'open.yaml': b'[1, 2', 'deep.yaml': b'[' * 50_000, 'bomb.yaml': BOMB,
           'number.yaml': b'7', 'list.yaml': b'- x', 'dolls.yaml': b'dolls: 3',
           'no_bones.yaml': b'bones: []', 'object.yaml': b'!!python/object/apply:os.system [ls]',
           'utf_16.yaml': bone(mass='x').decode().encode('utf-16'),
           'utf_16_without_mark.yaml': bone().decode().encode('utf-16-le'),
           'latin_1.yaml': 'bones: [{name: Schädel}]'.encode('latin-1'),
           'half_a_character.yaml': 'bones: [{name: ä'.encode()[:-1],
           'surrogate.yaml': b'bones: [{name: "\\ud800", mass: 1}]',
           'zip.yaml': b'PK\3\4' + bytes(100), 'glb.yaml': BROKEN['truncated_binary.glb'],
           **{f'mass_{name}.yaml': bone(mass=text) for name, text in NUMBERS.items()},
           **{f'radius_{name}.yaml': bone(radius=text) for name, text in NUMBERS.items()},
           '<img src=x onerror=alert(1)>.yaml': b'<img src=x onerror=alert(1)>'}


@pytest.mark.parametrize('name', RUBBISH)
def test_uploaded_rubbish_is_refused_in_words(desk, name):
    start = time.process_time()
    desk.files.upload(name, RUBBISH[name])
    assert scene_folder.safe_name(name) in desk.said() and 'expected' in desk.said()
    assert '<img' not in desk.files.message.content
    assert desk.editor.scene == DROP and desk.asked == []
    # None of it takes long: what takes longest is 0.1 s of parsing.
    assert time.process_time() - start < 5


def test_uploads_have_a_size(desk, monkeypatch):
    monkeypatch.setattr(scene_folder, 'LARGEST_UPLOAD', 1000)
    for take in (desk.files.upload, desk.files.fit):
        take('large.glb', bytes(1001))
        assert 'at most 1000' in desk.said()


@pytest.mark.parametrize(('findings', 'color', 'word'), [
    ((), GREEN, 'good'), ((Finding('a joint hangs'),), AMBER, 'doubtful'),
    ((Finding('a joint hangs'), Finding('no root', wrong=True)), RED, 'wrong')])
def test_a_verdict_has_the_colour_of_what_it_says(desk, monkeypatch, findings, color, word):
    scene = load_scene('drop')
    monkeypatch.setattr(desk.files.folder, 'fit', lambda *_: (scene, [Verdict(findings)]))
    desk.files.fit('x.glb', b'')
    lines = desk.said().split('</div>')
    assert color in lines[1] and f'verdict: {word}' in lines[1]
    for finding, line in zip(findings, lines[2:], strict=False):
        assert finding.sentence in line and (RED if finding.wrong else AMBER) in line


@pytest.mark.parametrize('rig', ['mixamo', 'centimetres'])
def test_a_character_becomes_the_scene_and_its_skin_stays_with_it(desk, rig):
    content = fit_rigs.document(fit_rigs.RIGS[rig]).glb()
    desk.files.fit(f'../{rig}.glb', content)
    assert 'fitted' in desk.said() and not desk.files.progress.visible
    assert 'verdict: good' in desk.said()
    placement, = desk.editor.scene.dolls
    doll = placement.doll
    assert dataclasses.replace(doll, model=None) == fit_rigs.fitted(rig).doll
    assert doll.model == str(desk.path / f'{rig}.glb')
    assert (desk.path / f'{rig}.glb').read_bytes() == content
    desk.files.name.value = 'fitted'
    desk.files.save()
    assert load_scene(str(desk.path / 'fitted.yaml')) == desk.editor.scene
    data = yaml.safe_load((desk.path / 'fitted.yaml').read_text())
    assert data['dolls'][0]['doll']['model'] == f'{rig}.glb'
    assert desk.panel.undo.disabled


def test_characters_do_not_overwrite_each_other(desk):
    for rig in ('one_bone', 'two_bones', 'one_bone'):
        desk.files.fit('rig.glb', fit_rigs.document(fit_rigs.RIGS[rig]).glb())
    assert sorted(path.name for path in desk.path.iterdir()) == ['rig.glb', 'rig_2.glb']
    assert desk.editor.scene.dolls[0].doll.model == str(desk.path / 'rig.glb')


def test_a_limb_moves_with_its_skin(desk):
    """The skin's own bones go with the bodies that carry them; the size is not guessed anew."""
    from ragdoll_ros.fit.skin import skin_of
    desk.files.fit('mixamo.glb', fit_rigs.document(fit_rigs.RIGS['mixamo']).glb())
    before = skin_of(desk.editor.scene.dolls[0].doll)
    desk.editor.select('mixamorig:LeftArm')
    desk.panel.limb.value = True
    turn = rotation.from_axis_angle((1, 0, 0), -1.2)
    joint = changes.joint_of(desk.editor.scene, desk.editor.bone)
    old = desk.bone(desk.editor.bone)
    desk.editor.toggle()
    drag(desk.editor.handles.body, turn=rotation.multiply(turn, old.orientation))
    doll = desk.editor.scene.dolls[0].doll
    skin = skin_of(doll)
    # Bound to the bodies as they were: so it is bent where they are now.
    assert np.abs(skin.vertices - before.vertices).max() < 1e-9
    assert np.abs(skin.positions - before.positions).max() < 1e-9
    bones = [doll.bones[index] for index in skin.bones]
    hand = next(k for k, bone in enumerate(bones) if bone.name == 'mixamorig:LeftForeArm')
    moved = joint.anchor + rotation.rotate(turn, before.positions[hand] - joint.anchor)
    assert bones[hand].position == pytest.approx(tuple(moved), abs=1e-9)


@pytest.mark.parametrize('name', [*BROKEN, 'picture.png', 'x', '.glb', ''])
def test_a_broken_character_is_refused_in_one_sentence(desk, name):
    if name == 'doll.yaml' or name.startswith('uri_link'):
        pytest.skip('lies on the disk in that test')
    desk.files.fit(name, BROKEN.get(name, b'\x89PNG'))
    assert scene_folder.safe_name(name) in desk.said() and 'expected' in desk.said()
    assert desk.said().count(': 1 error') == 1
    assert '/tmp' not in desk.said() and not desk.files.progress.visible
    assert desk.editor.scene == DROP and desk.asked == [] and list(desk.path.iterdir()) == []


def test_a_gltf_in_pieces_is_told_to_come_in_one(desk):
    desk.files.fit('rig.gltf', BROKEN['uri_missing.gltf'])
    assert 'all in one file' in desk.said()


def test_one_character_at_a_time(desk):
    """One that comes while another is being fitted is refused; the next is looked at."""
    def use(scene):
        desk.files.fit('x.glb', b'')
        desk.asked.append(desk.said())

    desk.use = use
    desk.files.fit('rig.glb', fit_rigs.document(fit_rigs.RIGS['one_bone']).glb())
    assert ['another character is being fitted' in said for said in desk.asked] == [True]
    desk.files.fit('x.glb', b'')
    assert 'expected' in desk.said()


def test_an_upload_is_let_go_of(desk):
    """Viser hands an upload to the button, which keeps it, and calls back."""
    for button in (desk.files.upload_button, desk.files.fit_button):
        button._impl.value = viser.UploadedFile('x.glb', bytes(1000))
        for callback in button._impl.update_cb:
            callback(viser.GuiEvent(None, None, button))
        assert 'x.glb' in desk.said() and button.value.content == b''


def test_on_a_running_simulation(server, tmp_path):
    """Edit: the bind pose stands. Drop: it falls. Update while it falls: it starts anew."""
    source = SimulationSource(DROP)
    source.request(RequestedData(frames=True))
    server.gui.reset()
    server.scene.reset()
    try:
        editor = Editor(server, DROP, source.set_scene, source.pause, Banner(server.gui), tmp_path)
        wait(lambda: source.frame.time > 0.1)
        editor.select('head')
        editor.toggle()
        assert source.status.paused and source.frame.time == 0
        drag(editor.handles.body, (0.0, 0.0, 1.5))
        head = DROP.bone_index('head')
        assert source.frame.time == 0 and source.frame.scene is editor.scene
        assert source.frame.state.positions[head] == pytest.approx((0, 0, 1.5))
        editor.toggle()
        wait(lambda: source.frame.state.positions[head][2] < 1.4)
        editor.panel.body['mass'].value = 2.0
        editor.update()
        assert source.frame.scene.bones[head].mass == 2 and not source.status.paused
        assert source.frame.state.positions[head][2] > 1.4
        wait(lambda: source.frame.state.positions[head][2] < 1.4)
    finally:
        source.close()

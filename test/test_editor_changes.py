"""Changes of bones and joints: what must follow follows, what must stay stays."""
import dataclasses
import itertools
import math

import fit_rigs
import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.ragdoll import JOINT_KINDS, joint_axes
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.model.shapes import SHAPES, Box, Capsule, Part
from ragdoll_ros.model.skeleton import Riders
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.editor import bone_form, changes, mirror
from ragdoll_ros.viewer.editor.undo_history import UndoHistory

DROP = load_scene('drop')
TURN = rotation.from_axis_angle((1, 2, -1), 0.7)


@pytest.fixture(scope='module')
def fitted():
    return above_ground(fit_rigs.fitted('mixamo').doll)


def bone_of(scene, name):
    return changes.find(scene, name)[1]


def rider_poses(scene):
    poses = [placement.bone_pose(bone) for placement in scene.dolls
             for bone in placement.doll.bones]
    state = State(np.array([p for p, _ in poses]), np.array([q for _, q in poses]),
                  np.zeros((len(poses), 3)), np.zeros((len(poses), 3)))
    return Riders(scene).poses(state)


def farthest(poses, others):
    return max(np.abs(poses[0] - others[0]).max(),
               rotation.angle_between(poses[1], others[1]).max())


def test_a_new_mass_scales_the_inertia():
    scene = changes.change_bone(DROP, 'torso', mass=30)
    before, after = bone_of(DROP, 'torso'), bone_of(scene, 'torso')
    # A box of 0.1 x 0.2 x 0.4 m: m (y^2 + z^2) / 12.
    assert after.inertia[0] == pytest.approx(30 * (0.2 ** 2 + 0.4 ** 2) / 12, rel=1e-12)
    assert np.array(after.inertia) == pytest.approx(3 * np.array(before.inertia), rel=1e-12)
    assert load_scene('drop') == DROP


def test_only_what_is_asked_for_changes():
    scene = changes.change_bone(DROP, 'head', restitution=0.25)
    assert changes.change_bone(scene, 'head', restitution=None) == DROP
    assert [a == b for a, b in zip(scene.bones, DROP.bones, strict=True)].count(False) == 1


@pytest.mark.parametrize(('change', 'path', 'kind'), [
    (lambda: changes.change_bone(DROP, 'head', mass=-1), 'head.mass', errors.NotPositive),
    (lambda: changes.change_bone(DROP, 'head', mass=math.nan), 'head.mass', errors.NotFinite),
    (lambda: changes.change_bone(DROP, 'head', restitution=2), 'head.restitution',
     errors.OutOfRange),
    (lambda: changes.change_bone(DROP, 'no bone', mass=1), '', errors.UnknownBone),
    (lambda: changes.set_pose(DROP, 'head', (0, 0, math.inf)), 'head.position', errors.NotFinite),
    (lambda: changes.set_pose(DROP, 'head', orientation=(0, 0, 0, 0)), 'head.orientation',
     errors.NotUnit),
    (lambda: changes.set_size(DROP, 'head', (0, 1, 1)), 'head.size', errors.NotPositive),
    (lambda: changes.set_shape(DROP, 'head', 'cone'), 'head.shape', errors.WrongForm),
    (lambda: changes.change_joint(DROP, 'left_shin', limits=((0.3, 0.1),)),
     'left_shin.joint.limits[0]', errors.LimitsReversed),
    (lambda: changes.change_joint(DROP, 'left_shin', limits=(None, None)),
     'left_shin.joint.limits', errors.WrongAxes),
    (lambda: changes.set_joint_kind(DROP, 'left_shin', 'screw'), 'left_shin.joint.kind',
     errors.WrongAxes),
    (lambda: changes.change_joint(DROP, 'left_thigh', axes=((1, 0, 0), (1, 1, 0))),
     'left_thigh.joint.axes', errors.WrongAxes),
    (lambda: changes.change_joint(DROP, 'torso', damping=1), 'torso.joint', errors.Detached),
    (lambda: changes.add_bone(DROP, 'head', 'torso'), 'name', errors.DuplicateName),
    (lambda: changes.add_bone(DROP, 'head', 'a/b'), 'name', errors.WrongForm),
    (lambda: changes.remove_limb(DROP, 'torso'), 'torso', errors.Detached),
    (lambda: mirror.mirrored(DROP, 'head'), 'both sides', errors.UnknownBone)])
def test_what_is_wrong_is_refused_with_its_place(change, path, kind):
    with pytest.raises(kind) as caught:
        change()
    assert caught.value.path == path


def test_reversed_limits_are_told_in_degrees():
    with pytest.raises(errors.ModelErrors, match=r'\(30.0, 10.0\); expected lower <= upper'):
        bone_form.apply_values(DROP, 'left_shin', {'limits_1': '30, 10'})


def test_a_body_that_moves_leaves_pivots_neighbours_and_skin(fitted):
    name = fitted.bone_names[3]
    scene = changes.set_pose(fitted, name, np.add(bone_of(fitted, name).position, (.1, .2, .3)),
                             TURN)
    assert scene.dolls[0].doll.joints == fitted.dolls[0].doll.joints
    assert [a.name for a, b in zip(scene.bones, fitted.bones, strict=True) if a != b] == [name]
    assert farthest(rider_poses(scene), rider_poses(fitted)) < 1e-9
    with Simulation(scene) as simulation:
        assert np.abs(simulation.joint_angles).max() < 1e-9


def test_a_limb_moves_as_one_piece(fitted):
    """Points of it keep their distances, whatever they are: bodies, pivots, skin."""
    name = 'mixamorig:LeftArm'
    old = bone_of(fitted, name)
    scene = changes.set_pose(fitted, name, np.add(old.position, (0, .1, .2)),
                             rotation.multiply(TURN, old.orientation), limb=True)
    doll, before = scene.dolls[0].doll, fitted.dolls[0].doll
    names = changes.limb(before, name)
    assert 'mixamorig:LeftForeArm' in names and 'mixamorig:Hips' not in names
    assert all(doll.bone(bone.name) == bone for bone in before.bones if bone.name not in names)

    def points(scene):
        doll = scene.dolls[0].doll
        lift = scene.dolls[0].position
        riders = rider_poses(scene)[0] - lift
        return np.array([*(doll.bone(each).position for each in names),
                         *(joint.anchor for joint in doll.joints if joint.child in names),
                         *(point for rider, point in zip(doll.riders, riders, strict=True)
                           if rider.bone in names)])

    here, there = points(fitted), points(scene)
    distances = [np.linalg.norm(p[:, None] - p[None], axis=2) for p in (here, there)]
    assert np.abs(distances[0] - distances[1]).max() < 1e-9
    moved = np.array(bone_of(scene, name).position) + rotation.rotate(TURN, here - old.position)
    assert np.abs(moved - there).max() < 1e-9
    for joint, still in zip(doll.joints, before.joints, strict=True):
        if joint.child in names:
            assert np.abs(rotation.rotate(TURN, still.axes) - joint.axes).max(initial=0) < 1e-9
    with Simulation(scene) as simulation:
        assert np.abs(simulation.joint_angles).max() < 1e-9


@pytest.mark.parametrize(('name', 'kind'), list(itertools.product(
    ('head', 'left_upper_arm', 'left_shin'), SHAPES)))
def test_another_shape_fills_the_same_box(name, kind):
    """Along the doll's axes it reaches as far, or less where it is round."""
    scene = changes.set_shape(DROP, name, kind)
    bone, before = bone_of(scene, name), bone_of(DROP, name)
    assert bone.shape.kind == kind and bone.mass == before.mass
    assert bone.position == before.position
    reach = [each.shape.support(rotation.rotate(rotation.inverse(each.orientation), np.eye(3)))
             for each in (bone, before)]
    if kind == 'sphere':
        assert np.prod(reach[0]) == pytest.approx(np.prod(reach[1]), rel=1e-9)
    else:
        assert reach[0] == pytest.approx(reach[1], rel=0.11 if kind == 'capsule' else 1e-9)


@pytest.mark.parametrize(('name', 'kind'), list(itertools.product(
    ('head', 'left_shin', 'left_thigh'), JOINT_KINDS)))
def test_every_joint_can_become_every_kind_and_falls(name, kind):
    scene = changes.set_joint_kind(DROP, name, kind)
    for again in JOINT_KINDS:
        assert changes.joint_of(changes.set_joint_kind(scene, name, again), name).kind == again
    with Simulation(scene) as simulation:
        for _ in range(3):
            assert np.isfinite(simulation.advance().positions).all()


def test_a_hinge_that_becomes_universal_keeps_its_axis_and_limits():
    joint = changes.joint_of(changes.set_joint_kind(DROP, 'left_shin', 'universal'), 'left_shin')
    was = changes.joint_of(DROP, 'left_shin')
    assert (joint.axes[0], joint.limits[0]) == (was.axes[0], was.limits[0])
    assert changes.joint_of(changes.set_joint_kind(changes.set_joint_kind(
        DROP, 'left_shin', 'universal'), 'left_shin', 'hinge'), 'left_shin') == was


def extremes(joint):
    """All turns that a joint's limits stop at, as matrices."""
    return [rotation.matrix(rotation.from_axis_angle(axis, angle))
            for axis, pair in zip(joint.axes, joint.limits, strict=True) for angle in pair]


def test_the_shipped_doll_is_its_own_mirror_image():
    for name in DROP.bone_names:
        if name.startswith(('left', 'right')):
            assert mirror.mirrored(DROP, name) == DROP


@pytest.mark.parametrize('kind', ['hinge', 'universal'])
def test_a_mirrored_edit_is_the_mirror_image(kind):
    """The partner's joint stops where the image of this one's does: S R S, S = diag(1, -1, 1)."""
    name, other = 'left_thigh', 'right_thigh'
    scene = changes.set_joint_kind(DROP, name, kind)
    axes = (rotation.rotate(TURN, np.eye(3)[:len(changes.joint_of(scene, name).axes)]))
    scene = changes.change_joint(scene, name, axes=tuple(axes), anchor=(0.01, 0.08, 0.87))
    limits = np.radians([(-10, 70), (-30, 50)][:len(axes)])
    scene = changes.change_joint(scene, name, limits=tuple(map(tuple, limits.tolist())))
    scene = changes.change_bone(changes.set_pose(scene, name, (0.1, 0.2, 0.7), TURN), name, mass=9)
    scene = mirror.mirrored(scene, name)
    here, there = bone_of(scene, name), bone_of(scene, other)
    flip = np.diag((1.0, -1.0, 1.0))
    assert there.mass == 9 and there.color == bone_of(DROP, other).color
    assert np.abs(flip @ here.position - there.position).max() < 1e-12
    assert np.abs(flip @ rotation.matrix(here.orientation) @ flip
                  - rotation.matrix(there.orientation)).max() < 1e-12
    images = [flip @ turn @ flip for turn in extremes(changes.joint_of(scene, name))]
    for turn in extremes(changes.joint_of(scene, other)):
        # Limits are kept to 1e-9 degrees.
        assert min(np.abs(turn - image).max() for image in images) < 1e-10
    assert mirror.mirrored(scene, other) == scene


@pytest.mark.parametrize(('rig', 'name', 'other'), [
    ('mixamo', 'mixamorig:LeftForeArm', 'mixamorig:RightForeArm'),
    ('unreal', 'calf_l', 'calf_r'), ('vrm', 'J_Bip_L_Hand', 'J_Bip_R_Hand'),
    ('makehuman', 'upperleg01.L', 'upperleg01.R'), ('spider', 'p2_1_1', 'p2_-1_1')])
def test_partners_are_found_by_name_or_place(rig, name, other):
    scene = above_ground(fit_rigs.fitted(rig).doll)
    assert mirror.partner(scene, name) == other
    assert mirror.partner(scene, other) == name


def test_a_bone_that_is_added_and_taken_off_leaves_nothing(fitted):
    name = fitted.bone_names[-1]
    grown = changes.add_bone(fitted, name, 'tail')
    with Simulation(grown) as simulation:
        assert np.abs(simulation.joint_angles).max() < 1e-9
        simulation.advance()
    assert changes.remove_limb(grown, 'tail') == fitted


def test_a_limb_that_is_taken_off_leaves_its_skin_to_the_parent(fitted):
    name = 'mixamorig:LeftArm'
    scene = changes.remove_limb(fitted, name)
    gone = set(fitted.bone_names) - set(scene.bone_names)
    assert name in gone and 'mixamorig:LeftForeArm' in gone
    assert farthest(rider_poses(scene), rider_poses(fitted)) < 1e-9


def test_undo_and_redo_give_equal_scenes():
    history = UndoHistory(DROP)
    scenes = [DROP]
    for mass in (1, 2, 3):
        scenes.append(changes.change_bone(scenes[-1], 'head', mass=mass))
        history.push(scenes[-1], f'mass {mass}')
    for scene in scenes[-2::-1]:
        assert history.undo() == scene
    assert history.undo() == DROP and history.undo_name == '' and history.redo_name == 'mass 1'
    for scene in scenes[1:]:
        assert history.redo() == scene
    assert history.redo() == scenes[-1] and history.redo_name == ''
    history.undo()
    history.push(DROP, 'something else')
    assert history.redo_name == '' and history.undo() == scenes[2]


def test_the_same_scene_again_is_no_step():
    history = UndoHistory(DROP)
    history.push(load_scene('drop'), 'nothing')
    assert history.undo_name == ''


def test_the_history_ends_somewhere():
    history = UndoHistory(DROP, max_steps=2)
    for mass in (1, 2, 3):
        history.push(changes.change_bone(DROP, 'head', mass=mass), str(mass))
    for _ in range(5):
        history.undo()
    assert bone_of(history.scene, 'head').mass == 1


@pytest.mark.parametrize('name', ['drop', 'article', 'crowd', 'ponytail'])
def test_a_sheet_that_nobody_touched_changes_nothing(name):
    scene = load_scene(name)
    for bone in scene.bone_names[:25]:
        assert bone_form.apply_values(scene, bone, bone_form.read_bone(scene, bone)) is scene


def test_a_colour_is_changed_and_its_opacity_kept():
    clear = changes.change_bone(DROP, 'head', color=(0.2, 0.4, 0.6, 0.5))
    fields = bone_form.read_bone(clear, 'head')
    assert fields['color'] == (51, 102, 153)
    fields['color'] = (255, 102, 153)
    changed = bone_form.apply_values(clear, 'head', fields)
    assert bone_of(changed, 'head').color == (1, 0.4, 0.6, 0.5)


def lop_sided():
    """The shin of several shapes, nothing of it its own mirror image."""
    shape = Compound((Part(Box((0.1, 0.05, 0.2)), (0.1, 0.02, 0), TURN),
                      Part(Capsule(0.03, 0.1), (0, -0.05, 0.1))))
    return changes.change_bone(DROP, 'left_shin', shape=shape, moments=(0.1, 0.15, 0.2))


def test_several_shapes_are_moved_weighed_and_left_as_they_are():
    """Their fields are not in the sheet; what it has of the body is."""
    scene = lop_sided()
    fields = bone_form.read_bone(scene, 'left_shin')
    assert not {'shape', 'size', 'radius', 'length', 'parts'} & set(fields)
    assert fields['inertia'] == '0.1, 0.15, 0.2'
    moved = bone_form.apply_values(
        scene, 'left_shin', {'position': (0, 0, 3.0), 'inertia': '1 2 2.5'})
    before, after = bone_of(scene, 'left_shin'), bone_of(moved, 'left_shin')
    assert after == dataclasses.replace(before, position=(0, 0, 3.0), moments=(1, 2, 2.5))
    with pytest.raises(errors.WrongForm, match='compound'):
        changes.set_size(scene, 'left_shin', (0.1, 0.1, 0.1))
    with pytest.raises(errors.ModelErrors, match='OffCentre') as caught:
        bone_form.apply_values(scene, 'left_shin', {'inertia': ''})
    assert [error.path for error in caught.value.errors] == ['inertia']


def test_several_shapes_have_a_mirror_image():
    """Along any direction the other shin reaches as far as this one along the image of it."""
    scene = mirror.mirrored(lop_sided(), 'left_shin')
    here, there = bone_of(scene, 'left_shin'), bone_of(scene, 'right_shin')
    assert there.moments == here.moments
    directions = rotation.normalized(np.random.default_rng(0).normal(size=(50, 3)))
    reach = [bone.shape.support(rotation.rotate(rotation.inverse(bone.orientation), seen))
             for bone, seen in ((here, directions), (there, directions * (1, -1, 1)))]
    assert reach[0] == pytest.approx(reach[1], abs=1e-12)
    assert mirror.mirrored(scene, 'right_shin') == scene


def test_an_inertia_turns_with_the_axes_of_another_shape():
    """A bar along y becomes a cylinder: its long side is z then, and so are its moments."""
    scene = changes.change_bone(DROP, 'head', shape=Box((0.1, 0.5, 0.2)), moments=(3, 1, 2.5))
    bone = bone_of(changes.set_shape(scene, 'head', 'cylinder'), 'head')
    axes = rotation.matrix(bone.orientation)
    assert axes * bone.moments @ axes.T == pytest.approx(np.diag((3, 1, 2.5)), abs=1e-12)


@pytest.mark.parametrize(('typed', 'words'), [
    ('1, 2', '3 numbers'), ('a', '3 numbers'), ('1 1 3', 'sum of the other two'),
    ('-1, 1, 1', 'above zero')])
def test_a_faulty_inertia_is_told_at_its_field(typed, words):
    with pytest.raises(errors.ModelErrors, match=words) as caught:
        bone_form.apply_values(DROP, 'head', {'inertia': typed})
    assert [error.path for error in caught.value.errors] == ['inertia']
    own = bone_form.apply_values(DROP, 'head', {'inertia': '1, 2, 2.5'})
    assert bone_of(own, 'head').inertia == (1, 2, 2.5)
    assert bone_form.apply_values(own, 'head', {'inertia': ' '}) == DROP


def test_a_sheet_tells_all_its_errors_at_their_fields():
    wrong = {'mass': -1.0, 'size': (0.1, 0.0, 0.1), 'position': (0.0, math.nan, 0.0),
             'rotation': (0.0, math.inf, 0.0), 'friction': 'much', 'restitution': '1.5',
             'rolling_friction': '-1', 'anchor': (math.inf, 0.0, 0.0), 'limits_1': '30, 10',
             'damping': -2.0}
    with pytest.raises(errors.ModelErrors) as caught:
        bone_form.apply_values(DROP, 'left_shin', wrong)
    assert {error.path for error in caught.value.errors} == set(wrong)


@pytest.mark.parametrize(('wrong', 'field', 'words'), [
    ({'limits_1': '5'}, 'limits_1', 'two angles'), ({'limits_1': 'a, b'}, 'limits_1', "'a, b'"),
    ({'limits_1': '-400, 0'}, 'limits_1', r'\(-400.0, 0.0\).*within one turn'),
    ({'limits_1': 'nan, 1'}, 'limits_1', 'two angles'), ({'limits_2': '9, 1'}, 'limits_2', r'9.*1'),
    ({'axis_1': (0.0, 0.0, 0.0)}, 'axis_1', 'not zero'),
    ({'axis_2': (0.0, 1.0, 0.5)}, 'axis_2', 'perpendicular')])
def test_a_faulty_joint_is_told_at_its_field(wrong, field, words):
    with pytest.raises(errors.ModelErrors, match=words) as caught:
        bone_form.apply_values(DROP, 'left_thigh', wrong)
    assert [error.path for error in caught.value.errors] == [field]


@pytest.mark.parametrize('text', ['-90, 4.5', '-90 4.5', '-90,4.5', '-90; 4,5', '-90;4.5',
                                  '-90° 4.5°', '-90; 4,5°', '-90, 4.5 deg', '(-90, 4.5)'])
def test_a_pair_of_limits_is_typed_as_any_numbers_are(text):
    scene = bone_form.apply_values(DROP, 'left_shin', {'limits_1': text})
    assert changes.joint_of(scene, 'left_shin').limits == (
        (math.radians(-90), math.radians(4.5)),)


def test_a_balls_limits_may_be_typed_as_one_number():
    scene = changes.set_joint_kind(DROP, 'left_thigh', 'ball')
    scene = bone_form.apply_values(scene, 'left_thigh', {'limits_1': '40', 'limits_2': '-20 20'})
    assert np.degrees(changes.joint_of(scene, 'left_thigh').limits) == pytest.approx(
        np.array([[-40, 40], [-20, 20]]))


@pytest.mark.parametrize('seed', range(40))
def test_whatever_is_typed_is_taken_or_refused(seed):
    random = np.random.default_rng(seed)
    name = DROP.bone_names[seed % len(DROP.bone_names)]
    numbers = (0.0, -1.0, 1e-320, 1e308, -1e308, math.nan, math.inf, 0.3)
    texts = ('', 'x', '1e999', '-', '1, 2, 3', 'nan', '0 0', '\0', '1e308', '-90, 90')
    fields = bone_form.read_bone(DROP, name)
    for key in random.choice(list(fields), 3):
        if isinstance(fields[key], tuple):
            fields[key] = tuple(float(x) for x in random.choice(numbers, len(fields[key])))
        elif key not in ('shape', 'kind'):
            fields[key] = random.choice(texts) if isinstance(fields[key], str) else float(
                random.choice(numbers))
    try:
        bone_form.apply_values(DROP, name, fields)
    except errors.ModelErrors as error:
        assert all(error.path in fields for error in error.errors)


def test_a_shoulder_of_three_ranges_is_mirrored_and_typed(fitted):
    """The right arm of a fitted person is its left one's image already, to the fit's rounding."""
    names = 'mixamorig:LeftArm', 'mixamorig:RightArm'
    scene = mirror.mirrored(fitted, names[0])
    before, after = (changes.joint_of(each, names[1]) for each in (fitted, scene))
    # About an axis the other way round, its angles are the other way round.
    flips = np.sign(np.sum(joint_axes(after) * joint_axes(before), axis=1))
    assert np.allclose(flips[:, None] * joint_axes(after), joint_axes(before), atol=1e-5)
    limits = [pair if flip > 0 else (-pair[1], -pair[0])
              for flip, pair in zip(flips, after.angle_limits, strict=True)]
    assert np.allclose(limits, before.angle_limits, atol=1e-5)
    scene = bone_form.apply_values(fitted, names[0], {'limits_3': '-10, 30'})
    assert np.degrees(changes.joint_of(scene, names[0]).limits[2]) == pytest.approx((-10, 30))
    # The form shows nine digits.
    assert np.allclose(changes.joint_of(scene, names[0]).limits[:2],
                       changes.joint_of(fitted, names[0]).limits[:2], atol=1e-8)
    scene = changes.set_joint_kind(fitted, names[0], 'hinge')
    assert changes.joint_of(scene, names[0]).kind == 'hinge'

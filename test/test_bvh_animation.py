"""Dolls that move as files of motion capture say: their own, and those of other skeletons."""
from __future__ import annotations

import math
import re

import fit_rigs
import numpy as np
import pytest
from animated_rigs import worlds_at
from bvh_files import ARMS_DOWN, CMU, FRAME_TIME, bvh
from samples import every_kind, scene_of

from ragdoll_ros import (
    Placement,
    Scene,
    Simulation,
    load_animations,
    load_doll,
    load_scene,
    save_scene,
)
from ragdoll_ros.files.bvh.doll_motion import read_bvh_motion
from ragdoll_ros.files.bvh.joints import joints_of_bodies
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.files.gltf.nodes import TO_ROS
from ragdoll_ros.files.run_scene import read_run_scene, run_scene_text
from ragdoll_ros.fit.command import main as fit
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelErrors, OutOfRange, RagdollError
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.recordings.bvh_file import bvh_text
from ragdoll_ros.recordings.recording import Recorder

W = 2 * math.pi * 1.2
"""rad/s, of strides and of swinging arms."""

G = 9.8

TIME = 61.5 * FRAME_TIME
"""s, amid two frames."""


LEG = 7.2 + 7.6
"""From hip to ankle in the file."""


def anchor(doll, child):
    """Place of the joint of a body."""
    return np.array(next(joint.anchor for joint in doll.joints if joint.child == child))


def leg(doll):
    """From hip to ankle, m."""
    return anchor(doll, 'left_thigh')[2] - anchor(doll, 'left_foot')[2]


@pytest.fixture(scope='module')
def man():
    return load_doll('man')


def about(axis, angle):
    """SciPy's rotation about an axis of the file: x to the left, y up, z forward."""
    rotations = pytest.importorskip('scipy.spatial.transform').Rotation
    return rotations.from_rotvec(angle * np.array(axis))


def swing(axis, size, phase=0.0):
    """A joint that swings."""
    return lambda time: about(axis, size * math.sin(W * time + phase))


def loaded(tmp_path, doll, text, **chosen):
    path = tmp_path / 'move.bvh'
    path.write_text(text)
    return load_animations(doll, path, **chosen)['move']


def pose_of(doll, animation, time=0.0):
    """Poses of the bodies by their names, as the doll follows."""
    here = animation.place(Placement(doll), time)
    return {bone.name: here.bone_pose(bone) for bone in doll.bones}


def direction(poses, *names):
    """From one body's centre of mass to another's."""
    first, second = (poses[name].position for name in names)
    return (second - first) / np.linalg.norm(second - first)


@pytest.mark.parametrize('name', ['man', 'doll', 'character', 'every kind'])
def test_a_recorded_fall_comes_back(tmp_path, name):
    pytest.importorskip('numba')
    scene = scene_of(every_kind()) if name == 'every kind' else above_ground(load_doll(name))
    recorder, doll = Recorder(scene), scene.dolls[0].doll
    with Simulation(scene, accuracy='draft') as simulation:
        simulation.push(Push(scene.bone_names[0], (100.0, 50.0, 0.0), duration=0.1))
        for _ in range(40):
            simulation.advance()
            recorder.take(simulation)
    recording = recorder.recording()
    animation = loaded(tmp_path, doll, bvh_text(recording))
    assert animation.duration == pytest.approx(recording.duration, abs=1e-7)
    asked = read_bvh_motion(doll, tmp_path / 'move.bvh', {})
    for k in (0, 17, 39):
        time = animation.duration * k / 39
        motions, index = asked.at(np.array(time)), {b.name: i for i, b in enumerate(doll.bones)}
        for body, motion in motions.items():
            # The file has 1e-9 m and 2e-9 rad for each joint from the root on.
            np.testing.assert_allclose(motion.position, recording.positions[k, index[body]],
                                       atol=1e-8)
            assert rotation.angle_between(motion.pose(doll.bone(body)).orientation,
                                          recording.orientations[k, index[body]]) < 1e-8
        assert motions.keys() == index.keys()
        found = animation.at(time)
        # A draft exceeds limits by some 1e-5 rad. The universal joint of every kind turns over.
        assert name == 'every kind' or (not found.clipped and max(found.distances.values()) < 1e-5)


def test_velocities_are_those_of_the_functions(tmp_path, man):
    """Of a straight leg and a straight arm, whose bodies turn as one about hip and shoulder."""
    turns = {'LeftUpLeg': swing((1, 0, 0), 0.4), 'RightArm': swing((0, 1, 0), 0.3, 0.5)}
    animation = loaded(tmp_path, man, bvh(ARMS_DOWN, turns, lambda time: (
        0, 17, 20 * time), count=121, order='ZXY'))
    found = animation.at(TIME)
    assert not found.clipped
    state = started(animation.place(Placement(man), TIME))
    index = {bone.name: k for k, bone in enumerate(man.bones)}
    pelvis = state.linear_velocities[index['pelvis']]
    assert pelvis == pytest.approx((20 * leg(man) / LEG, 0, 0), abs=1e-3)
    # The file's x, to the left, is y.
    spin = np.array((0, 0.4 * W * math.cos(W * TIME), 0))
    hips = state.positions[index['pelvis']] + np.subtract(anchor(man, 'left_thigh'),
                                                          man.root.position)
    for body in ('left_thigh', 'left_shin', 'left_foot'):
        arm = state.positions[index[body]] - hips
        assert state.angular_velocities[index[body]] == pytest.approx(spin, abs=1e-3)
        assert state.linear_velocities[index[body]] == pytest.approx(
            pelvis + np.cross(spin, arm), abs=1e-3)
    twist = np.array((0, 0, 0.3 * W * math.cos(W * TIME + 0.5)))
    for body in ('right_upper_arm', 'right_forearm', 'right_hand'):
        assert state.angular_velocities[index[body]] == pytest.approx(twist, abs=1e-3)
        assert state.linear_velocities[index[body]] == pytest.approx(pelvis, abs=1e-3)


def started(placement):
    """The first state of a doll in free fall."""
    pytest.importorskip('numba')
    with Simulation(Scene('start', (placement,))) as simulation:
        return simulation.state


def test_limbs_point_where_those_of_a_t_pose_do(tmp_path, man):
    """The doll's arms hang in its bind pose, and may be spread by up to 85 degrees; in the file
    they are 30 degrees below a T.
    """
    sink = {f'{side}Arm': lambda time, left=left: about((0, 0, 1), -left * math.pi / 6)
            for side, left in (('Left', 1), ('Right', -1))}
    poses = pose_of(man, loaded(tmp_path, man, bvh(CMU, sink)))
    for side, left in (('left', 1), ('right', -1)):
        for limb in (('upper_arm', 'forearm'), ('forearm', 'hand')):
            due = direction(poses, *(f'{side}_{part}' for part in limb))
            assert due == pytest.approx((0, left * math.cos(math.pi / 6), -0.5), abs=1e-6)
        down = direction(poses, f'{side}_thigh', f'{side}_shin')
        assert down == pytest.approx((0, 0, -1), abs=1e-6)
    for body in ('pelvis', 'abdomen', 'chest', 'head', 'left_foot', 'right_foot'):
        turned = rotation.angle_between(poses[body].orientation, man.bone(body).orientation)
        assert turned < 1e-6, body


def test_legs_that_are_apart_at_rest_stand_on_flat_feet(tmp_path, man):
    """As files of the CMU have them: thighs are turned by 20 degrees to stand."""
    slant, skeleton, turns = math.radians(20), dict(CMU), {}
    for side, left in (('Left', 1), ('Right', -1)):
        for part in ('Leg', 'Foot', 'ToeBase'):
            up, offset = CMU[f'{side}{part}']
            skeleton[f'{side}{part}'] = up, tuple(about((0, 0, left), slant).apply(offset))
        turns[f'{side}UpLeg'] = lambda time, left=left: about((0, 0, left), -slant)
    poses = pose_of(man, loaded(tmp_path, man, bvh(skeleton, turns)))
    for body in ('left_thigh', 'right_shin', 'left_foot', 'right_foot'):
        turned = rotation.angle_between(poses[body].orientation, man.bone(body).orientation)
        assert turned < 1e-6, body


def test_two_rest_poses_of_one_motion_move_a_doll_alike(tmp_path, man):
    """Arms that are spread in one and hang in the other."""
    turns = {'Hips': swing((0, 1, 0), 0.5), 'Spine': swing((1, 0, 0), 0.2, 1),
             'LeftArm': swing((1, 0, 0), 0.5), 'LeftForeArm': swing((1, 0, 0), 0.4, 2),
             'RightArm': swing((0.6, 0, 0.8), 0.3), 'RightLeg': swing((1, 0, 0), 0.2)}
    hangs = {f'{side}Arm': about((0, 0, 1), -left * math.pi / 2)
             for side, left in (('Left', 1), ('Right', -1))}

    def spread(name, time):
        # What is below turns in the axes of the arm that hangs.
        side = 'Left' if name.startswith('Left') else 'Right'
        turn, down = turns[name](time), hangs[f'{side}Arm']
        if name in hangs:
            return turn * down
        return down.inv() * turn * down if name.endswith('ForeArm') else turn

    other = {name: lambda time, name=name: spread(name, time) for name in turns}
    first = loaded(tmp_path, man, bvh(ARMS_DOWN, turns, count=121))
    second = loaded(tmp_path, man, bvh(CMU, other, count=121, order='YXZ'))
    for time in (0.0, 0.4, 0.99):
        ours, theirs = (pose_of(man, each, time) for each in (first, second))
        for body, pose in ours.items():
            assert pose.position == pytest.approx(theirs[body].position, abs=1e-5), body
            assert rotation.angle_between(pose.orientation, theirs[body].orientation) < 1e-5


def test_a_person_stands_on_its_feet(tmp_path, man):
    """The hips are as high above the ankles as in the file, in lengths of a leg."""
    ankle = anchor(man, 'left_foot')[2] / leg(man) * LEG
    poses = pose_of(man, loaded(tmp_path, man, bvh(CMU, places=lambda time: (
        0, ankle + LEG + 1.5, 0))))
    for body in ('left_foot', 'right_shin'):
        assert poses[body].position[2] == pytest.approx(man.bone(body).position[2], abs=1e-6)


@pytest.mark.parametrize('swap', ['xyz', 'z up', 'facing x'])
def test_axes_are_found_from_the_rest_pose(tmp_path, man, swap):
    """A body that leans forward and goes forward does so in each."""
    def turned(vector):
        x, y, z = vector
        return {'xyz': (x, y, z), 'z up': (x, -z, y), 'facing x': (z, y, -x)}[swap]

    skeleton = {name: (up, turned(offset)) for name, (up, offset) in CMU.items()}
    lean = about(turned((1, 0, 0)), 0.3)
    animation = loaded(tmp_path, man, bvh(
        skeleton, {'Hips': lambda time: lean}, lambda time: turned((0, 17, 30 * time)), count=5))
    up = direction(pose_of(man, animation), 'pelvis', 'head')
    assert up == pytest.approx((math.sin(0.3), 0, math.cos(0.3)), abs=1e-6)
    assert animation.at(0.01).velocity[0] > 1 > abs(animation.at(0.01).velocity[1:]).max()


@pytest.mark.parametrize('name', ['doll', 'woman', 'walker', 'character'])
def test_a_common_skeleton_moves_each_doll(tmp_path, name):
    """The block doll, a person, and characters of VRM's names: their left arms swing forward."""
    doll = load_doll(name)
    turns = {'LeftArm': lambda time: about((1, 0, 0), -1)}
    animation = loaded(tmp_path, doll, bvh(ARMS_DOWN, turns))
    arm, hand = ({'doll': ('left_upper_arm', 'left_forearm'), 'woman': (
        'left_upper_arm', 'left_hand')}.get(name) or (
            next(bone.name for bone in doll.bones if part in bone.name and (
                '_L_' in bone.name or 'Left' in bone.name)) for part in ('Arm', 'Hand')))
    poses = pose_of(doll, animation)
    assert direction(poses, arm, hand) == pytest.approx(
        (math.sin(1), 0, -math.cos(1)), abs=0.2), (arm, hand)


def test_a_fitted_character_moves_as_its_own_bones(tmp_path):
    """Each body as its bone, whose head is not the joint of the doll."""
    rig = fit_rigs.RIGS['cmu']
    doll = fit_character(read_character(fit_rigs.write(rig, tmp_path)), FitOptions()).placed(
        model=str(tmp_path / 'cmu.glb')).doll
    moves = {'Hips': ((0.2, 0.3, 0), 0.5), 'LeftUpLeg': ((1, 0, 0), 0.5),
             'Spine': ((1, 0, 0), -0.2), 'LeftLeg': ((1, 0, 0), 0.4),
             'RightArm': ((0, 0.6, 0.8), 0.5)}
    heads = {bone.name: np.array(bone.head) for bone in rig.bones}
    up_of = {bone.name: rig.bones[bone.parent].name if bone.parent >= 0 else ''
             for bone in rig.bones}
    skeleton = {name: (up_of[name], tuple(100 * (heads[name] - heads.get(up_of[name], 0))))
                for name in heads}
    turns = {name: lambda time, axis=axis, size=size: about(axis, size)
             for name, (axis, size) in moves.items()}
    animation = loaded(tmp_path, doll, bvh(skeleton, turns, lambda time: 100 * heads['Hips']))
    bind, moved = (np.array(worlds_at(rig, each, 0.0)) for each in ({}, {
        name: lambda time, axis=axis, size=size: (np.zeros(3), size * np.array(axis))
        for name, (axis, size) in moves.items()}))
    motions = read_bvh_motion(doll, tmp_path / 'move.bvh', {}).at(np.array(0.0))
    index = {bone.name: k for k, bone in enumerate(rig.bones)}
    assert motions.keys() == {bone.name for bone in doll.bones}
    for body, motion in motions.items():
        place = np.append(TO_ROS.T @ doll.bone(body).position, 1.0)
        due = moved[index[body]] @ np.linalg.inv(bind[index[body]]) @ place
        # Riders are written with 1e-9 m, bones of the character in 32 bits.
        assert motion.position == pytest.approx(TO_ROS @ due[:3], abs=1e-6), body
    assert animation.at(0.0).distances['Hips'] == pytest.approx(0, abs=1e-6)


def test_a_jump_that_goes_limp_keeps_its_parabola(tmp_path, man):
    """The centre of mass, in the air."""
    pytest.importorskip('numba')
    metre = LEG / leg(man)
    animation = loaded(tmp_path, man, bvh(ARMS_DOWN, {}, lambda time: metre * np.array(
        (0.3 * time, 3 * time - G * time ** 2 / 2, 2 * time)), count=121))
    masses = [bone.mass for bone in man.bones]
    scene = Scene('jump', (animation.place(Placement(man), TIME),), gravity=(0, 0, -G))
    with Simulation(scene) as simulation:
        begin = np.average(simulation.state.positions, axis=0, weights=masses)
        simulation.run(30)
        end = np.average(simulation.state.positions, axis=0, weights=masses)
    later = TIME + 0.3
    due = np.array((2 * 0.3, 0.3 * 0.3, 3 * 0.3 - G * (later ** 2 - TIME ** 2) / 2))
    assert end - begin == pytest.approx(due, abs=1e-5)


def test_joints_are_chosen_by_name(tmp_path, man):
    """For those that are named otherwise; others are found as before."""
    named = {name.replace('LeftUpLeg', 'Joint_7'): (up.replace('LeftUpLeg', 'Joint_7'), offset)
             for name, (up, offset) in ARMS_DOWN.items()}
    turns = {'Joint_7': lambda time: about((1, 0, 0), -0.5)}
    animation = loaded(tmp_path, man, bvh(named, turns), bones={'left_thigh': 'Joint_7'})
    poses = pose_of(man, animation)
    for side, angle in (('left', 0.5), ('right', 0)):
        assert direction(poses, f'{side}_thigh', f'{side}_shin') == pytest.approx(
            (math.sin(angle), 0, -math.cos(angle)), abs=1e-6)


@pytest.mark.parametrize(('skeleton', 'chosen', 'words'), [
    (CMU, {'left_thigh': 'Knee'}, 'bones.left_thigh: UnknownJoint: .Knee.; expected one of Hips, '),
    (CMU, {'thigh': 'LeftLeg'}, 'bones.thigh: UnknownBone: .thigh.; expected one of pelvis, '),
    ({'a': ('', (0, 0, 0)), 'b': ('a', (0, 1, 0))}, {}, 'bones: WrongForm: .a, b.; expected')])
def test_a_file_that_does_not_fit_is_refused(tmp_path, man, skeleton, chosen, words):
    with pytest.raises(RagdollError, match=words):
        loaded(tmp_path, man, bvh(skeleton), bones=chosen)


SKELETONS = {  # chains from the root on; a name that was there before continues from there
    'Mixamo': 'Hips Spine Spine1 Spine2 Neck Head/Spine2 LeftShoulder LeftArm LeftForeArm LeftHand '
              'LeftHandIndex1/Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase',
    'SMPL': 'Pelvis L_Hip L_Knee L_Ankle L_Foot/Pelvis Spine1 Spine2 Spine3 Neck Head/'
            'Spine3 L_Collar L_Shoulder L_Elbow L_Wrist L_Hand',
    'Biped': 'Bip01 Pelvis Spine Spine1 Neck Head/Neck L_Clavicle L_UpperArm L_Forearm L_Hand/'
             'Spine L_Thigh L_Calf L_Foot L_Toe0',
    'Biovision': 'Hips LeftHip LeftKnee LeftAnkle/Hips Chest Neck Head/'
                 'Chest LeftCollar LeftShoulder LeftElbow LeftWrist',
    'ASF': 'root lhipjoint lfemur ltibia lfoot ltoes/root lowerback upperback thorax lowerneck '
           'upperneck head/thorax lclavicle lhumerus lradius lwrist lhand lfingers',
    'Blender': 'hips spine chest neck head/chest shoulder.L upper_arm.L forearm.L hand.L/'
               'hips thigh.L shin.L foot.L toe.L'}

DUE = {  # joints of: pelvis, chest, head, left upper arm, forearm, hand, thigh, shin, foot
    'Mixamo': 'Hips Spine2 Head LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot',
    'SMPL': 'Pelvis Spine3 Head L_Shoulder L_Elbow L_Wrist L_Hip L_Knee L_Ankle',
    'Biped': 'Pelvis Spine1 Head L_UpperArm L_Forearm L_Hand L_Thigh L_Calf L_Foot',
    'Biovision': 'Hips Chest Head LeftShoulder LeftElbow LeftWrist LeftHip LeftKnee LeftAnkle',
    'ASF': 'root thorax head lhumerus lradius lwrist lfemur ltibia lfoot',
    'Blender': 'hips chest head upper_arm.L forearm.L hand.L thigh.L shin.L foot.L'}


@pytest.mark.parametrize('kind', SKELETONS)
@pytest.mark.parametrize('prefix', ['', 'rig:'])
def test_joints_of_common_skeletons_are_found(man, kind, prefix):
    names, parents = [], []
    for chain in SKELETONS[kind].split('/'):
        up = -1
        for name in chain.split():
            if name not in names:
                names.append(name)
                parents.append(up)
            up = names.index(name)
    found = joints_of_bodies(man, [prefix + name for name in names], parents, {})
    parts = ('upper_arm', 'forearm', 'hand', 'thigh', 'shin', 'foot')
    bodies = ('pelvis', 'chest', 'head', *(f'left_{part}' for part in parts))
    assert [names[found[body]] for body in bodies] == DUE[kind].split()


def test_an_edge_of_no_length_is_refused(tmp_path, man):
    """By which places would be scaled beyond all bounds."""
    tiny = {name: (up, tuple(1e-30 * np.array(offset))) for name, (up, offset) in CMU.items()}
    with pytest.raises(OutOfRange, match=r'pelvis: OutOfRange: .*; expected places of at most'):
        loaded(tmp_path, man, bvh(tiny, places=lambda time: (1, 17, 0)))


def test_a_single_frame_is_a_pose(tmp_path, man):
    animation = loaded(tmp_path, man, bvh(CMU, count=1))
    assert animation.duration == 0 and animation.at(0.0).velocity == pytest.approx((0, 0, 0))
    assert animation.place(Placement(man), 0.0).rates == {} or not any(
        animation.at(0.0).rates.values())


def scene_file(tmp_path, **entry):
    """A scene in a folder of its own, beside walk.bvh, in which a man walks to the left."""
    stride = {'LeftUpLeg': swing((1, 0, 0), 0.4), 'RightUpLeg': swing((1, 0, 0), 0.4, math.pi)}
    (tmp_path / 'captures').mkdir()
    (tmp_path / 'captures' / 'walk.bvh').write_text(bvh(ARMS_DOWN, stride, lambda time: (
        20 * time, 17.5, 0), count=101))
    fields = ', '.join(f'{key}: {value}' for key, value in entry.items())
    path = tmp_path / 'scene.yaml'
    path.write_text('ground: {normal: [0, 0, 1], offset: 0}\n'
                    f'dolls:\n  - {{doll: man, {fields}}}\n')
    return str(path)


def test_a_scene_plays_a_file_until_the_doll_goes_limp(tmp_path, man):
    pytest.importorskip('numba')
    scene = load_scene(scene_file(
        tmp_path, animation='{file: captures/walk.bvh, start: 0.1, loop: true, limp_at: 1}'))
    playback = scene.dolls[0].animation
    assert playback.name == 'walk' and playback.file == str(tmp_path / 'captures' / 'walk.bvh')
    (tmp_path / 'other').mkdir()
    save_scene(scene, tmp_path / 'other' / 'saved.yaml')
    text = (tmp_path / 'other' / 'saved.yaml').read_text()
    assert 'file: ../captures/walk.bvh' in text
    assert load_scene(str(tmp_path / 'other' / 'saved.yaml')) == scene
    assert read_run_scene(run_scene_text(scene))[0] == scene
    with Simulation(scene) as simulation:
        simulation.run(99)
        assert simulation.animated == ('man',)
        walked = simulation.state.positions[0]
        simulation.run(60)
        assert simulation.animated == ()
        fallen = simulation.state.positions[0]
    # From 0.1 s on, with a loop after 0.83 s.
    assert walked[1] == pytest.approx(20 * leg(man) / LEG * 1.09, abs=1e-6)
    assert fallen[2] < walked[2] - 0.1 and fallen[1] > walked[1] + 0.2


def test_a_scene_chooses_joints_and_a_name(tmp_path):
    path = scene_file(tmp_path, animation='{file: captures/walk.bvh, name: stroll, '
                                          'bones: {left_thigh: LHipJoint}}')
    scene = load_scene(path)
    playback = scene.dolls[0].animation
    assert playback.name == 'stroll' and playback.bones == {'left_thigh': 'LHipJoint'}
    save_scene(scene, tmp_path / 'saved.yaml')
    assert load_scene(str(tmp_path / 'saved.yaml')).dolls == scene.dolls


def test_a_scene_starts_limp_within_a_file(tmp_path):
    scene = load_scene(scene_file(tmp_path, animation='{file: captures/walk.bvh, time: 0.5}'))
    assert scene.dolls[0].animation is None and scene.dolls[0].velocity[1] > 1
    save_scene(scene, tmp_path / 'saved.yaml')
    assert load_scene(str(tmp_path / 'saved.yaml')).dolls == scene.dolls


@pytest.mark.parametrize(('animation', 'place', 'words'), [
    ('{file: none.bvh}', 'animation.file', 'expected a .bvh: a path from the scene'),
    ('{file: scene.yaml}', 'animation.(scene.yaml)', 'a file whose name ends in .bvh'),
    ('{file: broken.bvh}', 'animation.(broken.bvh).line 1', 'expected a BVH file'),
    ('{file: captures/walk.bvh, bones: {left_thigh: Knee}}', 'animation.bones.left_thigh',
     'UnknownJoint: .Knee.; expected one of'),
    ('{file: captures/walk.bvh, bones: [Knee]}', 'animation.bones', 'expected a mapping'),
    ('{file: 3}', 'animation.file', 'expected a string'),
    ('{file: captures/walk.bvh, start: 2}', 'animation.start', 'OutOfRange: 2'),
    ('{loop: true}', 'animation', 'expected the missing name, or a file'),
    ('{name: walk, bones: {left_thigh: Knee}}', 'animation.bones', 'expected a file')])
def test_a_wrong_entry_is_named(tmp_path, animation, place, words):
    (tmp_path / 'broken.bvh').write_text('secret: 7')
    with pytest.raises(ModelErrors, match=words) as caught:
        load_scene(scene_file(tmp_path, animation=animation))
    assert [error.path for error in caught.value.errors] == [f'dolls[0].{place}']
    assert 'secret' not in str(caught.value)


def test_the_report_says_how_well_a_doll_follows(tmp_path, capsys):
    """A T-pose of other proportions; and a knee that is bent the wrong way."""
    walker = config_folder() / 'walker.glb'
    skeleton = {name: (up, tuple(np.array(offset) / 17)) for name, (up, offset) in CMU.items()}
    (tmp_path / 'still.bvh').write_text(bvh(skeleton, count=25))
    bent = {'LeftLeg': lambda time: about((1, 0, 0), -1.0)}
    (tmp_path / 'bent.bvh').write_text(bvh(skeleton, bent, count=25))
    files = [str(tmp_path / f'{name}.bvh') for name in ('still', 'bent')]
    dolls = [str(config_folder() / f'{name}.yaml') for name in ('walker', 'man')]
    for doll in (str(walker), *dolls):
        assert fit([doll, '--animation', *files]) == 0
        lines = [line for line in capsys.readouterr().out.splitlines() if '0.2 s' in line]
        assert lines[0].startswith('animation still: 0.2 s; followed to within ')
        # Arms of man reach 85 degrees, knees of the walker are bent by 6: no more than that.
        assert int(re.search(r'within (\d+) mm', lines[0])[1]) < 60
        assert int(re.search(r'within (\d+) mm', lines[1])[1]) > 200
        assert re.search(r'beyond their limits: .*(LowerLeg|knee)', lines[1]), doll
    assert fit([str(walker), '--animation', str(tmp_path / 'none.bvh')]) == 2
    assert 'none.bvh: Unreadable' in capsys.readouterr().err
    (tmp_path / 'other.bvh').write_text(bvh({'a': ('', (0, 0, 0)), 'b': ('a', (0, 1, 0))}))
    assert fit([dolls[1], '--animation', str(tmp_path / 'other.bvh')]) == 2
    assert re.search('--animation .*other.bvh.bones: WrongForm', capsys.readouterr().err)

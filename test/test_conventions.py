"""Units, frames, signs, axis and quaternion order: the places where such projects go wrong."""
import dataclasses
import math

import numpy as np
import pytest
from conserved import conserved

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.scene import Placement
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine

ARTICLE_CM = {
    # Centres in the article's axes (x left, y up, z forward) and centimetres.
    'torso': (0, 110, 0), 'head': (0, 145, 0), 'left_upper_arm': (25, 130, 0),
    'left_forearm': (50, 130, 0), 'right_upper_arm': (-25, 130, 0),
    'right_forearm': (-50, 130, 0), 'left_thigh': (7.5, 75, 0), 'left_shin': (7.5, 50, 0),
    'right_thigh': (-7.5, 75, 0), 'right_shin': (-7.5, 50, 0)}

LIFTS = [
    # bone that ends the limb, angle, turn (degrees), direction in which the bone must go
    ('left_shin', 'left_shin', 60, (-1, 0, 0)), ('right_shin', 'right_shin', 60, (-1, 0, 0)),
    ('left_shin', 'left_thigh_1', -60, (1, 0, 0)), ('right_shin', 'right_thigh_1', -60, (1, 0, 0)),
    ('left_forearm', 'left_forearm', -60, (1, 0, 0)),
    ('right_forearm', 'right_forearm', 60, (1, 0, 0)),
    ('left_shin', 'left_thigh_2', 60, (0, 1, 0)), ('right_shin', 'right_thigh_2', -60, (0, -1, 0)),
    ('left_forearm', 'left_upper_arm_1', -60, (1, 0, 0)),
    ('right_forearm', 'right_upper_arm_1', 60, (1, 0, 0)),
    ('left_forearm', 'left_upper_arm_2', 60, (0, 0, 1)),
    ('right_forearm', 'right_upper_arm_2', -60, (0, 0, 1)),
    ('head', 'head_1', 30, (1, 0, 0)), ('head', 'head_2', 30, (0, -1, 0))]


@pytest.fixture(scope='module')
def engine():
    engine = BulletEngine(load_scene('flight'), NORMAL)
    yield engine
    engine.close()


def turned(engine, angles_deg):
    """The engine's state with joint angles set by name, in degrees."""
    scene = engine.scene
    start = BulletEngine(scene, NORMAL)
    base = start.coordinates
    start.close()
    q = base.q.copy()
    names = scene.angle_names
    for name, angle in angles_deg.items():
        q[7 + names.index(name)] = math.radians(angle)
    engine.set_coordinates(GeneralizedState(q, np.zeros_like(base.v)))
    return engine.state


@pytest.mark.parametrize('name', ['doll', 'article_doll'])
def test_the_articles_axes_become_ros_axes(name):
    for bone in load_doll(name).bones:
        x, y, z = ARTICLE_CM[bone.name]
        assert bone.position == pytest.approx((z / 100, x / 100, y / 100), abs=1e-15)


def test_the_doll_is_the_articles():
    doll = load_doll('doll')
    assert len(doll.bones) == 10 and len(doll.joints) == 9
    assert sum(joint.dof for joint in doll.joints) == 14
    assert doll.mass == 55
    assert doll.root.name == 'torso'


def test_the_dolls_differ_in_the_hips_limits_and_in_damping_alone():
    doll, printed = load_doll('doll'), load_doll('article_doll')
    same = [dataclasses.replace(joint, damping=0) for joint in doll.joints]
    differ = [a.child for a, b in zip(same, printed.joints, strict=True) if a != b]
    assert differ == ['left_thigh', 'right_thigh']
    assert doll.bones == printed.bones


@pytest.mark.parametrize(('bone', 'angle', 'turn', 'way'), LIFTS)
def test_positive_angles_move_limbs_the_right_way(engine, bone, angle, turn, way):
    index = engine.scene.bone_index(bone)
    rest = turned(engine, {}).positions[index]
    moved = turned(engine, {angle: turn}).positions[index]
    # A limb of 0.1 m or more turned by 30 degrees or more ends 5 cm away at least.
    assert (moved - rest) @ way > 0.04


def test_angles_are_read_where_they_are_set(engine):
    names = engine.scene.angle_names
    angles = {name: 3.0 * (index + 1) for index, name in enumerate(names)}
    turned(engine, angles)
    found = engine.layout.joint_angles(engine.coordinates.q)
    assert np.degrees(found) == pytest.approx(list(angles.values()), abs=1e-9)


def test_a_universal_joints_first_axis_is_the_parents(engine):
    """First about the parent's y, then about the child's x: R = Ry Rx, as intrinsic turns."""
    state = turned(engine, {'left_thigh_1': -70, 'left_thigh_2': 50})
    about_y = rotation.from_axis_angle((0, 1, 0), math.radians(-70))
    about_x = rotation.from_axis_angle((1, 0, 0), math.radians(50))
    index = engine.scene.bone_index('left_thigh')
    expected = rotation.multiply(about_y, about_x)
    assert rotation.angle_between(state.orientations[index], expected) < 1e-9


def test_quaternions_are_xyzw_and_right_handed():
    quarter = (0, 0, math.sqrt(0.5), math.sqrt(0.5))
    assert rotation.rotate(quarter, (1, 0, 0)) == pytest.approx((0, 1, 0), abs=1e-15)
    scene = load_scene('flight')
    placed = Placement(scene.dolls[0].doll, position=(1, 2, 3), orientation=quarter)
    engine = BulletEngine(dataclasses.replace(scene, dolls=(placed,)), NORMAL)
    hand = engine.state.positions[scene.bone_index('left_forearm')]
    engine.close()
    # The left hand, 0.5 m to +y of the doll, is turned to -x.
    assert hand == pytest.approx((1 - 0.5, 2, 3 + 1.3), abs=1e-12)


def test_velocities_are_of_the_centre_of_mass_in_world_axes():
    scene = load_scene('flight')
    spun = dataclasses.replace(scene.dolls[0], spin=(1, -3, 2), velocity=(1, 0, 0))
    engine = BulletEngine(dataclasses.replace(scene, dolls=(spun,)), NORMAL)
    state = engine.state
    engine.close()
    # All turns about the doll's centre of mass, which moves with the velocity.
    arms = state.positions - conserved(scene, state).centre
    expected = np.add(np.cross((1, -3, 2), arms), (1, 0, 0))
    assert state.linear_velocities == pytest.approx(expected, abs=1e-12)
    assert state.angular_velocities == pytest.approx(np.tile((1, -3, 2), (10, 1)), abs=1e-12)


def test_mirrored_poses_are_mirror_images(engine):
    left = {'left_thigh_1': -40, 'left_thigh_2': 25, 'left_shin': 50, 'left_upper_arm_1': -30,
            'left_upper_arm_2': 20, 'left_forearm': -70}
    # Mirroring y keeps turns about y and flips those about x and z.
    mirror = {'left_thigh_1': 1, 'left_shin': 1, 'left_thigh_2': -1, 'left_upper_arm_1': -1,
              'left_upper_arm_2': -1, 'left_forearm': -1}
    right = {name.replace('left', 'right'): mirror[name] * angle for name, angle in left.items()}
    a, b = turned(engine, left), turned(engine, right)
    for name in ('forearm', 'upper_arm', 'thigh', 'shin'):
        seen = a.positions[engine.scene.bone_index(f'left_{name}')]
        mirrored = b.positions[engine.scene.bone_index(f'right_{name}')] * (1, -1, 1)
        assert seen == pytest.approx(mirrored, abs=1e-12)

"""Bodies that follow frames of /tf: composition against scipy, velocities, and what is refused."""
from __future__ import annotations

import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from scipy.spatial.transform import Rotation

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.ros.inputs.bodies.body_frames import TF, FrameFollower
from ragdoll_ros.ros.parameters.body_frames import kept_body_frames, parse_body_frames

SCENE = """ground: {}
dolls: [{doll: doll, position: [0, 0, 0.05]}]
bodies:
  - {name: my robot, shape: {box: {size: [0.5, 0.4, 0.3]}}, position: [-2, 0, 0.16], follow: exact}
  - {name: cart, shape: {box: {size: [0.5, 0.4, 0.3]}}, position: [-2, 3, 0.16], follow: exact}
"""


def transform(parent, child, seconds=0.0, position=(0, 0, 0), turn=None):
    """As a broadcaster sends it; ``turn`` is scipy's."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp.sec, rest = divmod(round(seconds * 1e9), 10 ** 9)
    message.header.stamp.nanosec = rest
    message.transform.translation = Vector3(**dict(zip('xyz', map(float, position), strict=True)))
    q = (turn or Rotation.identity()).as_quat()
    message.transform.rotation = Quaternion(**dict(zip('xyzw', q.tolist(), strict=True)))
    return message


@pytest.fixture
def follower():
    """One whose body `cart` follows the frame `base` below `world`; what it drove and refused."""
    driven, refused = [], []
    made = FrameFollower(lambda *each: driven.append(each), lambda *each: refused.append(each))
    made.follow({'cart': 'base'}, 'world')
    made.driven, made.refused = driven, refused
    return made


def test_transforms_are_composed_as_scipy_composes_them(follower):
    rng = np.random.default_rng(1)
    steps = [(rng.normal(size=3), Rotation.random(random_state=seed)) for seed in (2, 3, 4)]
    names = ['world', 'map', 'odom', 'base']
    # In any order, and amid others.
    for k in (2, 0, 1):
        follower.on_transforms(TF, [transform('x', 'y'), transform(
            names[k], names[k + 1], 1.0, *steps[k])])
    matrix = np.eye(4)
    for move, turn in steps:
        matrix = matrix @ np.block([[turn.as_matrix(), move[:, None]], [np.zeros(3), 1.0]])
    (name, pose, twist, stamp), = follower.driven
    assert (name, stamp) == ('cart', 10 ** 9) and not np.any(twist) and not follower.refused
    assert pose[:3] == pytest.approx(matrix[:3, 3], abs=1e-12)
    assert rotation.matrix(np.array(pose[3:])) == pytest.approx(matrix[:3, :3], abs=1e-12)


def test_velocities_are_those_between_two_poses(follower):
    """A circle: parts of a wheel on a turntable, so that both frames move."""
    def tell(t):
        follower.on_transforms(TF, [
            transform('world', 'odom', t, (0, 0, 1), Rotation.from_euler('z', 2 * t)),
            transform('odom', 'base', t, (3, 0, 0), Rotation.from_euler('y', 0.5 * t))])

    for k in range(3):
        tell(5 + 0.01 * k)
    chord = 2 * 3 * math.sin(0.01) / 0.01  # m/s
    assert np.linalg.norm(follower.driven[2][2][:3]) == pytest.approx(chord, rel=1e-9)
    spin = np.array((0, 0, 2)) + 0.5 * np.array((-math.sin(10.03), math.cos(10.03), 0))
    # Of the mean rotation, to second order of 0.01 s.
    assert follower.driven[2][2][3:] == pytest.approx(spin, abs=1e-4)


@pytest.mark.parametrize('stamps, moves', [
    ((1, 1.1), [0, 1]), ((1, 1.3), [0, 0]), ((5, 1, 1.1), [0, 0, 1]), ((1, 1, 1.1), [0, 1])])
def test_a_velocity_needs_two_poses_shortly_one_after_the_other(follower, stamps, moves):
    """1 m/s; after a gap, or a time that began anew, zero; a stamp that repeats is ignored."""
    for stamp in stamps:
        follower.on_transforms(TF, [transform('world', 'base', stamp, (stamp, 0, 0))])
    assert [twist[0] for _, _, twist, _ in follower.driven] == pytest.approx(moves)


def test_a_frame_without_a_connection_is_refused_only_after_a_second(follower):
    for stamp in (1.0, 1.5, 2.0):
        follower.on_transforms(TF, [transform('odom', 'base', stamp)])
    assert not follower.refused and not follower.driven
    follower.on_transforms(TF, [transform('odom', 'base', 2.1)])
    (topic, error), = follower.refused
    assert topic == TF and "'odom'; expected frames up to world" in str(error)
    follower.on_transforms('/tf_static', [transform('world', 'odom')])
    assert len(follower.driven) == 1


def test_frames_in_a_circle_move_nothing(follower):
    for stamp in range(3):
        follower.on_transforms(TF, [transform('base', 'odom', stamp),
                                    transform('odom', 'base', stamp)])
    assert follower.refused and not follower.driven


@pytest.mark.parametrize('wrong, text', [
    (transform('world', 'base', 1, (0, math.nan, 0)), 'base.translation'),
    (transform('world', 'base', 1, (math.inf, 0, 0)), 'base.translation')])
def test_what_is_not_finite_is_refused(follower, wrong, text):
    follower.on_transforms(TF, [wrong])
    assert text in str(follower.refused[0][1]) and not follower.driven
    wrong = transform('world', 'base', 1)
    wrong.transform.rotation.w = 0.0
    follower.on_transforms(TF, [wrong])
    assert 'base.rotation' in str(follower.refused[1][1]) and not follower.driven


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / 'robot.yaml'
    path.write_text(SCENE)
    return str(path)


def test_the_parameter_names_driven_bodies_and_frames(scene_file):
    scene = load_scene(scene_file)
    entries = [' my robot  robot/base_link ', '', 'cart base']
    assert parse_body_frames(entries, scene) == {'my robot': 'robot/base_link', 'cart': 'base'}
    assert kept_body_frames(entries, scene) == (entries[0], entries[2])
    assert kept_body_frames(['robot base'], scene) == ('',)


@pytest.mark.parametrize('entries, error, text', [
    (['torso base'], errors.UnknownDoll, 'torso base'), (['cart'], errors.UnknownDoll, 'cart'),
    (['cart doll/torso'], errors.WrongForm, 'a frame that others publish'),
    (['cart a', 'cart b'], errors.DuplicateName, 'cart')])
def test_wrong_entries(scene_file, entries, error, text):
    with pytest.raises(error, match=text):
        parse_body_frames(entries, load_scene(scene_file))
    with pytest.raises(errors.UnknownDoll, match='the scene has none'):
        parse_body_frames(['cart base'], load_scene('drop'))


def test_a_node_moves_its_bodies(make_node, scene_file):
    from rclpy.parameter import Parameter
    node = make_node(scene=scene_file, start_paused=True, frame_id='map',
                     body_frames=['my robot base'])
    follower = node.bodies._frames._follower
    for k in range(11):
        follower.on_transforms(TF, [transform('map', 'base', 0.01 * k, (-1 + 0.005 * k, 0, 0.16))])
        node.tick()
    assert node.simulation.body_pose('my robot')[:3] == pytest.approx((-0.945, 0, 0.16), abs=1e-9)
    assert node.simulation.state.rows[-2, 7:] == pytest.approx((0.5, 0, 0, 0, 0, 0), abs=1e-9)
    assert node.simulation.stale_bodies == ('cart',)

    def set_to(*entries):
        return node.set_parameters([Parameter('body_frames', value=list(entries))])[0]

    assert set_to('cart base').successful
    follower.on_transforms(TF, [transform('map', 'base', 1.0, (-2, 3, 0.16))])
    assert node.simulation.stale_bodies == ()
    refused = set_to('pelvis base')
    assert not refused.successful and 'pelvis base' in refused.reason
    node.simulation.remove('cart')
    assert node.set_parameters([Parameter('scene', value='drop')])[0].reason.count('body_frames')
    assert set_to('').successful
    assert node.set_parameters([Parameter('scene', value='drop')])[0].successful

"""~/set_state and ~/set_joint_states: what they set, and that what is wrong is refused."""
from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
import yaml
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseArray,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
)
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String

HALF = math.sqrt(0.5)


def odometry(doll='doll_3', frame='world', position=(0, 0, 3), orientation=(0, 0, 0, 1),
             linear=(0, 0, 0), angular=(0, 0, 0)):
    point, q = Point(), Quaternion()
    point.x, point.y, point.z = map(float, position)
    q.x, q.y, q.z, q.w = map(float, orientation)
    twist = Twist()
    for vector, values in ((twist.linear, linear), (twist.angular, angular)):
        vector.x, vector.y, vector.z = map(float, values)
    return Odometry(header=Header(frame_id=frame), child_frame_id=doll,
                    pose=PoseWithCovariance(pose=Pose(position=point, orientation=q)),
                    twist=TwistWithCovariance(twist=twist))


def fill(message, fields):
    """Set the fields of a message that a mapping names, as ros2cli does."""
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        else:
            setattr(message, name, value)


@pytest.fixture
def node(make_node):
    return make_node(scene='crowd')


def row(node, doll):
    """Pose and velocities (13,) of a doll's root."""
    scene = node.simulation.scene
    placement, = (each for each in scene.dolls if each.name == doll)
    return node.simulation.state.rows[scene.bone_index(
        scene.qualified(placement, placement.doll.root.name))]


def test_the_pose_is_the_roots_and_the_twist_is_along_its_own_axes(node):
    """A quarter turn about z: forward, x of the doll, is y of the world."""
    node.states.on_odometry(odometry(
        position=(1, 2, 3), orientation=(0, 0, HALF, HALF), linear=(4, 0, 1), angular=(0.5, 0, 0)))
    assert row(node, 'doll_3') == pytest.approx(
        [1, 2, 3, 0, 0, HALF, HALF, 0, 4, 1, 0, 0.5, 0], abs=1e-12)
    assert not node.input_counts.refused


def test_it_comes_over_the_topic_and_is_logged_as_an_event(node, peer):
    """Real DDS; the event is what repeats it."""
    peer.executor_.add_node(node)
    heard = peer.collect(String, '/ragdoll/events')
    peer.sender(Odometry, '/ragdoll/set_state').publish(
        odometry(position=(0, 0, 50), linear=(0, 0, 9)))
    peer.wait(lambda: row(node, 'doll_3')[2] > 40)

    def events():
        told = (json.loads(message.data) for _, message in heard)
        return [each for each in told if each['kind'] == 'set_state']

    peer.wait(events)
    event, = events()
    assert event['doll'] == 'doll_3' and event['velocity'] == [0, 0, 9]


def test_a_paused_doll_is_shown_where_it_was_put(node, peer):
    """With a stamp of its own."""
    node.pause(True)
    poses = peer.collect(PoseArray, '/ragdoll/poses')
    peer.wait_heard(node, '/ragdoll/poses')
    node.states.on_odometry(odometry(position=(0, 0, 40)))
    root = node.simulation.scene.bone_index('doll_3/torso')
    peer.wait(lambda: poses and poses[-1][1].poses[root].position.z == 40)


@pytest.mark.parametrize(('wrong', 'text'), [
    ({'doll': 'doll_11'}, "'doll_11'; expected one of doll_1, doll_2"),
    ({'doll': ''}, "''; expected one of doll_1"),
    ({'frame': 'map'}, "header.frame_id: WrongForm: 'map'; expected world"),
    ({'position': (0, math.nan, 0)}, 'position'),
    ({'position': (0, 1e7, 0)}, 'position'),
    ({'orientation': (0, 0, 0, 0)}, 'pose.orientation'),
    ({'orientation': (0, 0, math.inf, 0)}, 'pose.orientation'),
    ({'linear': (0, math.inf, 0)}, 'twist.linear'),
    ({'angular': (math.nan, 0, 0)}, 'twist.angular')])
def test_what_is_wrong_is_refused_and_counted(node, wrong, text):
    before = node.simulation.state.rows.tobytes()
    node.states.on_odometry(odometry(**wrong))
    assert node.input_counts.refused == {'~/set_state': 1}
    assert text in node.input_counts.last_reason
    assert node.simulation.state.rows.tobytes() == before


def test_what_is_too_fast_is_clamped(node):
    node.states.on_odometry(odometry(linear=(0, 3e300, 4e300)))
    assert row(node, 'doll_3')[7:10] == pytest.approx((0, 600, 800))
    assert node.input_counts.clamped == {'~/set_state': 1}


def test_the_line_in_the_reference_is_understood(node):
    """`ros2 topic pub` of docs/reference.md: the YAML that it gives is a message."""
    text = (Path(__file__).parent.parent / 'docs/reference.md').read_text()
    block = re.search(r"pub --once /ragdoll/set_state (\S+) \\\s+'([^']*)'", text)
    assert block[1] == 'nav_msgs/msg/Odometry'
    message = odometry(position=(0, 0, 0))
    fill(message, yaml.safe_load(block[2]))
    node.states.on_odometry(message)
    assert not node.input_counts.refused
    assert row(node, 'doll_3')[2] == 2 and row(node, 'doll_3')[9] == pytest.approx(3)


def angles(node):
    return dict(zip(node.simulation.scene.angle_names, node.simulation.joint_angles, strict=True))


def test_joint_states_of_several_dolls_are_set_over_the_topic(node, peer):
    """Angles and rates by the names of joint_states; the roots stay."""
    peer.executor_.add_node(node)
    node.pause(True)
    roots = [row(node, doll) for doll in ('doll_2', 'doll_3')]
    names = ['doll_3/left_shin', 'doll_2/right_shin']
    peer.sender(JointState, '/ragdoll/set_joint_states').publish(
        JointState(name=names, position=[0.5, 0.75], velocity=[0.0, -2.0]))
    peer.wait(lambda: angles(node)[names[1]] == pytest.approx(0.75, abs=1e-9))
    assert angles(node)[names[0]] == pytest.approx(0.5, abs=1e-9)
    index = node.simulation.scene.angle_names.index(names[1])
    assert node.simulation.joint_rates[index] == pytest.approx(-2)
    for doll, before in zip(('doll_2', 'doll_3'), roots, strict=True):
        assert row(node, doll) == pytest.approx(before, abs=1e-9)
    node.states.on_joint_state(JointState(name=names, velocity=[1.0, 1.0]))
    assert angles(node)[names[0]] == pytest.approx(0.5, abs=1e-9)
    assert not node.input_counts.refused


@pytest.mark.parametrize(('fields', 'text'), [
    ({'name': ['left_shin'], 'position': [0.1]}, "'left_shin'; expected one of"),
    ({'name': ['doll_3/left_shin'] * 2, 'position': [0.1, 0.2]}, 'different names'),
    ({'name': ['doll_3/left_shin'], 'position': [0.1, 0.2]}, 'as many as names'),
    ({'name': ['doll_3/left_shin'], 'velocity': [math.nan]}, 'joint_rates'),
    ({'name': ['doll_2/left_shin', 'doll_3/left_shin'], 'position': [0.1, 9.0]}, 'its limits')])
def test_wrong_joint_states_are_refused_and_change_nothing(node, fields, text):
    before = node.simulation.state.rows.tobytes()
    node.states.on_joint_state(JointState(**fields))
    assert node.input_counts.refused == {'~/set_joint_states': 1}
    assert text in node.input_counts.last_reason
    assert node.simulation.state.rows.tobytes() == before


def test_the_line_of_joints_in_the_reference_is_understood(make_node):
    text = (Path(__file__).parent.parent / 'docs/reference.md').read_text()
    block = re.search(r"pub --once /ragdoll/set_joint_states (\S+) \\\s+'([^']*)'", text)
    assert block[1] == 'sensor_msgs/msg/JointState'
    message, node = JointState(), make_node()
    fill(message, yaml.safe_load(block[2]))
    node.states.on_joint_state(message)
    assert not node.input_counts.refused and angles(node)['left_shin'] == pytest.approx(1.2)

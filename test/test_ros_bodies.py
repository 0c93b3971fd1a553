"""Topics of driven bodies: Odometry and Twist move them, and what is wrong is refused."""
from __future__ import annotations

import json
import math

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from std_msgs.msg import String
from test_ros_set_state import odometry

from ragdoll_ros.files.run_scene import run_scene_text
from ragdoll_ros.physics.logged_simulation import state_digest
from ragdoll_ros.ros.inputs.bodies.body_subscriptions import body_topic

HALF = math.sqrt(0.5)
SCENE = """ground: {}
dolls: [{doll: doll, position: [0, 0, 0.05]}]
bodies:
  - {name: my robot, shape: {box: {size: [0.5, 0.4, 0.3]}}, position: [-2, 0, 0.16], follow: exact}
"""


@pytest.fixture
def node(make_node, tmp_path):
    path = tmp_path / 'robot.yaml'
    path.write_text(SCENE)
    made = make_node(scene=str(path), start_paused=True)
    return made


def robot(node):
    """Pose and velocities (13,) of the body."""
    return node.simulation.state.rows[-1]


def test_odometry_moves_a_body_along_its_own_axes(node):
    """A quarter turn about z: forward of the body is y of the world. Frames have any names."""
    node.bodies.on_odometry('my robot', odometry(
        'base_link', 'odom', (-2, 1, 0.16), (0, 0, HALF, HALF), (0.5, 0, 0), (0, 0, 1)))
    assert robot(node)[:3] == pytest.approx((-2, 1, 0.16)), 'the first pose may be anywhere'
    node.tick()
    node.tick()
    assert robot(node)[:3] == pytest.approx((-2, 1.01, 0.16), abs=1e-9)
    assert robot(node)[7:] == pytest.approx((0, 0.5, 0, 0, 0, 1), abs=1e-9)
    node.bodies.on_cmd_vel('my robot', Twist(linear=Vector3(x=1.0)))
    node.tick()
    # It has turned by 0.02 rad.
    assert robot(node)[7:9] == pytest.approx((-math.sin(0.02), math.cos(0.02)), abs=1e-9)
    for _ in range(25):
        node.tick()
    assert not robot(node)[7:].any()
    assert node.simulation.stale_bodies == ('my robot',)
    node.pause(False)
    node._diagnostics._on_timer()
    level, message = node._diagnostics._level_and_message()
    assert level == DiagnosticStatus.WARN and 'nothing moves my robot' in message
    node.bodies.on_cmd_vel('my robot', Twist(linear=Vector3(x=1.0)))
    node.tick()
    assert 'nothing moves' not in node._diagnostics._level_and_message()[1]
    assert not node.input_counts.refused


@pytest.mark.parametrize('wrong, text', [
    ({'position': (0, math.nan, 0)}, 'pose'), ({'orientation': (0, 0, 0, 0)}, 'pose.orientation'),
    ({'linear': (0, math.inf, 0)}, 'twist.linear'), ({'position': (1e7, 0, 0)}, 'pose')])
def test_what_is_wrong_is_refused_and_counted(node, wrong, text):
    before = robot(node).tobytes()
    node.bodies.on_odometry('my robot', odometry(**wrong))
    assert node.input_counts.refused == {'~/bodies/my_robot/odom': 1}
    assert text in node.input_counts.last_reason
    node.tick()
    assert robot(node).tobytes() == before


def test_it_comes_over_the_topics_and_the_events_repeat_it(node, peer):
    """Real DDS; the run is repeated from ~/events to the bit."""
    from ragdoll_ros.physics.logged_simulation import apply_event
    from ragdoll_ros.physics.simulation import Simulation
    peer.executor_.add_node(node)
    heard = peer.collect(String, '/ragdoll/events')
    odom = peer.sender(Odometry, '/ragdoll/bodies/my_robot/odom')
    cmd_vel = peer.sender(Twist, '/ragdoll/bodies/my_robot/cmd_vel')

    def events():
        told = (json.loads(message.data) for _, message in heard)
        return [each for each in told if each['kind'] == 'drive_body']

    odom.publish(odometry(position=(-2, 0, 0.16), linear=(2, 0, 0)))
    peer.wait(lambda: len(events()) == 1)
    for _ in range(10):
        node.tick()
    cmd_vel.publish(Twist(linear=Vector3(x=3.0)))
    peer.wait(lambda: len(events()) == 2)
    for _ in range(10):
        node.tick()
    assert robot(node)[0] == pytest.approx(-2 + 0.2 + 0.3, abs=1e-9)
    with Simulation(node.simulation.scene) as simulation:
        for event in events():
            while simulation.time < event['tick'] * simulation.tick:
                simulation.advance()
            apply_event(simulation, 'drive_body', {
                key: event[key] for key in ('name', 'pose', 'twist')})
        while simulation.time < node.simulation.time:
            simulation.advance()
        assert state_digest(simulation.state) == state_digest(node.simulation.state)
    assert 'follow: exact' in run_scene_text(node.simulation.scene)


def test_topics_are_those_of_the_scene(node, peer):
    def topics():
        return {name for name, _ in node.get_subscriber_names_and_types_by_node('ragdoll', '/')
                if '/bodies/' in name}

    assert topics() == {'/ragdoll/bodies/my_robot/odom', '/ragdoll/bodies/my_robot/cmd_vel'}
    from rclpy.parameter import Parameter
    node.set_parameters([Parameter('scene', value='drop')])
    peer.wait(lambda: not topics())


@pytest.mark.parametrize('name, topic', [
    ('robot', '~/bodies/robot'), ('2nd arm-left', '~/bodies/_2nd_arm_left'), ('é', '~/bodies/_')])
def test_a_topic_has_no_letters_that_ros_forbids(name, topic):
    assert body_topic(name) == topic

"""Topics of robots of several links: JointState moves the joints, Odometry and Twist the frame."""
from __future__ import annotations

import json
import math

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, Twist, Vector3
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from test_robot_motion import PLANAR, tip, yaw
from test_ros_set_state import odometry

from ragdoll_ros import Simulation, load_scene
from ragdoll_ros.fit.command import main as fit_main
from ragdoll_ros.physics.logged_simulation import apply_event, state_digest
from ragdoll_ros.ros.node import RagdollNode

SCENE = """ground: {}
dolls: [{doll: doll, position: [0, 0, 0.05]}]
bodies:
  - {name: my arm, urdf: r.urdf, position: [-2, 0, 0.3], follow: exact}
"""
TOPIC = '/ragdoll/bodies/my_arm/joint_states'


@pytest.fixture
def path(tmp_path):
    (tmp_path / 'r.urdf').write_text(PLANAR)
    (tmp_path / 'robot.yaml').write_text(SCENE)
    return str(tmp_path / 'robot.yaml')


@pytest.fixture
def node(make_node, path):
    return make_node(scene=path, start_paused=True)


def joints(names=('shoulder', 'elbow'), position=(), velocity=()):
    return JointState(name=list(names), position=list(map(float, position)),
                      velocity=list(map(float, velocity)))


def links(node):
    """Rows (2, 13) of the two links."""
    return node.simulation.state.rows[-2:]


def test_joint_states_move_an_arm_and_the_events_repeat_it(node, peer):
    """Real DDS, at the rate of the ticks, with a moving frame; the run is repeated to the bit."""
    peer.executor_.add_node(node)
    heard = peer.collect(String, '/ragdoll/events')
    states = peer.sender(JointState, TOPIC)
    cmd_vel = peer.sender(Twist, '/ragdoll/bodies/my_arm/cmd_vel')

    def events():
        told = (json.loads(message.data) for _, message in heard)
        return [each for each in told if each['kind'] == 'drive_body']

    cmd_vel.publish(Twist(linear=Vector3(x=0.5)))
    peer.wait(lambda: len(events()) == 1)
    for tick in range(15):
        states.publish(joints(position=(0.02 * tick, -0.01 * tick), velocity=(2, -1)))
        peer.wait(lambda count=tick + 2: len(events()) == count)
        node.tick()
    (x, y), turn = tip(0.3, -0.15)
    upper, lower = links(node)
    assert upper[:3] == pytest.approx((-2 + 0.5 * 0.15, 0, 0.3), abs=1e-9)
    assert lower[:3] == pytest.approx((-2 + 0.5 * 0.15 + x, y, 0.3), abs=1e-9)
    assert (yaw(upper), yaw(lower)) == pytest.approx((0.3, turn), abs=1e-9)
    assert not node.input_counts.refused and node.simulation.stale_bodies == ()
    with Simulation(node.simulation.scene) as simulation:
        for event in events():
            while simulation.time < event['tick'] * simulation.tick:
                simulation.advance()
            apply_event(simulation, 'drive_body', {
                key: value for key, value in event.items() if key not in (
                    'number', 'tick', 'kind')})
        while simulation.time < node.simulation.time:
            simulation.advance()
        assert state_digest(simulation.state) == state_digest(node.simulation.state)


def test_odometry_is_that_of_the_root_link(node):
    """A quarter turn about z; then the arm drives forward, which is y of the world."""
    half = math.sqrt(0.5)
    node.bodies.on_odometry('my arm', odometry(
        'base_link', 'odom', (-2, 1, 0.3), (0, 0, half, half)))
    assert node.simulation.body_pose('my arm') == pytest.approx((-2, 1, 0.3, 0, 0, half, half))
    node.bodies.on_joint_states('my arm', joints(['shoulder'], velocity=[1.0]))
    node.bodies.on_cmd_vel('my arm', Twist(linear=Vector3(x=1.0)))
    for _ in range(10):
        node.tick()
    upper, _ = links(node)
    assert upper[:3] == pytest.approx((-2, 1.1, 0.3), abs=1e-9)
    assert yaw(upper) == pytest.approx(math.pi / 2 + 0.1, abs=1e-9)


@pytest.mark.parametrize('wrong, text', [
    (joints(position=(0, math.nan)), 'joint_angles.elbow: NotFinite'),
    (joints(velocity=(math.inf, 0)), 'rates.shoulder: NotFinite'),
    (joints(['knee', 'hip'], (0, 0)), 'joint_angles.knee: UnknownJoint'),
    (joints(position=[0.0]), 'position: WrongForm'),
    (joints(['elbow', 'elbow'], (0, 0)), 'name: WrongForm')])
def test_what_is_wrong_is_refused_and_counted(node, wrong, text):
    before = links(node).copy()
    node.bodies.on_joint_states('my arm', wrong)
    assert node.input_counts.refused == {'~/bodies/my_arm/joint_states': 1}
    assert text in node.input_counts.last_reason
    node.tick()
    assert np.array_equal(links(node), before)


def test_a_topic_that_stops_or_jumps_is_reported(node):
    for rate in (10, 1, 20):
        for tick in range(20):
            # 1 kHz, then 100 Hz, then 5 Hz.
            for _ in range(rate if rate == 10 else tick % rate == 0):
                node.bodies.on_joint_states('my arm', joints(
                    position=(0.01 * tick, 0), velocity=(1, 0)))
            node.tick()
            assert yaw(links(node)[0]) == pytest.approx(0.01 * (tick + 1), abs=1e-9)
        # The next round begins 0.2 rad behind, farther than 10 m/s take its tip in a tick: a jump.
    measures = node.simulation.measures()
    assert (measures['body_jumps_total'], measures['stale_bodies']) == (2, 1)
    node.pause(False)
    node._diagnostics._on_timer()
    said = node._diagnostics._level_and_message()[1]
    assert ('nothing moves my arm: /ragdoll/bodies/my_arm/joint_states, '
            '/ragdoll/bodies/my_arm/odom, /ragdoll/bodies/my_arm/cmd_vel are silent') in said
    node.bodies.on_joint_states('my arm', joints(velocity=(1, 0)))
    node.tick()
    assert 'nothing moves' not in node._diagnostics._level_and_message()[1]
    assert not node.input_counts.refused


def test_joints_that_the_robot_has_not_are_left_out_beside_others(node, capfd):
    for _ in range(2):
        node.bodies.on_joint_states('my arm', joints(
            ['finger', 'shoulder'], position=(0.5, 0.02), velocity=(3, 2)))
        node.tick()
    assert yaw(links(node)[0]) == pytest.approx(0.04, abs=1e-9)
    assert not node.input_counts.refused
    assert capfd.readouterr().err.count('my arm has no joint finger: left out') == 1


@pytest.mark.parametrize('has_rates', [True, False])
@pytest.mark.parametrize('rate, delay, noise', [
    (50, 0.0, 0.0), (50, 0.0095, 0.001), (50, 0.02, 0.004), (125, 0.005, 0.001), (30, 0.0, 0.008)])
def test_late_messages_do_not_change_the_speed_of_a_link(make_node, path, rate, delay, noise,
                                                         has_rates):
    """A sweep of 2.5 rad/s whose messages come now before, now after a tick: without their stamps a
    link turns at 0 to twice that rate, and hits with it.
    """
    node = make_node(scene=path, start_paused=True, publish_clock=True)
    rng, amplitude, pulse = np.random.default_rng(3), 1.25, 2.0

    def sweep(t):
        return amplitude * math.sin(pulse * t), amplitude * pulse * math.cos(pulse * t)

    sent = [0.1 + k / rate for k in range(2 * rate)]
    waiting = sorted((t + delay + abs(rng.normal(0, noise)), t) for t in sent)
    off = []
    for tick in range(180):
        now = 0.01 * tick
        while waiting and waiting[0][0] <= now:
            _, t = waiting.pop(0)
            angle, speed = sweep(t)
            message = joints(['shoulder'], [angle], [speed] if has_rates else [])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(
                round(1e9 * t), 10 ** 9)
            node.bodies.on_joint_states('my arm', message)
        node.tick()
        if now > 0.3:
            off.append(links(node)[0][12] - sweep(now + 0.005)[1])
    # In the age of a message the rate changes by so much; and the angle, which is put right in a
    # tick. A rate that is taken from two angles is older.
    age = 1 / rate + delay + 3 * noise + 0.01
    bound = amplitude * pulse ** 2 * (age + age ** 2 / (2 * 0.01))
    assert np.abs(off).max() < bound * (1 if has_rates else 1.5) < amplitude * pulse


def test_topics_are_those_of_robots_and_not_of_their_links(node):
    found = {name for name, _ in node.get_subscriber_names_and_types_by_node('ragdoll', '/')
             if '/bodies/' in name}
    assert found == {f'/ragdoll/bodies/my_arm/{end}' for end in ('odom', 'cmd_vel', 'joint_states')}


def test_the_scene_of_a_run_is_equal(node, tmp_path):
    from ragdoll_ros.files.run_scene import read_run_scene, run_scene_text
    read, _ = read_run_scene(run_scene_text(node.simulation.scene))
    assert read == node.simulation.scene == load_scene(str(tmp_path / 'robot.yaml'))


GENTLE = """ground: null
gravity: [0, 0, 0]
material: {friction: 0, restitution: 0}
dolls:
  - {doll: doll, position: [0, 3, 0.05]}
  - {doll: arm.yaml, name: arm, position: [0, 0, 1], fixed_root: true,
     motors: {frequency: 1, max_torque: 3}}
bodies: [{name: pole, shape: {cylinder: {radius: 0.05, length: 1}}, position: [0.4, 0.2, 1]}]
"""


def test_joint_states_move_an_arm_that_gives_way(make_node, peer, tmp_path):
    """A fitted doll on a fixed root: its motors follow the robot's own joint names, other joints
    are left out, a pole stops it at the torque of the motor, and events repeat the run.
    """
    (tmp_path / 'r.urdf').write_text(PLANAR.replace('<link name="foot"/>', FOOT))
    assert fit_main([str(tmp_path / 'r.urdf'), '-o', str(tmp_path / 'arm.yaml')]) == 0
    (tmp_path / 'gentle.yaml').write_text(GENTLE)
    node = make_node(scene=str(tmp_path / 'gentle.yaml'), start_paused=True)
    peer.executor_.add_node(node)
    heard = peer.collect(String, '/ragdoll/events')
    states = peer.sender(JointState, '/ragdoll/bodies/arm/joint_states')
    states.publish(joints(('shoulder', 'elbow', 'finger'), (-0.4, 0.3, 0.1)))

    def targets():
        return {each.angle: each.target for each in node.simulation.holds}

    peer.wait(lambda: targets() == pytest.approx({'arm/shoulder': -0.4, 'arm/elbow': 0.3}))
    for _ in range(400):
        node.tick()
    assert node.simulation.joint_angles[-2:] == pytest.approx([-0.4, 0.3], abs=1e-3)
    assert node.bodies.silent == ('arm',), 'for 4 s'
    states.publish(joints(('shoulder', 'elbow'), (math.tau + 1.2, 0.0)))
    peer.wait(lambda: targets()['arm/shoulder'] == pytest.approx(1.2))
    assert node.bodies.silent == ()
    for _ in range(300):
        node.tick()
    contacts = node.simulation.contacts
    # The arm, 0.02 m thick, leans on the pole; the lever is that of the contact's normal.
    lever = np.cross(contacts.positions - (0, 0, 1), contacts.normals)[:, 2]
    assert abs((contacts.forces * lever).sum()) == pytest.approx(3, rel=1e-2)
    assert not node.input_counts.refused
    def told():
        events = (json.loads(message.data) for _, message in heard)
        return [event for event in events if event['kind'] == 'set_pose_target']

    peer.wait(lambda: len(told()) == 2)
    with Simulation(load_scene(str(tmp_path / 'gentle.yaml'))) as again:
        for event in told():
            while again.time < event['tick'] * again.tick:
                again.advance()
            apply_event(again, event['kind'], {
                key: event[key] for key in event.keys() - {'number', 'tick', 'kind'}})
        while again.time < node.simulation.time:
            again.advance()
        assert state_digest(again.state) == state_digest(node.simulation.state)


ALONE = """gravity: [0, 0, -9.8]
dolls:
  - {doll: arm.yaml, name: arm, fixed_root: true, orientation: [0.7071068, 0, 0, 0.7071068],
     motors: {frequency: 1, max_torque: 3}}
"""


@pytest.mark.parametrize(('topic', 'moved'), [
    ('set_joint_states', 'all dolls'), ('pose_target', 'all motors'),
    ('joint_strengths', 'all motors')])
def test_joints_do_not_follow_the_nodes_own_joint_states(ros, peer, capfd, topic, moved):
    node = RagdollNode(cli_args=['--ros-args', '-r', f'~/{topic}:=joint_states'],
                       parameter_overrides=[Parameter('scene', value='drop'),
                                            Parameter('start_paused', value=True)])
    try:
        assert f'not published, as /joint_states moves {moved}: give' in capfd.readouterr().err
        poses, heard = (peer.collect(kind, name) for kind, name in (
            (PoseArray, 'ragdoll/poses'), (JointState, 'joint_states')))
        peer.wait(lambda: node.count_subscribers('joint_states') > 1)
        before = len(poses)
        for _ in range(3):
            node.tick()
        peer.wait(lambda: len(poses) >= before + 3)
        assert not heard and not node.input_counts.refused
    finally:
        node.destroy_node()


def test_an_arm_on_the_topic_of_joint_states_does_not_follow_itself(ros, peer, tmp_path, capfd):
    """Remapped to /joint_states, where the node's own would be: of a scene of one doll they have
    the arm's names. The node says so, and which joints a wrong message should have named.
    """
    (tmp_path / 'r.urdf').write_text(PLANAR.replace('<link name="foot"/>', FOOT))
    assert fit_main([str(tmp_path / 'r.urdf'), '-o', str(tmp_path / 'arm.yaml')]) == 0
    (tmp_path / 'alone.yaml').write_text(ALONE)
    node = RagdollNode(
        cli_args=['--ros-args', '-r', '~/bodies/arm/joint_states:=/joint_states'],
        parameter_overrides=[Parameter('scene', value=str(tmp_path / 'alone.yaml')),
                             Parameter('start_paused', value=True)])
    try:
        said = capfd.readouterr().err
        assert 'arm moved by /joint_states,' in said
        assert 'joint_states are not published, as /joint_states moves arm' in said
        peer.executor_.add_node(node)
        heard = peer.collect(JointState, '/joint_states')
        states = peer.sender(JointState, '/joint_states')
        states.publish(joints(position=(-0.4, 0.3)))

        def targets():
            return {each.angle: each.target for each in node.simulation.holds}

        peer.wait(lambda: targets() == pytest.approx({'shoulder': -0.4, 'elbow': 0.3}))
        for _ in range(20):
            node.tick()
        states.publish(joints(('x', 'y'), (1, 2)))
        peer.wait(lambda: node.input_counts.refused)
        peer.wait(lambda: len(heard) > 1)
        assert {tuple(message.name) for _, message in heard} == {('shoulder', 'elbow'), ('x', 'y')}
        assert targets() == pytest.approx({'shoulder': -0.4, 'elbow': 0.3})
        assert node.input_counts.last_reason.endswith("'x'; expected one of shoulder, elbow")
    finally:
        node.destroy_node()


FOOT = """<link name="foot"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
</link>"""

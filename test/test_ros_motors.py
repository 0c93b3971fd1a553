"""~/pose_target and strengths of motors of a node, and ~/go_limp of a doll with motors."""
from __future__ import annotations

import math

import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

SCENE = """ground: {}
dolls: [{doll: doll, position: [0, 0, 2], motors: {frequency: 10}}]
"""


@pytest.fixture
def node(make_node, tmp_path):
    path = tmp_path / 'held.yaml'
    path.write_text(SCENE)
    return make_node(scene=str(path), start_paused=True)


def angle(node, name):
    simulation = node.simulation
    return simulation.joint_angles[simulation.scene.angle_names.index(name)]


def test_targets_and_strength_come_over_their_topics(node, peer):
    """Real DDS: a shin bends to its target in the air; without strength it stays where it is."""
    peer.executor_.add_node(node)
    target = peer.sender(JointState, '/ragdoll/pose_target')
    strength = peer.sender(Float64, '/ragdoll/motor_strength')

    def spring(name):
        return next(each for each in node.simulation.holds if each.angle == name)

    target.publish(JointState(name=['left_shin', 'right_shin'], position=[0.8, 0.4]))
    peer.wait(lambda: spring('left_shin').target == 0.8)
    for _ in range(30):
        node.tick()
    assert angle(node, 'left_shin') == pytest.approx(0.8, abs=0.02)
    assert angle(node, 'right_shin') == pytest.approx(0.4, abs=0.02)
    strength.publish(Float64(data=0.25))
    peer.wait(lambda: spring('left_shin').strength == 0.25)
    strengths = peer.sender(JointState, '/ragdoll/joint_strengths')
    strengths.publish(JointState(name=['left_thigh', 'head_1'], effort=[0.5, 0.0]))
    peer.wait(lambda: spring('head_1').strength == 0.0)
    assert {each.angle: each.strength for each in node.simulation.holds
            if each.strength != 0.25} == {'left_thigh_1': 0.5, 'left_thigh_2': 0.5, 'head_1': 0.0}
    target.publish(JointState(name=['left_shin'], velocity=[1.0]))
    peer.wait(lambda: node.simulation.holds and spring('left_shin').target == 0.8)
    assert not node.input_counts.refused


def test_a_target_with_a_rate_moves_on(node):
    node.motors.on_pose_target(JointState(name=['left_shin'], velocity=[1.0]))
    for _ in range(40):
        node.tick()
    target = next(each for each in node.simulation.holds if each.angle == 'left_shin').target
    assert target == pytest.approx(0.2, abs=1e-9), 'for a fifth of a second'


@pytest.mark.parametrize('wrong, text', [
    (JointState(name=['nose'], position=[1.0]), 'nose'),
    (JointState(name=['left_shin'], position=[math.nan]), 'left_shin'),
    (JointState(name=['left_shin'], position=[1.0, 2.0]), 'position'),
    (JointState(name=['left_shin', 'left_shin'], position=[1.0, 2.0]), 'name'),
    (JointState(name=['left_shin', 'nose'], position=[1.0, 2.0]), 'nose')])
def test_a_wrong_target_is_refused_and_counted(node, wrong, text):
    before = node.simulation.holds
    node.motors.on_pose_target(wrong)
    assert node.input_counts.refused == {'~/pose_target': 1}
    assert text in node.input_counts.last_reason and node.simulation.holds == before


@pytest.mark.parametrize('wrong', [-0.1, 1.1, math.nan])
def test_a_wrong_strength_is_refused_and_counted(node, wrong):
    node.motors.on_strength(Float64(data=wrong))
    assert node.input_counts.refused == {'~/motor_strength': 1}
    assert {each.strength for each in node.simulation.holds} == {1.0}


@pytest.mark.parametrize('wrong, text', [
    (JointState(name=['left_shin', 'nose'], effort=[0.5, 0.5]), 'nose'),
    (JointState(name=['left_shin', 'head'], effort=[0.5, 1.1]), 'strength'),
    (JointState(name=['left_shin', 'head'], effort=[0.5, math.nan]), 'strength'),
    (JointState(name=['left_shin', 'left_shin'], effort=[0.5, 0.5]), 'name'),
    (JointState(name=['left_shin'], position=[0.5]), 'effort')])
def test_wrong_strengths_of_joints_are_refused_and_counted(node, wrong, text):
    node.motors.on_joint_strengths(wrong)
    assert node.input_counts.refused == {'~/joint_strengths': 1}
    assert text in node.input_counts.last_reason
    assert {each.strength for each in node.simulation.holds} == {1.0}


def test_a_doll_with_motors_goes_limp(node, peer):
    peer.executor_.add_node(node)
    answer = peer.call(Trigger, 'ragdoll/go_limp', Trigger.Request())
    assert answer.success and 'doll limp at 0 s' in answer.message and not node.simulation.holds
    answer = peer.call(Trigger, 'ragdoll/go_limp', Trigger.Request())
    assert not answer.success and 'by motors' in answer.message


def test_without_motors_a_target_is_refused(make_node):
    node = make_node(start_paused=True)
    node.motors.on_pose_target(JointState(name=['left_shin'], position=[1.0]))
    assert 'an angle with a spring' in node.input_counts.last_reason
    node.unload_world()
    node.motors.on_pose_target(JointState(name=['left_shin'], position=[1.0]))
    node.motors.on_strength(Float64(data=0.5))
    node.motors.on_joint_strengths(JointState(name=['left_shin'], effort=[0.5]))
    assert 'no world is loaded' in node.input_counts.last_reason

"""Worn sensors of a node: what subscribers read, at which stamps, and what is refused."""
from __future__ import annotations

import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.errors import RagdollError
from ragdoll_ros.physics.sensors.imu import ImuMount, tick_samples
from ragdoll_ros.physics.sensors.response import ImuResponse, ResponseFilter
from ragdoll_ros.physics.simulation import Simulation

SCENE = {'scene': 'woman_faints', 'publish_clock': True}


def numbers(message):
    """Force and rate (6,), and the stamp in ns."""
    force, rate = message.linear_acceleration, message.angular_velocity
    stamp = message.header.stamp
    return [force.x, force.y, force.z, rate.x, rate.y, rate.z], (
        stamp.sec * 1_000_000_000 + stamp.nanosec)


def heard(node, peer, ticks, bone='head'):
    """Samples (t, 6), stamps and the first message of so many ticks from the start."""
    topic = f'/ragdoll/imu/{bone}/data_raw'
    node.pause(True)
    got = peer.collect(Imu, topic, 100)
    peer.wait_heard(node, topic)
    node.reset()
    for _ in range(ticks):
        node.tick()
    peer.wait(lambda: len(got) >= ticks * node.simulation.samples_per_tick)
    read, stamps = zip(*(numbers(message) for _, message in got), strict=True)
    return np.array(read), stamps, got[0][1]


def test_samples_are_those_of_the_library(make_node, peer):
    node = make_node(**SCENE, imus=['head 0.1 0 0.05 0 0 1.5'], imu_rate=1000.0)
    rigid = heard(node, peer, 5)
    node.set_parameters_atomically([
        Parameter('imu_mount_frequency', value=25.0), Parameter('imu_mount_damping', value=0.2),
        Parameter('imu_bandwidth', value=100.0)])
    soft, again = heard(node, peer, 5)[0], heard(node, peer, 5)[0]
    assert (soft == again).all(), 'a reset starts the mount again'
    assert np.abs(soft - rigid[0]).max() > 1e-3
    for (read, stamps, first), response in ((rigid, ImuResponse()),
                                            ((soft, *rigid[1:]), ImuResponse(25.0, 0.2, 100.0))):
        check_samples(read, stamps, first, ResponseFilter(response))


def check_samples(read, stamps, first, response):
    """What the library computes of the same five ticks, at 1 kHz."""
    scene = load_scene('woman_faints')
    mount = ImuMount('head', (0.1, 0, 0.05), (0, 0, np.sin(0.75), np.cos(0.75)))
    expected = []
    with Simulation(scene) as simulation:
        simulation.samples_per_tick = 10
        for _ in range(5):
            simulation.advance()
            expected.append(tick_samples(simulation.substates, scene.bone_index('head'), mount,
                                         simulation.step, scene.gravity, response))
    assert np.abs(read - np.concatenate(expected)).max() < 1e-12
    assert stamps == tuple(1_000_000 * number for number in range(1, 51))
    assert first.header.frame_id == 'head_imu'
    # REP 145: -1, not measured; 0, unknown.
    assert first.orientation_covariance[0] == -1
    assert not first.linear_acceleration_covariance.any()


def test_flaws_are_added_and_told(make_node, peer):
    node = make_node(**SCENE, imus=['head'])
    true, _, _ = heard(node, peer, 20)
    node.set_parameters_atomically([
        Parameter('imu_noise_acceleration', value=0.5),
        Parameter('imu_bias', value=[1.0, 0.0, 0.0, 0.0, 0.0, 2.0]),
        Parameter('imu_range', value=[0.0, 1.5])])
    noisy, _, first = heard(node, peer, 20)
    again, _, _ = heard(node, peer, 20)
    assert (noisy == again).all(), 'the same seed, the same noise'
    noise = noisy[:, :3] - true[:, :3] - (1, 0, 0)
    # 60 values: their deviation is known to 9 %.
    assert noise.std() == pytest.approx(0.5, rel=0.3)
    assert noisy[:, 5] == pytest.approx(1.5), 'clipped'
    assert list(first.linear_acceleration_covariance) == [0.25, 0, 0, 0, 0.25, 0, 0, 0, 0.25]


def test_sensors_are_put_on_and_off_live(make_node, peer):
    node = make_node(**SCENE)
    topics = {name for name, _ in node.get_publisher_names_and_types_by_node('ragdoll', '/')}
    assert not any('/imu/' in topic for topic in topics)
    done = node.set_parameters_atomically([
        Parameter('imus', value=['pelvis', 'left_forearm']), Parameter('imu_rate', value=200.0)])
    assert done.successful and node.simulation.samples_per_tick == 2
    assert len(heard(node, peer, 3, 'left_forearm')[0]) == 6
    node.set_parameters_atomically([Parameter('imus', value=[''])])
    assert node.simulation.samples_per_tick == 1
    assert not [p for p in node.publishers if '/imu/' in p.topic_name]


@pytest.mark.parametrize(('given', 'words'), [
    ({'imus': ['nose']}, "imus: UnknownBone: 'nose'"),
    ({'imus': ['head 1 2']}, "imus: UnknownBone: 'head 1 2'"),
    ({'imus': ['head 1 2 x']}, 'x y z roll pitch yaw'),
    ({'imus': ['head nan 0 0']}, 'NotFinite'),
    ({'imus': ['head', 'head 0 0 1']}, 'one sensor on a bone'),
    ({'imus': ['head'], 'imu_rate': 150.0}, 'imu_rate: OutOfRange: 150.0; expected a multiple'),
    ({'imus': ['head'], 'imu_rate': 50.0}, 'a multiple of rate, 100'),
    ({'imu_bias': [1.0, 2.0]}, 'imu_bias: WrongForm'),
    ({'imu_range': [-1.0, 0.0]}, 'imu_range: OutOfRange')])
def test_what_can_not_be_worn_is_refused_with_a_reason(make_node, given, words):
    with pytest.raises(RagdollError, match=words):
        make_node(scene='woman_faints', **given)
    node = make_node(scene='woman_faints')
    done = node.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in given.items()])
    assert not done.successful and words in done.reason

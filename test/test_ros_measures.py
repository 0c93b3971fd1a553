"""~/measures: its bytes are those of rclpy, and what it says of a tick is the simulation's."""
from __future__ import annotations

import re
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import String

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.messages.convert import to_time
from ragdoll_ros.ros.messages.measures import (
    TickMeasures,
    checksum,
    deserialize_measures,
    serialize_measures,
)
from ragdoll_ros.ros.teleop.status_line import StatusLine

MEASURES = TickMeasures(12_030_000_000, 1_764_000_000_123_456_789, 'deadbeef', 'cafe0123', -503.125,
                        1e-9, 0.0)


@pytest.mark.parametrize('name', ['', '/ragdoll', '/a/b', '/a/bc', '/left/ragdoll'])
def test_the_bytes_are_those_of_rclpy(name):
    stamp = 1_764_000_001_000_000_007
    values = {'run': '1764000000123456789', 'urdf_crc32': 'deadbeef', 'scene_crc32': 'cafe0123',
              'simulated_time': '12.030000000', 'energy_excess_J': '-503.125',
              'work_of_pushes_J': '1e-09', 'work_of_grabs_J': '0'}
    message = DiagnosticArray(status=[DiagnosticStatus(
        level=DiagnosticStatus.OK, name=name,
        values=[KeyValue(key=key, value=value) for key, value in values.items()])])
    message.header.stamp = to_time(stamp)
    data = serialize_measures(name, stamp, MEASURES)
    assert deserialize_message(data, DiagnosticArray) == message
    assert deserialize_measures(serialize_message(message)) == (stamp, MEASURES)
    assert deserialize_measures(data) == (stamp, MEASURES)


def test_bytes_that_are_no_measures_are_a_value_error():
    data = serialize_measures('/ragdoll', 7, MEASURES)
    for wrong in (b'', b'\0\1\0\0', data[:40], data[:-9], b'\0\0' + data[2:],
                  serialize_message(DiagnosticArray())):
        with pytest.raises(ValueError):
            deserialize_measures(wrong)


def test_time_and_energy_of_each_tick_are_the_simulations(make_node, peer):
    """Of the poses with the same stamp; a reset is another run."""
    got, poses = peer.collect(DiagnosticArray, 'ragdoll/measures'), peer.collect(
        PoseArray, 'ragdoll/poses')
    urdf, scene = (peer.collect(String, topic) for topic in ('robot_description', 'ragdoll/scene'))
    node = make_node(start_paused=True)
    peer.executor_.add_node(node)
    for topic in ('/ragdoll/measures', '/ragdoll/poses', '/robot_description'):
        peer.wait_heard(node, topic)

    def read(message):
        return deserialize_measures(serialize_message(message))

    for tick in range(1, 6):
        node.tick()
        peer.wait(lambda tick=tick: got and read(got[-1][1])[1].time == tick * 10_000_000)
    node.reset()
    peer.wait(lambda: read(got[-1][1])[1].time == 0)
    found = [read(message) for _, message in got]
    peer.wait(lambda: poses and poses[-1][1].header.stamp == got[-1][1].header.stamp)
    places = {message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec: message.poses[0]
              for _, message in poses}
    assert {measures.urdf for _, measures in found} == {checksum(urdf[-1][1].data)}
    assert {measures.scene for _, measures in found} == {checksum(scene[-1][1].data)}
    assert [measures.run for _, measures in found[-6:-1]] == [found[-2][1].run] * 5
    assert found[-1][1].run > found[-2][1].run
    with Simulation(load_scene('drop')) as simulation:
        for stamp, measures in found[-6:-1]:
            height = simulation.advance().positions[0, 2]
            assert simulation.time == measures.time
            assert places[stamp].position.z == height
            assert measures.energy_excess == pytest.approx(simulation.energy_excess, abs=1e-6)


def test_the_work_of_a_push_is_told(make_node, peer):
    node = make_node(start_paused=True)
    got = peer.collect(DiagnosticArray, 'ragdoll/measures')
    peer.executor_.add_node(node)
    peer.wait_heard(node, '/ragdoll/measures')
    sender = peer.sender(Wrench, 'ragdoll/force')
    peer.wait(lambda: sender.get_subscription_count())
    sender.publish(Wrench(force=Vector3(y=500.0)))
    peer.wait(lambda: node.simulation.pushes)
    node.tick()
    node.tick()
    peer.wait(lambda: got and deserialize_measures(
        serialize_message(got[-1][1]))[1].time == node.simulation.time)
    measures = deserialize_measures(serialize_message(got[-1][1]))[1]
    assert measures.work_of_pushes == pytest.approx(
        node.simulation.measures()['work_of_pushes_J']) and measures.work_of_pushes > 0.1
    assert measures.work_of_grabs == 0


def test_the_status_line_of_the_teleop_counts_no_pause(make_node, peer):
    """A second on the wall is none on the line, also before the next report."""
    node = make_node()
    line = StatusLine(peer, '/ragdoll')
    peer.executor_.add_node(node)

    def shown():
        found = re.search(r'  (\d+\.\d) s  ', line.text())
        return float(found[1]) if found else -1.0

    def is_true():
        return abs(shown() - node.simulation.time / 1e9) < 0.1

    peer.wait(lambda: shown() > 0.2 and is_true())
    node.pause(True)
    until = time.monotonic() + 1.5
    peer.wait(lambda: time.monotonic() > until)
    before = node.simulation.time
    node.pause(False)
    peer.wait(lambda: node.simulation.time > before + 50_000_000)
    assert is_true()

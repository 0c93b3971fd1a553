"""Dolls that come and go while the node runs: what it publishes and logs follows."""
from __future__ import annotations

import json

from bags import write_bag
from geometry_msgs.msg import PoseArray, Wrench
from recorder import PAST
from std_msgs.msg import String

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.run_scene import read_run_scene
from ragdoll_ros.model.scene import Placement
from ragdoll_ros.replay.command import main
from ragdoll_ros.ros.event_log import HASH_INTERVAL
from ragdoll_ros.ros.latched_topic import LATCHED

EVENTS, SCENE = '/ragdoll/events', '/ragdoll/scene'


def test_topics_parameters_and_the_log_follow(make_node, peer, tmp_path, capsys):
    """From one doll to two and to the other one; then the log repeats all of it to the bit."""
    node = make_node(scene='drop', imus=['head 0 0 0.1'], start_paused=True)
    peer.executor_.add_node(node)
    poses = peer.collect(PoseArray, '/ragdoll/poses', LATCHED)
    scenes, events = peer.collect(String, SCENE, PAST), peer.collect(String, EVENTS, PAST)
    peer.wait_heard(node, '/ragdoll/poses', SCENE, EVENTS)

    def values(*names):
        return [list(value) if isinstance(value, list | tuple) else value for value in (
            node.get_parameter(name).value for name in names)]

    def tick(count, force=0.0):
        for _ in range(count):
            wrench = Wrench()
            wrench.force.x = force
            node.inputs.on_force(wrench)
            node.tick()

    simulation = node.simulation
    # The topic keeps one scene: the next would take the place of one that is still on its way.
    peer.wait(lambda: len(scenes) == 1)
    tick(10, 50.0)
    man = Placement(load_doll('man'), 'man', (0, 3, 1))
    node.change_dolls(lambda simulation: simulation.prepare_add([man]))
    assert node.simulation is simulation and simulation.time == 10 * simulation.tick
    peer.wait(lambda: len(scenes) == 2 and len(poses[-1][1].poses) == 26)
    assert values('pushed_bone', 'imus') == ['doll/torso', ['doll/head 0 0 0.1']]
    assert tuple(*values('bone_names')) == simulation.scene.bone_names
    assert '/ragdoll/imu/doll/head/data_raw' in dict(node.get_topic_names_and_types())
    tick(HASH_INTERVAL, 20.0)
    node.change_dolls(lambda simulation: simulation.prepare_remove('doll'))
    peer.wait(lambda: len(scenes) == 3 and len(poses[-1][1].poses) == 16)
    assert values('pushed_bone', 'imus') == ['pelvis', ['']]
    tick(HASH_INTERVAL, 9.0)
    node.reset(keep_time=True)
    tick(HASH_INTERVAL)
    assert not node.input_counts.refused and node.recovery.count == 0
    stamps = [(each.header.stamp.sec, each.header.stamp.nanosec) for _, each in poses]
    assert stamps == sorted(stamps)

    def told():
        return [json.loads(message.data) for _, message in events]

    peer.wait(lambda: told() and told()[-1]['tick'] == 3 * HASH_INTERVAL)
    assert [each['kind'] for each in told() if each['kind'] in ('start', 'add', 'remove')] == [
        'start', 'add', 'remove']
    names = [[placement.name for placement in read_run_scene(message.data)[0].dolls]
             for _, message in scenes]
    assert names == [['doll'], ['doll', 'man'], ['man']]
    bag = write_bag(tmp_path / 'bag', [(topic, message.data) for topic, messages in (
        (SCENE, scenes), (EVENTS, events)) for _, message in messages])
    assert main([str(bag)]) == 0
    assert '4 of 4 hashes equal' in capsys.readouterr().out

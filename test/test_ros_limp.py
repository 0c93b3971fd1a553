"""~/go_limp of a node: the figure that walks falls from that instant on, and the log repeats it."""
from __future__ import annotations

import numpy as np
import pytest
from std_srvs.srv import Trigger
from test_ros_replay import EVENTS, SCENE, Log, replayed

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.logged_simulation import state_digest
from ragdoll_ros.physics.simulation import Simulation


def test_the_service_fells_who_walks(make_node, peer):
    # Paused, as at 2 s it goes limp by itself, before a busy machine has found the service.
    node = make_node(scene='walker_faints', start_paused=True)
    peer.executor_.add_node(node)
    for _ in range(25):
        node.tick()
    answer = peer.call(Trigger, 'ragdoll/go_limp', Trigger.Request())
    assert answer.success and 'walker limp at ' in answer.message
    assert node.simulation.animated == ()
    node.pause(False)
    peer.wait(lambda: node.simulation.state.positions[0, 2] < 0.5)
    answer = peer.call(Trigger, 'ragdoll/go_limp', Trigger.Request())
    assert not answer.success and 'no doll is moved by an animation' in answer.message
    assert node.input_counts.refused['~/go_limp'] == 1
    node.reset()
    assert node.simulation.animated == ('walker',)


def test_a_run_that_goes_limp_is_repeated_to_the_bit(make_node, peer, tmp_path, capsys):
    log = Log(peer)
    node = make_node(scene='walker_faints', start_paused=True)
    peer.executor_.add_node(node)
    peer.wait_heard(node, EVENTS, SCENE)
    for tick in range(400):
        if tick == 30:
            answer = peer.call(Trigger, 'ragdoll/go_limp', Trigger.Request())
            assert answer.success and answer.message.endswith('0.3 s')
        elif tick == 120:
            node.reset()
        node.tick()
    due = state_digest(node.simulation.state)
    peer.wait(lambda: len(log.of('state')) == 4)
    assert log.of('state')[-1]['sha256'] == due
    limp = [(event['tick'], event['time'], event['reason']) for event in log.of('limp')]
    # The second one within the tick that ends at 2 s, 200 after the reset.
    assert limp == [(30, 0.3, 'go_limp'), (319, 2.0, 'limp_at')]
    code, said, warned = replayed(capsys, log.write(tmp_path / 'bag'))
    assert (code, warned) == (0, '') and '400 ticks' in said and '5 of 5 hashes equal' in said


def test_the_shipped_figure_walks_without_sliding_and_falls():
    """A foot on the ground stands still, as the cycle of the file goes as fast as the doll."""
    scene = load_scene('walker_faints')
    feet = [scene.bone_names.index(f'J_Bip_{side}_Foot') for side in 'LR']
    with Simulation(scene) as simulation:
        rows = simulation.run(199)
        assert simulation.animated == ('walker',)
        slowest = np.abs(rows[:, feet, 7]).min(axis=1)
        fallen = simulation.run(300)[-1]
    # Of the centre of the foot, which rolls over its ball at the end.
    assert np.median(slowest) < 0.05 and slowest.max() < 0.3
    assert rows[-1, 0, 0] == pytest.approx(1.99, abs=0.1)
    assert fallen[:, 2].max() < 0.6

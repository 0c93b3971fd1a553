"""A node asleep that nobody listens to: fewer wakes, the same ticks, and awake at once."""
from __future__ import annotations

import statistics

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from peer import kill, start

from ragdoll_ros.ros.ticker import IDLE_TICKS
from ragdoll_ros.ros.tools.crowd_bench import cpu_loads, wait_asleep

TICK = 10_000_000


@pytest.fixture
def asleep(make_node, peer):
    """A node that sleeps, and an executor of the peer that makes it go."""
    node = make_node()
    while not node.simulation.asleep:
        node.tick()
    peer.executor_.add_node(node)
    return node


def ticks_for_a_wake(node, peer, ticks=60):
    """How many ticks the timer makes for each of its wakes, on the average of the next ones."""
    begun, woken = node.simulation.time, set()

    def done():
        woken.add(node.simulation.time)
        return node.simulation.time >= begun + ticks * node.simulation.tick

    peer.wait(done)
    return (node.simulation.time - begun) / node.simulation.tick / (len(woken) - 1)


def test_a_sleeper_that_nobody_hears_wakes_for_every_second_tick(asleep, peer):
    ticks_for_a_wake(asleep, peer)
    # A busy machine makes more of them at once, and so does one that does not doze.
    assert ticks_for_a_wake(asleep, peer) > 0.8 * IDLE_TICKS
    assert asleep.ticker._timer.timer_period_ns == IDLE_TICKS * TICK


def test_who_listens_hears_every_tick_on_time(asleep, peer):
    ticks_for_a_wake(asleep, peer)
    got = peer.collect(PoseArray, 'ragdoll/poses')
    peer.wait(lambda: len(got) > 100)
    stamps = [message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec
              for _, message in got]
    assert np.median(np.diff(stamps)) == TICK
    assert asleep.ticker._timer.timer_period_ns == TICK


def test_a_push_wakes_it(asleep, peer):
    ticks_for_a_wake(asleep, peer)
    asleep.inputs.on_force(Wrench(force=Vector3(z=2000.0)))
    peer.wait(lambda: asleep.simulation.state.linear_velocities[0, 2] > 1)
    assert asleep.ticker._timer.timer_period_ns == TICK


@pytest.mark.slow
def test_a_sleeper_costs_no_more_than_an_empty_timer_at_its_rate(ros, peer):
    """At most half a percent of a core above it, in the median of ten turns of 2 s."""
    processes = [start('tools.crowd_bench', 'empty'), start('node', compiled=True)]
    try:
        wait_asleep(peer, ['ragdoll'])
        timer, node = cpu_loads(processes)
        assert statistics.median(b - a for a, b in zip(timer, node, strict=True)) < 0.5
    finally:
        for process in processes:
            kill(process)

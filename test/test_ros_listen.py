"""The listener that counts, and the scenes that nodes of crowds are measured with."""
from __future__ import annotations

import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.ros.tools import crowd_bench
from ragdoll_ros.ros.tools.listen import SKIPPED, TopicStatistics


def test_a_line_tells_rate_size_and_the_time_between(make_node, peer):
    """Messages that come through DDS, their arrivals set to every 10 ms and one late by 10."""
    node = make_node()
    heard = TopicStatistics(peer, '/ragdoll/poses')
    peer.wait_heard(node, '/ragdoll/poses')
    assert heard.line() == '/ragdoll/poses: 0 messages'
    for count in range(1, SKIPPED + 102):
        node.tick()
        peer.wait(lambda count=count: len(heard.arrivals) == count)
    assert heard.bytes == (SKIPPED + 101) * (28 + 10 * 56)
    heard.arrivals[:] = [10_000_000 * k for k in range(SKIPPED + 101)]
    heard.arrivals[-1] += 10_000_000
    assert heard.line() == ('/ragdoll/poses: 99.0 messages/s of 588 bytes, 0.06 MB/s; between them '
                            'p50 10.00 ms, p99 10.10 ms, at the most 20.0 ms')


@pytest.mark.parametrize('place', [crowd_bench.LYING, crowd_bench.HIGH, crowd_bench.LOW])
@pytest.mark.parametrize('count', [1, 100])
def test_scenes_of_the_benchmark_are_scenes(tmp_path, count, place):
    argument = crowd_bench.node_arguments(tmp_path, count, place)[2]
    scene = load_scene(argument.removeprefix('scene:='))
    assert len(scene.dolls) == count and scene.step == crowd_bench.PERIOD

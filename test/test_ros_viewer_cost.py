"""What the page costs and what the node keeps meanwhile; `make bench` prints the figures."""
from __future__ import annotations

import threading
import time

import pytest

pytest.importorskip('viser')

from page_client import served, wait
from page_cost import bench, many_dolls, middle, one_doll, row

from ragdoll_ros.viewer.sources.node.source import NodeSource

pytestmark = pytest.mark.slow

NOISE = 0.15
"""By how much the costs of two equal processes may differ while others use the machine."""


@pytest.fixture(scope='module')
def stages(ros):
    """Listeners and cost of each stage of a viewer's life."""
    found = {}
    for label, listeners, cost in one_doll():
        print(row(label, cost))
        found[label] = listeners, cost
    return found


def test_ten_bones_at_60_hz_take_at_most_15_percent_of_a_core(stages):
    _, cost = stages['page open']
    assert cost.pages > 50 and cost.viewer < 0.15


def test_the_node_keeps_its_rate_while_it_is_watched(stages):
    assert stages['page open'][1].rate == pytest.approx(100, rel=0.01)


@pytest.mark.parametrize('label', ['viewer, no page', 'page closed', 'viewer ended'])
def test_without_a_page_the_node_costs_what_one_costs_that_nobody_ever_saw(stages, label):
    """A twin that runs beside it sees the same noise. No topic has a listener more."""
    before, (listeners, cost) = stages['no viewer'][0], stages[label]
    own = {'/rosout', '/parameter_events'}
    assert {topic: count for topic, count in listeners.items() if topic not in own} == {
        topic: count for topic, count in before.items() if topic not in own}
    assert cost.node < cost.twin * (1 + NOISE)
    # A viewer looks ten times a second whether anybody has opened the page.
    assert cost.viewer < 0.02


def test_five_hundred_bones_are_shown(ros):
    """Over ROS and the websocket; the node may be slower than real time, the page is not."""
    cost = many_dolls()
    print(row('500 bones', cost))
    assert cost.pages > 0.8 * min(60, cost.rate)
    assert cost.viewer < 0.3
    # Steady: not in bursts.
    assert cost.gaps[0] < 1.5 / cost.pages


def test_a_minute_of_scrubbing_costs_the_node_nothing(ros):
    """Twenty instants a second, as a hand drags: the node keeps its rate, and needs what it needs
    for a page that looks at it live. The viewer is in this process, with the page's other half.
    """
    with bench(1, twin=True) as node, served(NodeSource([])) as page:
        client = page.open()
        wait(lambda: page.timeline.clip is not None and page.timeline.clip.duration > 5)
        live = [node.measure() for _ in range(3)]
        stop = threading.Event()

        def scrub():
            count = 0
            while not stop.wait(0.05):
                count += 1
                client.steer(page, f'position {round(count * 0.07 % 5, 3)}')

        hand = threading.Thread(target=scrub)
        hand.start()
        wait(lambda: not page.timeline.is_live)
        begin, used = time.monotonic(), time.process_time()
        costs = [node.measure() for _ in range(6)]
        share = (time.process_time() - used) / (time.monotonic() - begin)
        stop.set()
        hand.join()
    print(*(row('live', cost) for cost in live), *(row('scrubbed', cost) for cost in costs), share,
          sep='\n')
    assert not page.timeline.is_live and share < 0.25
    assert sum(cost.rate for cost in costs) / 6 == pytest.approx(100, rel=0.01)
    scrubbed, live = middle(costs), middle(live)
    assert scrubbed.node / scrubbed.twin < live.node / live.twin * (1 + NOISE)

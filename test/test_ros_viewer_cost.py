"""What the page costs and what the node keeps meanwhile; `make bench` prints the figures."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
from page_cost import many_dolls, one_doll, row

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

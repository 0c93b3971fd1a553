"""A line that dies: the hand lets go in time, whether the page can say so or not."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
from network import Network
from page_client import PageClient, batch_of, served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer import pointer
from ragdoll_ros.viewer.sources.simulation import SimulationSource

PERIOD, PATIENCE = 0.1, 2.5
"""s between two questions, in place of half a second, and for an answer."""


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setattr(pointer, 'PING_PERIOD', PERIOD)
    monkeypatch.setattr(pointer, 'PING_TIMEOUT', PATIENCE)
    with served(SimulationSource(load_scene('drop'))) as page:
        yield page


@pytest.fixture
def network(page):
    network = Network(page.server.get_port())
    yield network
    network.close()


def holding(page, network):
    """A page behind the network whose pointer holds the head."""
    client = PageClient(network.port)
    page.clients.append(client)
    wait(lambda: page.frame and page.server.get_clients())
    node, number, place = batch_of(page, 'head')
    client.drag(node, 'start', place, place, number)
    wait(lambda: page.frame.grabs)
    return client


def test_a_pointer_that_rests_holds_on_and_a_line_that_goes_silent_lets_go(page, network):
    """As a laptop that is closed: its system says nothing, not even that the line is gone.

    Viser would take 20 s at the least. Other pages go on.
    """
    stays = page.open()
    holding(page, network)
    since = page.frame.time
    wait(lambda: page.frame.time > since + PERIOD + PATIENCE + 0.5)
    assert page.frame.grabs
    network.go_silent()
    wait(lambda: not page.frame.grabs, timeout=PERIOD + PATIENCE + 10)
    before, since = stays.windows, page.frame.time
    wait(lambda: stays.windows > before and page.frame.time > since)


def test_a_line_that_is_cut_lets_go_and_the_page_may_come_back(page, network):
    client = holding(page, network)
    network.cut()
    wait(lambda: not page.source.frame.grabs and not page.server.get_clients())
    client.close()
    network.come_back()
    holding(page, network)

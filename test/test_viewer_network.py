"""A line that dies: the hand lets go in time, whether the page can say so or not."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
from network import Network
from page_client import PageClient, wait
from test_viewer import DROP, batch_of, served

from ragdoll_ros.viewer.drawing.line import PATIENCE, PERIOD


@pytest.fixture
def page():
    with served(DROP) as page:
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
    wait(lambda: page._frame and page.server.get_clients())
    node, number, place = batch_of(page, 'head')
    client.drag(node, 'start', place, place, number)
    wait(lambda: page._frame.held)
    return client


def test_a_pointer_that_rests_holds_on_and_a_line_that_goes_silent_lets_go(page, network):
    """As a laptop that is closed: its system says nothing, not even that the line is gone.

    Viser would take 20 s at the least. Other pages go on.
    """
    stays = page.open()
    holding(page, network)
    since = page._frame.time
    wait(lambda: page._frame.time > since + PERIOD + PATIENCE + 0.5)
    assert page._frame.held
    network.go_silent()
    wait(lambda: not page._frame.held, timeout=PERIOD + PATIENCE + 10)
    before, since = stays.windows, page._frame.time
    wait(lambda: stays.windows > before and page._frame.time > since)


def test_a_line_that_is_cut_lets_go_and_the_page_may_come_back(page, network):
    client = holding(page, network)
    network.cut()
    wait(lambda: not page.source._simulation.grabs and not page.server.get_clients())
    client.close()
    network.come_back()
    holding(page, network)

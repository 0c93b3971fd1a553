"""The line to a page, which may die without a word: a laptop is closed, a network goes."""
from __future__ import annotations

import asyncio

import viser

PERIOD = 0.5
"""s from an answer to the next question."""

PATIENCE = 2.5
"""s that an answer may take: with PERIOD, as long as a node waits for a client that drags."""


async def is_dead(client: viser.ClientHandle) -> None:
    """Return once a page does not answer a ping, or has closed its line.

    A browser answers pings by itself, however busy the page is. Viser asks too, but gives a line
    up 20 to 40 s after its last word.
    """
    # Viser has no public way to a client's connection.
    connections = client._viser_server._websock_server._live_connections
    while (connection := connections.get(client.client_id)) is not None:
        answer = asyncio.ensure_future(_answer(connection))
        try:
            await asyncio.wait([answer], timeout=PATIENCE)
        finally:
            answer.cancel()
        if not answer.done() or answer.exception() is not None:
            return
        await asyncio.sleep(PERIOD)


async def _answer(connection: object) -> None:
    """Ping; websockets' ConnectionClosed if there is nobody."""
    await (await connection.ping())

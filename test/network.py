"""A network between a page and its viewer, that can be cut, go silent and come back."""
from __future__ import annotations

import asyncio
import threading

PATIENCE = 180.0


class Network:
    """Hands all connections to its own ``port`` on to ``target``, a port of this machine."""

    def __init__(self, target):
        self._target = target
        self._ends = []
        self._up = True
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), daemon=True)
        self._thread.start()
        assert self._ready.wait(PATIENCE)

    def cut(self):
        """Reset all connections, without a word of either side, and take no new ones."""
        self._run(self._cut())

    def go_silent(self):
        """Let nothing through any more, and tell nobody."""
        self._run(self._silence())

    def come_back(self):
        """Take connections again."""
        self._run(self._restore())

    def close(self):
        """End it."""
        self.cut()
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(PATIENCE)

    def _run(self, coroutine):
        asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(PATIENCE)

    async def _cut(self):
        self._up = False
        for writer in self._ends:
            writer.transport.abort()
        self._ends.clear()

    async def _silence(self):
        self._works.clear()

    async def _restore(self):
        self._up = True
        self._works.set()

    async def _serve(self):
        self._loop, self._ended, self._works = (asyncio.get_running_loop(), asyncio.Event(),
                                                asyncio.Event())
        self._works.set()
        server = await asyncio.start_server(self._connect, '127.0.0.1', 0)
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        await self._ended.wait()
        server.close()

    async def _connect(self, reader, writer):
        if not self._up:
            writer.transport.abort()
            return
        try:
            there, back = await asyncio.open_connection('127.0.0.1', self._target)
        except OSError:
            writer.transport.abort()
            return
        self._ends += [writer, back]
        await asyncio.gather(self._pass(reader, back), self._pass(there, writer))

    async def _pass(self, reader, writer):
        try:
            while data := await reader.read(65536):
                await self._works.wait()
                writer.write(data)
                await writer.drain()
            writer.close()
        except OSError:
            pass

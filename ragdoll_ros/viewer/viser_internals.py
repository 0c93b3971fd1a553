"""Every use of viser beyond its public interface, and the versions that it was tried with.

setup.py's extra `viewer` has the same range. Before it is widened, test_viewer_internals.py has to
pass with the new version: it checks that each name below exists there.
"""
from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
import viser
from viser import _messages
from viser.infra._async_message_buffer import AsyncMessageBuffer

VERSIONS = '>=1.1.1,<1.2'

CLIENT_NAMES = ('__viserMutable', 'sendMessage', 'scene', 'nodeRefFromName', 'camera',
                'cameraControl', 'requestRender', 'canvas', 'sendCamera',
                'GuiUpdateMessage', 'Uploading ')
"""What browser/*.js uses of viser's own client: its mutable state, a message, a notice's text."""

CLIENT_PACKAGES = {'@mantine/core': '^9.', '@mantine/notifications': '^9.',
                   '@react-three/fiber': '^9.', 'three': '^0.'}
"""Libraries of the client on whose class names, event filter or objects browser/* relies."""

POLL = 1e-3
"""s between two looks at what has been sent."""

_make_buffer = AsyncMessageBuffer.__init__


class ThreadSafeEvent(asyncio.Event):
    """An event that any thread may set, as viser does with its event of a new message.

    Viser sets it in the thread that queues a message, and then in the thread of the event loop.
    asyncio.Event is not thread-safe: if the first call comes after a waiter has checked the event
    and before it is in the list of waiters, the second call wakes nobody, as the event is already
    set, and the page never gets another message. If the list changes during the first call, that
    raises RuntimeError, which ended the viewer.
    """

    def set(self) -> None:
        """Set the event; in the loop's thread wake all waiters, whether it was set or not."""
        self._value = True
        try:
            asyncio.get_running_loop()
        except RuntimeError:  # another thread
            return
        for waiter in self._waiters:
            if not waiter.done():
                waiter.set_result(True)


def _make_safe_buffer(buffer: AsyncMessageBuffer, *args: Any, **options: Any) -> None:
    _make_buffer(buffer, *args, **options)
    buffer.message_event = ThreadSafeEvent()


AsyncMessageBuffer.__init__ = _make_safe_buffer  # type: ignore[method-assign]


def handle_id(handle: viser.GuiInputHandle) -> str:
    """Id of a widget in messages and in the page's HTML."""
    return handle._impl.uuid


def run_script(client: viser.ClientHandle, source: str) -> None:
    """Run JavaScript on a page, whether its panel is open or not."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(source))


def set_poses(handle: viser.BatchedMeshHandle, **arrays: np.ndarray) -> None:
    """Set the poses of a batch's p parts in one message, or none where nothing has changed.

    ``batched_positions`` (p, 3) m and ``batched_wxyzs`` (p, 4), float32, are kept: do not write to
    them later. The attributes of the handle send a message each and copy each array three times.
    """
    props = handle._impl.props
    changed = {name: array for name, array in arrays.items()
               if not np.array_equal(getattr(props, name), array)}
    if changed:
        vars(props).update(changed)
        handle._impl.api._queue_scene_message(
            _messages.SceneNodeUpdateMessage(handle.name, changed))


@contextmanager
def sent_at_once(server: viser.ViserServer) -> Iterator[None]:
    """Send to all pages, at once and together, what is changed within.

    ViserServer.atomic and flush wake viser's thread once each, also where nothing has changed: a
    system call and a change of threads. Without flush it collects messages for up to 1/60 s.
    """
    buffer = server._websock_server.get_message_buffer()
    buffer.atomic_start()
    try:
        yield
    finally:
        with buffer.buffer_lock:
            buffer.atomic_counter -= 1
            may_send = buffer.atomic_counter == 0
        if may_send and _has_unsent(buffer):
            with suppress(RuntimeError):  # the server has stopped
                buffer.event_loop.call_soon_threadsafe(_wake, buffer)


def wait_until_sent(server: viser.ViserServer, timeout: float) -> None:
    """Wait until some page has been sent all messages, at most ``timeout`` s.

    Nothing is sent within sent_at_once. If the next block begins at once, as where a frame takes
    long to draw, viser's thread has no time to send the last one.
    """
    buffer, end = server._websock_server.get_message_buffer(), time.monotonic() + timeout
    while time.monotonic() < end:
        cursors = tuple(buffer.generator_cursors.values())
        if not cursors or max(cursors) >= buffer.message_counter - 1:
            return
        time.sleep(POLL)


def _has_unsent(buffer: AsyncMessageBuffer) -> bool:
    """Whether a page lacks a message, also one queued before this block or by another thread.

    Viser's sender, if woken within a block, sends nothing and waits again.
    """
    newest = buffer.message_counter - 1
    return any(sent < newest for sent in tuple(buffer.generator_cursors.values()))


def _wake(buffer: Any) -> None:
    buffer.message_event.set()
    buffer.flush_event.set()


def connections(client: viser.ClientHandle) -> Mapping[int, Any]:
    """The server's open websockets by client_id."""
    return client._viser_server._websock_server._live_connections

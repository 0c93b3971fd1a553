"""A browser's other half: a websocket client that speaks viser's protocol, in a thread."""
from __future__ import annotations

import asyncio
import threading
import time
from contextlib import contextmanager

import msgspec
import numpy as np
import viser
import websockets
from viser import _messages

from ragdoll_ros.viewer.command import free_port, server_at
from ragdoll_ros.viewer.page import Page

PATIENCE = 180.0

START = (4.2, -1.2, 1.5)
"""m: where the camera of a page is at first."""


class PageClient:
    """One open page. It counts as open once its camera has been told."""

    def __init__(self, port, position=START, look_at=(0.0, 0.0, 0.8)):
        self.bytes = self.windows = self._events = 0
        self.arrivals, self.sizes = [], []
        self._socket = None
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, args=(port,), daemon=True)
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        self.look(position, look_at)

    def look(self, position, look_at=(0.0, 0.0, 0.8), size=(1100, 700)):
        """Tell where the camera is, what it looks at, and the canvas' width and height, pixels."""
        self.send(_messages.ViewerCameraMessage(
            wxyz=(1, 0, 0, 0), position=position, fov=0.8, near=0.01, far=1000.0,
            image_height=size[1], image_width=size[0], look_at=look_at, up_direction=(0, 0, 1)))

    def send(self, message):
        """Send one message as a browser would."""
        data = msgspec.msgpack.encode(message.as_serializable_dict([]))
        self.send_bytes(data)

    def send_bytes(self, data):
        """Send anything."""
        asyncio.run_coroutine_threadsafe(self._socket.send(data), self._loop).result(PATIENCE)

    def drag(self, name, phase, start, end, instance=0):
        """Tell of a pointer that drags a node of the scene, at two points of the world."""
        start, end = (tuple(map(float, point)) for point in (start, end))
        self.send(_messages.SceneNodeDragMessage(
            name=name, phase=phase, instance_index=instance, start_position=start,
            start_screen_pos=(0.5, 0.5), end_position=end, end_screen_pos=(0.5, 0.5),
            button='left', modifier=None))

    def update(self, handle, value):
        """Change a value in the panel."""
        self.send(_messages.GuiUpdateMessage(handle._impl.uuid, {'value': value}))

    def steer(self, page, text):
        """Use the transport bar: a word of transport.js, and a number if it needs one."""
        self.tell(page.transport.events, text)

    def tell(self, events, text):
        """Send an event of a script; see client_events.js."""
        self._events += 1
        self.update(events, f'{self._events} {text}')

    def press(self, page, label):
        """Press the hotkey of a page's command."""
        # A copy: the page's thread adds to it.
        commands = list(page.server.gui._command_handle_from_uuid.values())
        command, = (command for command in commands if command.label == label)
        self.send(_messages.CommandTriggerMessage(command._impl.uuid))

    def drop(self):
        """Let the line go dead, as a laptop that is closed does: no word of goodbye."""
        self._loop.call_soon_threadsafe(self._socket.transport.abort)
        self._thread.join(PATIENCE)

    def close(self):
        """Close the page; a second time does nothing.

        The loop is closed here, after its thread: a line that is cut ends the thread at any
        instant, between the two lines below too.
        """
        if self._loop.is_closed():
            return
        self._loop.call_soon_threadsafe(
            lambda: self._loop.create_task(self._socket.close()))
        self._thread.join(PATIENCE)
        self._loop.close()

    def _run(self, port):
        self._loop.run_until_complete(self._listen(port))

    async def _listen(self, port):
        async with websockets.connect(
                f'ws://127.0.0.1:{port}', subprotocols=[f'viser-v{viser.__version__}'],
                max_size=None, compression=None) as self._socket:
            self._ready.set()
            try:
                async for data in self._socket:
                    self.bytes += len(data)
                    self.windows += 1
                    self.arrivals.append(time.monotonic())
                    self.sizes.append(len(data))
            except websockets.ConnectionClosed:
                pass


def wait(condition, timeout=PATIENCE):
    """Wait until the condition holds; fail if it does not in time."""
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, 'not in time'
        time.sleep(0.005)


def has_all(server):
    """Whether every open page has had every message."""
    buffer = server._websock_server.get_message_buffer()
    cursors = buffer.generator_cursors
    return bool(cursors) and set(cursors.values()) == {buffer.message_counter - 1}


@contextmanager
def served(source, folder='.'):
    """A page of a source, drawn by a thread; its clients and the source are closed at the end."""
    stop = threading.Event()
    with server_at('127.0.0.1', free_port('127.0.0.1', 0)) as server:
        page = Page(server, source, folder)
        page.clients = []

        def client(kind=PageClient, **camera):
            page.clients.append(kind(server.get_port(), **camera))
            return page.clients[-1]

        page.open = client
        thread = threading.Thread(target=page.run, args=(stop,))
        thread.start()
        try:
            yield page
        finally:
            stop.set()
            thread.join()
            source.close()
            for each in page.clients:
                each.close()


def batch_of(page, bone):
    """Name of the node that a bone is drawn in, its number there, and its place (3,) m."""
    index = page.stage.scene.bone_index(bone)
    for batch in page.stage.bodies.batches:
        for number in np.flatnonzero(batch.bones == index):
            return batch.handle.name, int(number), page.frame.state.positions[index]
    raise AssertionError(bone)

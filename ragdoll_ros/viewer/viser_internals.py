"""Every use of viser beyond its public interface, and the versions that it was tried with.

setup.py's extra `viewer` has the same range. Before it is widened, test_viewer_internals.py has to
pass with the new version: it checks that each name below exists there.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import viser
from viser import _messages

VERSIONS = '>=1.1.1,<1.2'

CLIENT_NAMES = ('__viserMutable', 'sendMessage', 'scene', 'nodeRefFromName', 'camera',
                'cameraControl', 'requestRender', 'canvas', 'sendCamera',
                'GuiUpdateMessage', 'Uploading ')
"""What browser/*.js uses of viser's own client: its mutable state, a message, a notice's text."""

CLIENT_PACKAGES = {'@mantine/core': '^9.', '@mantine/notifications': '^9.',
                   '@react-three/fiber': '^9.', 'three': '^0.'}
"""Libraries of the client on whose class names, event filter or objects browser/* relies."""


def handle_id(handle: viser.GuiInputHandle) -> str:
    """Id of a widget in messages and in the page's HTML."""
    return handle._impl.uuid


def run_script(client: viser.ClientHandle, source: str) -> None:
    """Run JavaScript on a page, whether its panel is open or not."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(source))


def connections(client: viser.ClientHandle) -> Mapping[int, Any]:
    """The server's open websockets by client_id."""
    return client._viser_server._websock_server._live_connections

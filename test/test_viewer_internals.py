"""What the page uses of viser beyond its public interface, and the version that has it."""
from __future__ import annotations

import ast
import asyncio
import collections
import json
import re
import threading
from contextlib import ExitStack
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

pytest.importorskip('viser')
import viser
from conftest import ROOT
from page_client import PageClient, has_all, wait
from viser import _messages

from ragdoll_ros.viewer import viser_internals
from ragdoll_ros.viewer.browser import scripts

CLIENT = Path(viser.__file__).parent / 'client'
SCRIPTS = sorted(scripts.FOLDER.glob('*.js'))
MESSAGES = ('CommandTriggerMessage', 'FileTransferPart', 'FileTransferStartUpload',
            'GuiUpdateMessage', 'SceneNodeClickMessage', 'SceneNodeDragMessage',
            'TransformControlsDragEndMessage', 'TransformControlsDragStartMessage',
            'TransformControlsUpdateMessage', 'ViewerCameraMessage')
"""What the tests' own client sends."""


@pytest.fixture(scope='module')
def server():
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    yield server
    server.stop()


def test_the_installed_version_is_in_the_range_of_setup():
    assert f"'viser{viser_internals.VERSIONS}'" in (ROOT / 'setup.py').read_text()
    assert version('viser') in SpecifierSet(viser_internals.VERSIONS)


def test_private_names_of_the_server_exist(server):
    """Those of viser_internals.py, with a real client."""
    assert viser_internals.handle_id(server.gui.add_text('a', '')) != viser_internals.handle_id(
        server.gui.add_text('b', ''))
    page = PageClient(server.get_port())
    try:
        wait(server.get_clients)
        (client_id, client), = server.get_clients().items()
        assert hasattr(viser_internals.connections(client)[client_id], 'ping')
        with viser_internals.sent_at_once(server):
            server.scene.add_frame('/f')
            before = page.windows
        wait(lambda: page.windows > before)
    finally:
        page.close()


def test_private_names_that_tests_use_exist(server):
    gui = server.gui
    field, command = gui.add_text('c', ''), gui.add_command('d')
    assert field in gui._gui_input_handle_from_uuid.values()
    assert gui._command_handle_from_uuid[command._impl.uuid] is command
    assert gui._thread_executor.submit and field._impl.update_cb == []
    handle = server.scene.add_transform_controls('/e')
    assert handle._impl_aux.update_cb == []
    assert all(hasattr(_messages, name) for name in MESSAGES)


@pytest.mark.parametrize('name', viser_internals.CLIENT_NAMES)
def test_names_of_the_client_exist(name):
    """In its source, from which its page is built, and which comes with it."""
    assert any(name in path.read_text() for path in CLIENT.glob('src/**/*.ts*'))


def test_libraries_of_the_client_are_those_that_scripts_rely_on():
    have = json.loads((CLIENT / 'package.json').read_text())['dependencies']
    for name, major in viser_internals.CLIENT_PACKAGES.items():
        assert have[name].startswith(major), name


@pytest.mark.parametrize('path', SCRIPTS, ids=lambda path: path.name)
def test_a_script_uses_no_other_names_of_the_client(path):
    used = set(re.findall(r'\b(?:viewer|__viserMutable)\??\.(\w+)', path.read_text()))
    assert {name for name in used if not name.startswith('ragdoll')} <= set(
        viser_internals.CLIENT_NAMES)


def test_no_other_module_uses_private_names():
    """Of anything but itself."""
    for path in (ROOT / 'ragdoll_ros/viewer').rglob('*.py'):
        private = {node.attr for node in ast.walk(ast.parse(path.read_text()))
                   if isinstance(node, ast.Attribute) and re.match('_[^_]', node.attr)
                   and not (isinstance(node.value, ast.Name) and node.value.id == 'self')}
        assert not private or path.name == 'viser_internals.py', (path, private)


def test_a_script_is_html_whose_attribute_is_the_script():
    """With constants before it, whatever is in them."""
    html = scripts.script('hint.js', KEY='a "b" <c> & \'d\'')
    code = re.fullmatch(r'<img src="data:," style="display:none" onerror="([^"<>]*)">', html)[1]
    for entity, character in (('&quot;', '"'), ('&#x27;', "'"), ('&lt;', '<'), ('&gt;', '>'),
                              ('&amp;', '&')):
        code = code.replace(entity, character)
    assert code == 'const KEY = "a \\"b\\" <c> & \'d\'";\n' + scripts.source('hint.js')


@pytest.fixture
def page(server):
    """A page that has had all messages until now, whose sender waits for the next."""
    page = PageClient(server.get_port())
    event = server._websock_server.get_message_buffer().message_event
    try:
        wait(lambda: has_all(server) and event._waiters and not event.is_set())
        yield page
    finally:
        page.close()


def test_what_another_thread_queues_beside_a_block_is_sent(server, page):
    """Where its own block ends within one in which nothing is queued."""
    with ExitStack() as other:
        other.enter_context(server.atomic())
        server.scene.add_frame('/beside')
        with viser_internals.sent_at_once(server):
            other.close()
    wait(lambda: has_all(server))


def test_what_is_queued_is_sent_though_the_sender_looks_in_the_next_block(server, page):
    """In which it must not send, and in which nothing is queued."""
    buffer = server._websock_server.get_message_buffer()
    event, go_on = buffer.message_event, threading.Event()
    buffer.event_loop.call_soon_threadsafe(go_on.wait)
    with viser_internals.sent_at_once(server):
        server.scene.add_frame('/before')
    with viser_internals.sent_at_once(server):
        go_on.set()
        wait(lambda: event._waiters and not event.is_set())
        assert not has_all(server)
    wait(lambda: has_all(server))


def queue(event, loop):
    """What viser does with its event as another thread queues a message."""
    event.set()
    loop.call_soon_threadsafe(event.set)


class Waiters(collections.deque):
    """Waiters of a loop, which only its own thread may go through: they come and go in it."""

    def __iter__(self):
        assert threading.current_thread() is threading.main_thread()
        return super().__iter__()


class Late(collections.deque):
    """Waiters that begin to wait just after another thread has queued a message."""

    def __init__(self, *queued):
        super().__init__()
        self.queued = queued

    def append(self, waiter):
        thread = threading.Thread(target=queue, args=self.queued)
        thread.start()
        thread.join()
        super().append(waiter)


def test_a_message_from_another_thread_wakes_all_that_wait(server):
    async def woken():
        event, loop = viser_internals.ThreadSafeEvent(), asyncio.get_running_loop()
        waiters = [asyncio.ensure_future(event.wait()) for _ in range(3)]
        await asyncio.sleep(0)
        event._waiters = Waiters(event._waiters)
        await loop.run_in_executor(None, queue, event, loop)
        return await asyncio.wait_for(asyncio.gather(*waiters), 60)
    assert asyncio.run(woken()) == [True] * 3
    event = server._websock_server.get_message_buffer().message_event
    assert isinstance(event, viser_internals.ThreadSafeEvent)


def test_a_message_that_comes_as_one_begins_to_wait_wakes_it():
    """Else the page stands still for ever: no later message wakes it either."""
    async def woken(kind):
        event, loop = kind(), asyncio.get_running_loop()
        event._waiters = Late(event, loop)
        return await asyncio.wait_for(event.wait(), 0.5)
    assert asyncio.run(woken(viser_internals.ThreadSafeEvent))
    with pytest.raises(asyncio.TimeoutError):
        asyncio.run(woken(asyncio.Event))

"""`ragdoll_viewer` as a process: its address, its ends, and what it refuses."""
from __future__ import annotations

import atexit
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip('viser')
import viser
from conftest import ROOT, light
from page_client import PATIENCE, PageClient

from ragdoll_ros.viewer.command import folder_for_files, is_public, main, server_at, stop_on_signals

COMMAND = [sys.executable, '-m', 'ragdoll_ros.viewer.command']


def start(*arguments):
    """Start it; give the process and the port of the address that it prints."""
    process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, text=True, cwd=ROOT,
                               env=light(), stderr=subprocess.PIPE)
    line = process.stdout.readline()
    found = re.fullmatch(r'The page is at http://127\.0\.0\.1:(\d+)\n', line)
    assert found, line
    return process, int(found[1])


def places_of(port):
    """Where sockets listen on a port, as Linux lists them; 127.0.0.1 is 0100007F."""
    listening = [line.split()[1] for path in map(Path, ('/proc/net/tcp', '/proc/net/tcp6'))
                 if path.exists() for line in path.read_text().splitlines()
                 if line.split()[3] == '0A']
    return [place for place in listening if place.endswith(f':{port:04X}')]


@pytest.fixture
def signals():
    """The command takes the signals of its process: they are given back."""
    before = {sign: signal.getsignal(sign) for sign in (signal.SIGINT, signal.SIGTERM)}
    yield
    for sign, handler in before.items():
        signal.signal(sign, handler)


@pytest.fixture
def ended(signals, capsys):
    """Call it in this process; gives its exit code, and what it prints on both streams."""
    def call(*arguments):
        try:
            code = main(list(arguments))
        except SystemExit as error:
            code = error.code
        return code, *capsys.readouterr()
    return call


def test_a_character_is_no_scene_and_how_to_make_one_is_said(ended, tmp_path):
    path = tmp_path / 'fox.glb'
    path.write_bytes(b'glTF' + bytes(range(128, 256)))
    code, _, said = ended('--scene', str(path), '--port', '0')
    assert code == 2 and f'ragdoll_fit {path}' in said
    assert 'utf-8' not in said


def test_what_cannot_be_played_leaves_no_folder(ended, monkeypatch, tmp_path):
    (tmp_path / 'bad.mcap').write_text('bad')
    monkeypatch.setenv('HOME', str(tmp_path))
    code, *_ = ended('--play', str(tmp_path / 'bad.mcap'))
    assert code == 2 and [path.name for path in tmp_path.iterdir()] == ['bad.mcap']


SIGNS = pytest.mark.parametrize('sign', [signal.SIGINT, signal.SIGTERM])


@SIGNS
def test_says_where_it_is_serves_and_ends(sign):
    process, port = start('--scene', 'drop', '--port', '0')
    assert places_of(port) == [f'0100007F:{port:04X}'], 'this machine alone'
    with urllib.request.urlopen(f'http://127.0.0.1:{port}', timeout=PATIENCE) as answer:
        assert answer.status == 200 and b'<html' in answer.read()
    PageClient(port)
    end_beside_a_reserve(process, port, sign)


def end_beside_a_reserve(process, port, sign):
    """End it well; give the seconds it took. A browser connects once more than it needs to."""
    with socket.create_connection(('127.0.0.1', port)):
        begin = time.monotonic()
        process.send_signal(sign)
        out, error = process.communicate(timeout=PATIENCE)
        took = time.monotonic() - begin
    assert process.returncode == 0 and not out and 'Traceback' not in error
    return took


@pytest.mark.slow
@SIGNS
def test_ends_within_two_seconds(sign):
    process, port = start('--scene', 'drop', '--port', '0')
    PageClient(port)
    assert end_beside_a_reserve(process, port, sign) < 2


def test_an_end_does_not_wait_for_what_viser_waits_for(monkeypatch):
    """Viser's stop() takes 6 s for a connection without a request; this one has no end."""
    begun, released = threading.Event(), threading.Event()
    ended, unregistered = [], []

    class Server:
        def __init__(self, *arguments, **options):
            pass

        def stop(self):
            begun.set()
            released.wait(PATIENCE)
            ended.append(self)

    monkeypatch.setattr(viser, 'ViserServer', Server)
    monkeypatch.setattr(atexit, 'unregister', unregistered.append)
    try:
        with server_at('127.0.0.1', 0) as server:
            assert not begun.is_set()
        assert begun.wait(PATIENCE) and not ended
        assert unregistered == [server.stop], 'nor at the exit of the interpreter'
    finally:
        released.set()


def test_a_port_that_was_asked_for_and_is_taken_is_an_error(signals, capsys):
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(['--scene', 'drop', '--port', str(port)]) == 2
    said = capsys.readouterr().err
    assert str(port) in said and 'in use' in said and 'without --port' in said


def test_a_port_of_the_system_is_for_root_alone():
    lowest = Path('/proc/sys/net/ipv4/ip_unprivileged_port_start')
    if not lowest.exists() or int(lowest.read_text()) <= 80:
        pytest.skip('this system gives port 80 to everybody')
    done = subprocess.run(
        [sys.executable, '-c', 'from ragdoll_ros.viewer.command import free_port\n'
         # Who is nobody may not read the library from which this codec comes.
         'import os\n"".encode("idna")\n'
         'if os.getuid() == 0: os.setuid(65534)\nfree_port("127.0.0.1", 80)'],
        cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)
    said = done.stderr.splitlines()[-1]
    assert '--port 80' in said and 'root' in said and '1024' in said


@pytest.mark.parametrize(('arguments', 'words'), [
    (('--scene', 'nowhere'), ['nowhere', 'drop']),
    (('--scene', 'drop', '--host', '203.0.113.1'), ['203.0.113.1', 'address']),
    (('--scene', 'drop', '--host', 'no such host'), ['no such host']),
    (('--scene', 'drop', '--port', '99999'), ['99999', '65535']),
    (('--scene', 'drop', '--host', '..'), ['..', '127.0.0.1']),
    (('--scene', 'drop', '--port', 'x'), ['--port', 'x', 'up to 65535']),
    (('--start-after', '-5'), ['--start-after', '-5', '0 or more']),
    (('--start-after', 'nan'), ['--start-after', 'nan', '0 or more']),
    (('--start-after', 'soon'), ['--start-after', 'soon', '0 or more']),
    (('--start-after', '5', '--scene', 'drop'), ['--start-after 5', '--scene']),
    (('--start-after', '5', '--play', 'run.mcap'), ['--start-after 5', '--play']),
    (('--scene', 'drop', '--engine', 'steam'), ['steam', 'rigid', 'bullet']),
    (('--engine', 'bullet'), ['--engine', '--scene']),
    (('--scene', 'drop', '--ros-args', '-r', '__ns:=/a'), ['--ros-args', '--scene']),
    (('--scene', 'drop', '--folder', '/dev/null/x'), ['/dev/null/x', 'folder'])])
def test_refuses_with_exit_code_two(arguments, words, ended):
    code, _, said = ended(*arguments)
    assert code == 2 and all(word in said for word in words), said


def test_files_go_to_a_folder_of_their_own(tmp_path, monkeypatch, capsys):
    """In the home, made when it is first needed; where that cannot be, one for this run, said."""
    monkeypatch.setenv('HOME', str(tmp_path))
    assert folder_for_files(None) == tmp_path / 'ragdolls' and (tmp_path / 'ragdolls').is_dir()
    assert folder_for_files(str(tmp_path)) == tmp_path and not capsys.readouterr().err
    monkeypatch.setenv('HOME', '/dev/null')
    folder = folder_for_files(None)
    try:
        assert str(folder) in capsys.readouterr().err and folder.is_dir()
    finally:
        folder.rmdir()


@pytest.mark.parametrize(('host', 'others'), [
    ('127.0.0.1', False), ('localhost', False), ('::1', False), ('0.0.0.0', True), ('::', True)])
def test_a_page_that_others_reach_says_so(host, others):
    assert is_public(host) == others


def test_an_open_host_is_told_with_what_to_do():
    process, port = start('--scene', 'man_faints', '--host', '0.0.0.0', '--port', '0')
    process.send_signal(signal.SIGTERM)
    _, error = process.communicate(timeout=PATIENCE)
    said, = error.splitlines()
    assert f'at port {port} may steer' in said and '--host 127.0.0.1' in said


def test_a_signal_is_heard_within_a_wait_for_it():
    """The main thread holds the event's lock then, in one of 40 ends on a busy machine."""
    before = {sign: signal.getsignal(sign) for sign in (signal.SIGINT, signal.SIGTERM)}
    try:
        stop = stop_on_signals()
        with stop._cond:
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGTERM)
        assert stop.wait(PATIENCE)
    finally:
        for sign, handler in before.items():
            signal.signal(sign, handler)


def test_a_wrong_option_ends_the_process_with_two():
    done = subprocess.run([*COMMAND, '--nonsense'], capture_output=True, text=True, cwd=ROOT,
                          env=light(), timeout=PATIENCE)
    assert done.returncode == 2 and '--nonsense' in done.stderr and 'Traceback' not in done.stderr


def test_a_broken_scene_is_refused_with_all_its_errors(ended, broken_scene):
    path, words = broken_scene
    code, _, said = ended('--scene', str(path))
    assert code == 2 and all(word in said for word in words)


@pytest.mark.parametrize(('missing', 'word', 'arguments'), [
    ('viser', 'ragdoll_ros[viewer]', ('--scene', 'drop')), ('rclpy', 'ragdoll_ros[ros]', ())])
def test_says_what_to_install(tmp_path, missing, word, arguments):
    """A package that cannot be imported, as where it is not installed."""
    (tmp_path / f'{missing}.py').write_text('raise ImportError("not here")\n')
    path = os.pathsep.join([str(tmp_path), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([*COMMAND, *arguments, '--port', '0'], capture_output=True, text=True,
                          cwd=ROOT, timeout=PATIENCE, env={**os.environ, 'PYTHONPATH': path})
    assert done.returncode == 2 and word in done.stderr and 'Traceback' not in done.stderr


def test_what_to_install_is_said_before_machine_code_is_made():
    """By a process to which viser is not there: numba is not even imported."""
    done = subprocess.run([sys.executable, '-c', 'import sys\n'
                           'sys.modules["viser"] = None\n'
                           'from ragdoll_ros.viewer.command import main\n'
                           'assert main(["--scene", "drop"]) == 2\n'
                           'sys.exit("numba" in sys.modules)'],
                          capture_output=True, text=True, cwd=ROOT, timeout=PATIENCE)
    assert done.returncode == 0 and 'ragdoll_ros[viewer]' in done.stderr, done.stderr


def test_help_has_examples(ended):
    code, said, _ = ended('--help')
    assert code == 0 and 'ragdoll_viewer --scene doll.yaml' in said


def test_a_page_of_a_recording_or_a_node_needs_no_engine():
    """It may run on a machine without PyBullet."""
    done = subprocess.run([sys.executable, '-c', 'import sys\n'
                           'import ragdoll_ros.viewer.page, ragdoll_ros.viewer.sources.playback\n'
                           'try: import ragdoll_ros.viewer.sources.node.source\n'
                           'except ModuleNotFoundError as error: assert error.name == "rclpy"\n'
                           'sys.exit("pybullet" in sys.modules)'], cwd=ROOT, timeout=PATIENCE)
    assert done.returncode == 0

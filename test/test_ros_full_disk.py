"""Where nothing can be written the node starts all the same, or says in one line why it does not.

A file in the place of a folder lets nobody write there, root neither.
"""
import signal
import subprocess
import sys

import pytest
from conftest import light
from geometry_msgs.msg import PoseArray
from peer import PATIENCE, end, start

pytestmark = pytest.mark.usefixtures('nothing_runs_on')

SMALL = """
mount -t tmpfs -o size=4k tmpfs "$1" && cat /dev/zero > "$1/filled" 2>/dev/null
{} && shift && exec "$@"
"""
"""A file system that is full, or also read-only, in a mount namespace of its own."""


@pytest.fixture
def no_folder(tmp_path):
    """A path at which no folder can be made."""
    path = tmp_path / 'file'
    path.touch()
    return path


def test_without_a_log_it_says_why_it_does_not_start(ros, monkeypatch, no_folder):
    monkeypatch.setenv('ROS_LOG_DIR', str(no_folder))
    process = start('node')
    output, errors = process.communicate(timeout=PATIENCE)
    line, = errors.splitlines()
    assert (process.returncode, output) == (2, '')
    assert line.startswith('ROS does not start: ') and str(no_folder) in line


def test_without_a_home_it_runs(ros, peer, monkeypatch, tmp_path, no_folder):
    """And without a folder for machine code or for temporary files, as long as there is a log."""
    for name in ('HOME', 'XDG_CACHE_HOME', 'NUMBA_CACHE_DIR', 'MPLCONFIGDIR'):
        monkeypatch.setenv(name, str(no_folder))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = start('node')
    peer.wait(lambda: got)
    code, _ = end(process, signal.SIGINT)
    assert code == 0 and 'Traceback' not in process.stderr_text


@pytest.mark.slow
def test_without_a_folder_for_machine_code_it_compiles_and_runs(ros, peer, monkeypatch, no_folder):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(no_folder))
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = start('node', compiled=True)
    peer.wait(lambda: got, timeout=4 * PATIENCE)  # the minute that compiling takes, and load
    code, _ = end(process, signal.SIGINT)
    assert code == 0 and 'at every start' in process.stderr_text
    assert 'Traceback' not in process.stderr_text


@pytest.mark.parametrize('then, starts', [('true', True), ('mount -o remount,ro "$1"', False)])
def test_on_a_file_system_that_is_full_or_read_only(ros, peer, tmp_path, then, starts):
    """Full: a log is begun and has no lines. Read-only: no log can be begun."""
    own = ['unshare', '--mount', 'sh', '-c', SMALL.format(then), 'sh', str(tmp_path)]
    if subprocess.run([*own, 'true'], capture_output=True).returncode:
        pytest.skip('no file system can be mounted here')
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = subprocess.Popen(
        [*own, sys.executable, '-m', 'ragdoll_ros.ros.node'], text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, env={**light(), 'HOME': str(tmp_path), 'TMPDIR': str(tmp_path),
                                     'ROS_LOG_DIR': str(tmp_path / 'log') if not starts else
                                     str(tmp_path), 'NUMBA_CACHE_DIR': str(tmp_path)})
    try:
        if starts:
            peer.wait(lambda: got or process.poll() is not None)
            process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == (0 if starts else 2), errors
    assert 'Traceback' not in errors
    assert starts or len(errors.splitlines()) == 1

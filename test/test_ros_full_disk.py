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


@pytest.mark.parametrize('module', ['ros.node', 'viewer.command'])
def test_without_a_log_it_says_why_it_does_not_start(ros, no_folder, module):
    if module.startswith('viewer'):
        pytest.importorskip('viser')
    done = subprocess.run([sys.executable, '-m', f'ragdoll_ros.{module}'], capture_output=True,
                          text=True, timeout=PATIENCE,
                          env={**light(), 'ROS_LOG_DIR': str(no_folder)})
    line, = done.stderr.splitlines()
    assert (done.returncode, done.stdout) == (2, '')
    assert line.startswith('ROS does not start: ') and str(no_folder) in line


@pytest.fixture
def homeless(monkeypatch, tmp_path, no_folder):
    """No home, and no folder for machine code or for temporary files: a log alone."""
    for name in ('HOME', 'XDG_CACHE_HOME', 'NUMBA_CACHE_DIR', 'MPLCONFIGDIR', 'TMPDIR'):
        monkeypatch.setenv(name, str(no_folder))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))


def test_without_a_home_it_runs(ros, peer, homeless):
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = start('node')
    peer.wait(lambda: got)
    code, _ = end(process, signal.SIGINT)
    assert code == 0 and 'Traceback' not in process.stderr_text


@pytest.mark.slow
def test_without_a_folder_for_machine_code_it_compiles_and_runs(ros, peer, homeless):
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = start('node', compiled=True)
    peer.wait(lambda: got, timeout=4 * PATIENCE)  # the minute that compiling takes, and load
    code, _ = end(process, signal.SIGINT)
    assert code == 0 and 'at every start' in process.stderr_text
    assert 'Traceback' not in process.stderr_text


READ_ONLY = 'mount -o remount,ro "$1"'


@pytest.mark.parametrize('then, log, starts', [
    ('true', '', True), (READ_ONLY, '', False), (READ_ONLY, 'log', False)])
def test_on_a_file_system_that_is_full_or_read_only(ros, peer, tmp_path, then, log, starts):
    """Full: a log is begun and has no lines. Read-only: no log can be begun, nor its folder."""
    own = ['unshare', '--mount', 'sh', '-c', SMALL.format(then), 'sh', str(tmp_path)]
    if subprocess.run([*own, 'true'], capture_output=True).returncode:
        pytest.skip('no file system can be mounted here')
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = subprocess.Popen(
        [*own, sys.executable, '-m', 'ragdoll_ros.ros.node'], text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, env={**light(), 'HOME': str(tmp_path), 'TMPDIR': str(tmp_path),
                                     'ROS_LOG_DIR': str(tmp_path / log),
                                     'NUMBA_CACHE_DIR': str(tmp_path)})
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

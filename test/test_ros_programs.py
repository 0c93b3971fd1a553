"""The programs as a user starts and ends them: exit codes, help, the terminal."""
from __future__ import annotations

import re
import signal
import time

import pytest
from geometry_msgs.msg import PoseArray
from peer import PATIENCE, Peer, end, start, start_on_terminal
from screen import Screen

from ragdoll_ros.ros import node, run
from ragdoll_ros.ros.teleop import teleop
from ragdoll_ros.ros.teleop.teleop import show, show_line

pytestmark = pytest.mark.usefixtures('nothing_runs_on')


@pytest.fixture(scope='module')
def peer(ros):
    peer = Peer()
    yield peer
    peer.destroy_node()


def ends(peer):
    """Start a node for each sign and end it well; give the seconds that each end took."""
    signs = (signal.SIGINT, signal.SIGTERM)
    processes = [start('node', '--ros-args', '-r', f'__ns:=/signalled_{number}')
                 for number in range(len(signs))]
    got = [peer.collect(PoseArray, f'/signalled_{number}/ragdoll/poses')
           for number in range(len(signs))]
    peer.wait(lambda: all(got))
    times = []
    for process, sign in zip(processes, signs, strict=True):
        code, took = end(process, sign)
        assert code == 0, process.stderr_text
        times.append(took)
    return times


def test_a_signal_ends_the_node_with_0(peer):
    ends(peer)


@pytest.mark.slow
def test_a_signal_ends_the_node_within_2_s(peer):
    assert max(ends(peer)) < 2


def test_a_wrong_start_ends_with_2_and_a_reason(ros, broken_scene):
    path, words = broken_scene
    cases = [(('node', '--ros-args', '-p', 'rate:=-1.0', '-p', 'real_time_factor:=.nan'),
              ['rate', 'real_time_factor']),
             (('node', '--ros-args', '-p', 'rate'), ['rate']),
             (('node', '--ros-args', '-p', f'scene:={path}'), words),
             (('run', str(path)), words),
             (('teleop.teleop',), ['terminal'])]
    for (arguments, words), process in [(case, start(*case[0])) for case in cases]:
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 2, arguments
        assert all(word in errors for word in words) and 'Traceback' not in errors


@pytest.mark.parametrize('program', [node, run, teleop])
@pytest.mark.parametrize('option, code, stream, word', [
    ('--help', 0, 'out', 'examples:'), ('--faster', 2, 'err', '--faster')])
def test_help_has_an_example_and_a_wrong_option_is_named(capsys, program, option, code, stream,
                                                         word):
    with pytest.raises(SystemExit) as ended:
        program.main([program.__name__, option])
    assert ended.value.code == code and word in getattr(capsys.readouterr(), stream)


def line(push):
    """The live line with this push."""
    return rf'RTF [01]\.\d\d  \d+\.\d s  push {push}  tick \d+\.\d\d ms  torso .* m \d+\.\d m/s'


def test_run_shows_a_live_line_and_the_arrows_push(ros):
    process, terminal = start_on_terminal('run', '--ros-args', '-r', '__ns:=/stage')
    screen = Screen(terminal)
    screen.wait(line('none'))
    screen.type(b'\x1b[A')
    screen.wait(line(r'\(-2000 0 1\) N'))
    screen.wait(line('none'))
    screen.type(b'\x1b[A\x1b[C')
    screen.wait(line(r'\(-2000 2000 2\) N'))
    screen.wait(line('none'))
    screen.type(b' ')
    screen.wait(r'paused  \d')
    screen.type(b' ')
    screen.wait(line('none'))
    screen.type(b'r')
    screen.wait(r'  0\.\d s')
    screen.type(b'q')
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 0


def test_a_long_line_of_the_log_is_shown_whole(capsys, monkeypatch):
    """On a terminal of 20 columns, in place of the status line, which is cut to fit."""
    monkeypatch.setenv('COLUMNS', '20')
    show('RTF 1.00  ' + 'x' * 30)
    show_line('scene drop: ' + 'y' * 30)
    status, _, log = capsys.readouterr().out.rpartition('\r')
    assert 'x' * 10 not in status and log == '\x1b[Kscene drop: ' + 'y' * 30 + '\n'


def test_without_a_terminal_the_line_is_logged_each_second(ros):
    process = start('run', '--ros-args', '-r', '__ns:=/logged', '-p', 'real_time_factor:=0.5')
    lines, until = [], time.monotonic() + PATIENCE
    while not re.match(r'RTF 0\.\d\d  \d', lines[-1] if lines else ''):
        assert time.monotonic() < until and process.poll() is None, lines
        lines.append(process.stdout.readline())
    code, _ = end(process, signal.SIGTERM)
    assert code == 0

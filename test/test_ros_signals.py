"""Signals at any instant of a node's life: it ends with 0 and says no more than it should."""
from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from geometry_msgs.msg import PoseArray
from peer import PATIENCE, start
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from ragdoll_ros.ros.event_log import EVENTS_QOS
from ragdoll_ros.ros.process.signals import run_uninterrupted, run_until_signal

pytestmark = pytest.mark.usefixtures('nothing_runs_on')

SIGNS = (signal.SIGINT, signal.SIGTERM)

RESETS = 10
"""Asked for at once: as many as wait at a service."""


def imports(process):
    """Whether the process has got as far as this package."""
    with open(f'/proc/{process.pid}/status') as status:
        blocked = next(line for line in status if line.startswith('SigBlk'))
    return int(blocked.split()[1], 16) >> (signal.SIGINT - 1) & 1


def wait(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, 'not in time'
        time.sleep(0.001)  # leaves the processor to the process that is waited for


def outcome(process):
    output, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, output, errors


@pytest.mark.parametrize('sign', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('delay', [0.0, 0.2, 0.5, 1.0])
def test_a_signal_at_the_start_ends_it_with_0(ros, sign, delay):
    process = start('node')
    wait(lambda: imports(process))
    begun = time.monotonic()
    wait(lambda: time.monotonic() > begun + delay)
    process.send_signal(sign)
    code, output, errors = outcome(process)
    assert (code, output) == (0, '') and 'Traceback' not in errors


def test_a_signal_during_an_exec_ends_it_with_0(tmp_path):
    """Dataclasses are made by one. Python would die by the signal at its exit, though caught."""
    (tmp_path / 'interrupted.py').write_text(
        'import signal, sys\n'
        'from ragdoll_ros.ros.process.signals import run_until_signal\n'
        'sys.exit(run_until_signal(lambda: exec("signal.raise_signal(signal.SIGINT)")))\n')
    found = dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), *sys.path]))
    run = subprocess.run([sys.executable, '-m', 'interrupted'], env=found, timeout=PATIENCE)
    assert run.returncode == 0


def test_a_signal_in_a_callback_of_c_code_ends_it():
    """It cannot be left by an exception: nothing is printed, the signal comes again after it."""
    program = (
        'import ctypes, signal, time\n'
        'from ragdoll_ros.ros.process.signals import run_until_signal\n'
        'def run():\n'
        '    ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()\n'
        '    while True: time.sleep(1.0)\n'
        'raise SystemExit(run_until_signal(run))\n')
    run = subprocess.run([sys.executable, '-c', program], capture_output=True, timeout=PATIENCE)
    assert (run.returncode, run.stdout, run.stderr) == (0, b'', b'')


def test_more_signals_while_it_ends_change_nothing(ros, peer):
    got = peer.collect(PoseArray, 'ragdoll/poses')
    process = start('node')
    peer.wait(lambda: got)
    draw = random.Random(1)
    while process.poll() is None:
        process.send_signal(draw.choice((signal.SIGINT, signal.SIGTERM)))
        pause = time.monotonic() + draw.uniform(0, 0.01)
        wait(lambda pause=pause: time.monotonic() > pause)
    code, _, errors = outcome(process)
    assert code == 0 and 'Traceback' not in errors
    # One line as it begins, one as it ends, and where tf2_msgs is missing, one that says so.
    assert errors.count('[INFO]') == 2 + errors.count('/tf is not published')
    assert errors.count('ended at') == 1 and 'of simulated time; 0 inputs refused' in errors


def linger(process, longest, draw):
    """Let a random time go by, or less if the process ends."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(draw.uniform(0, longest))


def begins(process, peer, draw):
    wait(lambda: imports(process))
    linger(process, 3.0, draw)


def runs(process, peer, draw):
    peer.hear_once(PoseArray, 'ragdoll/poses')
    linger(process, 0.5, draw)


def ends(process, peer, draw):
    """By another signal than the one that counts."""
    runs(process, peer, draw)
    process.send_signal(draw.choice(SIGNS))
    linger(process, 0.2, draw)


def end_well(process, sign):
    """Send a signal; assert that it is the process's end, and that nothing is left of it."""
    before = time.monotonic()
    process.send_signal(sign)
    code, _, errors = outcome(process)
    assert code == 0 and 'Traceback' not in errors, errors
    assert time.monotonic() - before < 2
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)


@pytest.mark.slow
@pytest.mark.parametrize('does, times', [(begins, 20), (runs, 10), (ends, 10)])
def test_forty_signals_at_random_instants(ros, peer, does, times):
    draw, alive = random.Random(2), 0
    for _ in range(times):
        process = start('node', compiled=True)
        does(process, peer, draw)
        alive += process.poll() is None
        end_well(process, draw.choice(SIGNS))
    assert alive > times / 2, 'else nothing was sent'


@pytest.mark.slow
def test_ten_signals_into_resets(ros, peer):
    """A thousand dolls, as their reset takes 30 ms, are set back again and again; a reset that was
    begun, as an event tells, and is not answered has been cut short.
    """
    draw, cut = random.Random(3), 0
    for _ in range(10):
        begun = peer.collect(String, 'ragdoll/events', EVENTS_QOS)
        process = start('node', '--ros-args', '-p', 'scene:=field', compiled=True)
        peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True))
        peer.wait(lambda begun=begun: begun)
        caller = peer.create_client(Trigger, 'ragdoll/reset')
        peer.wait(caller.service_is_ready)
        answers = [caller.call_async(Trigger.Request()) for _ in range(RESETS)]
        peer.wait(answers[0].done)
        linger(process, 0.1, draw)
        end_well(process, draw.choice(SIGNS))
        for _ in range(4 * RESETS):  # takes all that has come, and waits for nothing
            peer.executor_.spin_once(timeout_sec=0)
        told = sum(json.loads(event.data)['kind'] == 'reset' for _, event in begun)
        cut += told > sum(answer.done() for answer in answers)
    assert cut, 'else none fell into a reset'


@pytest.mark.slow
@pytest.mark.parametrize('delay', [0.0, 3.0, 10.0])
def test_a_signal_while_it_compiles_ends_it(ros, monkeypatch, tmp_path, delay):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    process = start('node', compiled=True)
    assert 'Compiling' in process.stderr.readline()
    end = time.monotonic() + delay
    wait(lambda: time.monotonic() > end)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    code, _, errors = outcome(process)
    assert code == 0 and errors == 'Ending: the next start compiles what is missing\n'
    assert time.monotonic() - sent < 5


def test_a_first_signal_does_not_cut_short_the_end():
    """As where ROS, which takes signals too, has shut down before Python takes this one."""
    stood = {number: signal.getsignal(number) for number in SIGNS}
    said = []

    def end():
        signal.raise_signal(signal.SIGINT)
        said.append('ended')

    try:
        assert run_until_signal(lambda: run_uninterrupted(end) or 0) == 0
    finally:
        for number, handler in stood.items():
            signal.signal(number, handler)
    assert said == ['ended']

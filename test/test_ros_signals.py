"""Signals at any instant of a node's life: it ends with 0 and says no more than it should."""
from __future__ import annotations

import random
import signal
import time

import pytest
from geometry_msgs.msg import PoseArray
from peer import PATIENCE, start

pytestmark = pytest.mark.usefixtures('nothing_runs_on')


def imports(process):
    """Whether the process has got as far as this package."""
    with open(f'/proc/{process.pid}/status') as status:
        blocked = next(line for line in status if line.startswith('SigBlk'))
    return int(blocked.split()[1], 16) >> (signal.SIGINT - 1) & 1


def wait(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, 'not in time'


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


@pytest.mark.slow
def test_fifty_signals_at_random_instants(ros):
    draw = random.Random(2)
    for _ in range(50):
        process = start('node')
        wait(lambda process=process: imports(process))
        end = time.monotonic() + draw.uniform(0, 4)
        wait(lambda end=end: time.monotonic() > end)
        sent = time.monotonic()
        process.send_signal(draw.choice((signal.SIGINT, signal.SIGTERM)))
        code, _, errors = outcome(process)
        assert code == 0 and 'Traceback' not in errors
        assert time.monotonic() - sent < 2


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
    assert code == 0 and 'Traceback' not in errors
    assert time.monotonic() - sent < 5

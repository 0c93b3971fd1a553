"""The soak: what it calls growth, and that it runs."""
from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from conftest import light

from ragdoll_ros.ros.tools.soak import (
    CHANGES,
    MAX_GROWTH,
    SAMPLES,
    SCENES,
    WARM_UP,
    SoakSample,
    growth,
)

ROUND = SAMPLES // CHANGES * len(SCENES)


def samples(rate, wobble, hours=0.5, count=SAMPLES):
    """Of a process that takes 30 MB as it warms up, then ``rate`` MB an hour, and 2 MB for a while
    in each round of scenes.
    """
    rng = np.random.default_rng(3)
    times = np.linspace(0, 3600 * hours, count)
    warm = times / times[-1] / WARM_UP
    memory = (200 + 30 * np.minimum(1, warm) + rate * times / 3600 + wobble * rng.normal(size=count)
              + 2 * (np.arange(count) % ROUND < ROUND / 4))
    return [SoakSample(time, each, 16, 21) for time, each in zip(times, memory, strict=True)]


@pytest.mark.parametrize('rate', [0.0, 0.5, 2.0, 30.0])
def test_growth_is_what_memory_grows_by_once_it_is_warm(rate):
    found, error = growth(samples(rate, wobble=0.05))
    assert abs(found - rate) < 1.5 * error  # three sigma
    assert error < MAX_GROWTH / 2, 'else it could not tell'


@pytest.mark.slow
def test_a_short_soak_counts_hears_and_finds_nothing_bad(ros):
    """PyBullet will do, and 1000 ticks: whether memory grows they cannot tell, and say so."""
    done = subprocess.run(
        [sys.executable, '-m', 'ragdoll_ros.ros.tools.soak', '--ticks', '1000', '--seed', '4'],
        capture_output=True, text=True, timeout=120, env=light())
    assert done.returncode == 0, done.stderr
    *lines, last = [line for line in done.stdout.splitlines() if 'MB' in line]
    assert lines[-1].startswith('100%') and 'threads' in lines[-1]
    assert ', 0 bad; 0 bad states undone' in last and 'descriptors flat' in last
    assert 'too short' in last


def test_too_few_ticks_are_refused():
    done = subprocess.run([sys.executable, '-m', 'ragdoll_ros.ros.tools.soak', '--ticks', '7'],
                          capture_output=True, text=True, timeout=60, env=light())
    assert done.returncode == 2 and '--ticks 7: expected 1000 or more' in done.stderr

"""HIC15 and HIC36 against closed forms and against every pair of instants."""
import itertools
import math

import numpy as np
import pytest

from ragdoll_ros.model.errors import ModelError
from ragdoll_ros.physics.sensors.head_injury import (
    HIC15,
    HIC36,
    STANDARD_GRAVITY,
    half_sine_head_injury,
    head_injury_criterion,
)


def half_sine(peak, duration, rate):
    times = np.arange(round(duration * rate) + 1) / rate
    return peak * STANDARD_GRAVITY * np.sin(math.pi * times / duration).clip(0)


def by_every_pair(acceleration, rate, window):
    """The definition, pair by pair, with its integral by the trapezoidal rule."""
    g, best = [a / STANDARD_GRAVITY for a in acceleration], 0.0
    for first, last in itertools.combinations(range(len(g)), 2):
        span = (last - first) / rate
        if span <= window + 1e-12:
            area = sum((g[k] + g[k + 1]) / 2 for k in range(first, last)) / rate
            best = max(best, span * (area / span) ** 2.5)
    return best


@pytest.mark.parametrize(('duration', 'window'), [
    (0.006, HIC15), (0.02, HIC15), (0.02, HIC36), (0.04, HIC15), (0.04, HIC36), (0.1, HIC36)])
def test_a_half_sine_has_its_closed_form(duration, window):
    """0.41464 A^2.5 T (SAE 740082) unless the window cuts it, over a span of 0.6702 T."""
    sampled = head_injury_criterion(half_sine(100, duration, 1e5), 1e5, window)
    closed = half_sine_head_injury(100 * STANDARD_GRAVITY, duration, window)
    assert sampled == pytest.approx(closed, rel=1e-3)
    if 0.6702 * duration < window:
        assert closed == pytest.approx(0.41464 * 100 ** 2.5 * duration, rel=1e-4)
    spans = np.linspace(1e-6, min(window, duration), 20001)
    means = 100 * np.sin(math.pi * spans / (2 * duration)) / (math.pi * spans / (2 * duration))
    assert closed == pytest.approx((spans * means ** 2.5).max(), rel=1e-6)


def test_at_ten_kilohertz_as_heads_are_sampled():
    sampled = head_injury_criterion(half_sine(80, 0.012, 1e4), 1e4)
    assert sampled == pytest.approx(
        half_sine_head_injury(80 * STANDARD_GRAVITY, 0.012), rel=1e-3)


@pytest.mark.parametrize('window', [HIC15, HIC36])
def test_a_ragged_pulse_is_that_of_every_pair(window):
    """Several peaks and noise, at 2 kHz."""
    rng, times = np.random.default_rng(15), np.arange(120) / 2000
    pulse = sum(a * np.exp(-((times - t) / w) ** 2) for a, t, w in (
        (900, 0.012, 0.003), (600, 0.024, 0.006), (1200, 0.045, 0.001)))
    pulse = np.abs(pulse + 40 * rng.standard_normal(len(times)))
    assert head_injury_criterion(pulse, 2000, window) == pytest.approx(
        by_every_pair(pulse.tolist(), 2000, window), rel=1e-9)


def test_a_constant_acceleration_and_none():
    assert head_injury_criterion([50 * STANDARD_GRAVITY] * 1000, 1e4, HIC15) == pytest.approx(
        0.015 * 50 ** 2.5)
    assert head_injury_criterion([500.0], 1e4) == 0.0
    assert head_injury_criterion([0.0] * 9, 1e4) == 0.0


@pytest.mark.parametrize(('acceleration', 'rate', 'window'), [
    ([], 1e4, HIC15), ([[1.0]], 1e4, HIC15), ([1.0, math.nan], 1e4, HIC15), ([-1.0, 1.0], 1e4, 0.1),
    ([1.0, 2.0], 0, HIC15), ([1.0, 2.0], 1e4, -1), ([1.0, 2.0], math.nan, HIC15)])
def test_bad_input_is_named(acceleration, rate, window):
    with pytest.raises(ModelError):
        head_injury_criterion(acceleration, rate, window)

"""The head injury criterion (49 CFR 571.208), of samples and of a half-sine pulse.

HIC is the largest (t2 - t1) (mean of a from t1 to t2)^2.5, in seconds and multiples of standard
gravity, for t2 - t1 up to a window: 15 ms for HIC15, 36 ms for HIC36.
"""
import math
from collections.abc import Sequence

import numpy as np

from ...model import errors

STANDARD_GRAVITY = 9.80665
"""m/s^2."""

HIC15, HIC36 = 0.015, 0.036
"""s: windows."""

BEST_PHASE = 1.0527942937698702
"""rad: half the phase of a half-sine over which its criterion is largest; tan x = 5 x / 3."""

MAX_SAMPLES = 10 ** 7


def head_injury_criterion(acceleration: Sequence[float] | np.ndarray, rate: float,
                          window: float = HIC15) -> float:
    """Head injury criterion of a sampled pulse; between samples the acceleration is linear.

    Args:
        acceleration: (t,) m/s^2, magnitude of that of the head's centre of mass.
        rate: samples per second, Hz.
        window: longest t2 - t1, s: 0.015 for HIC15, 0.036 for HIC36.

    Returns:
        The criterion, s g^2.5; t1 and t2 are samples.

    Raises:
        NotFinite, OutOfRange, WrongForm: an argument is not valid.

    Example:
        >>> round(head_injury_criterion([980.665] * 101, rate=10000), 1)  # 100 g for 10 ms
        1000.0
    """
    errors.check_range('rate', rate, 1e-3, 1e9)
    errors.check_range('window', window, 0.0, 1e3)
    samples = np.asarray(acceleration, float)
    if samples.ndim != 1 or not 0 < len(samples) <= MAX_SAMPLES:
        raise errors.WrongForm('acceleration', samples.shape, 'a list of numbers')
    if not np.isfinite(samples).all() or samples.min() < 0:
        raise errors.NotFinite('acceleration', f'{samples.min()} to {samples.max()}',
                               'finite magnitudes, 0 or more')
    g = samples / STANDARD_GRAVITY
    integral = np.concatenate([[0.0], np.cumsum((g[1:] + g[:-1]) / 2)]) / rate
    longest = min(len(g) - 1, math.floor(window * rate * (1 + 1e-12)))
    gained = [(integral[lag:] - integral[:-lag]).max() for lag in range(1, longest + 1)]
    spans = np.arange(1, longest + 1) / rate
    return float((spans ** -1.5 * np.array(gained) ** 2.5).max(initial=0.0))


def half_sine_head_injury(peak: float, duration: float, window: float = HIC15) -> float:
    """Head injury criterion, s g^2.5, of a half-sine pulse of ``peak``, m/s^2, and ``duration``, s.

    Over the middle 2 x / pi of it the mean is peak (sin x) / x: the criterion is 2 x T / pi times
    that to the power 2.5, largest where tan x = 5 x / 3, unless the window is shorter.
    """
    phase = min(BEST_PHASE, math.pi * window / (2 * duration))
    mean = peak / STANDARD_GRAVITY * math.sin(phase) / phase
    return 2 * phase * duration / math.pi * mean ** 2.5

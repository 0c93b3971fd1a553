"""KeyTrack: a translation, rotation or scale over time by its keys, and its derivative.

The derivative is that of the interpolation: constant between LINEAR keys (of rotations, the angular
velocity is), zero for STEP keys, that of the spline for CUBICSPLINE keys; at a key, the mean of
both sides. Before its first key and after its last, a track is constant.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..model import rotation

KEY_TOLERANCE = 1e-6
"""s, within which an instant is that of a key: times of keys are float32."""

@dataclass(frozen=True)
class KeyTrack:
    """A translation, rotation or scale over time: k keys of w numbers.

    ``times`` (k,) s, increasing; ``values`` (k, 3, w) are in-tangent, value, out-tangent; tangents
    are those of CUBICSPLINE, per s.
    """

    times: np.ndarray
    values: np.ndarray
    interpolation: str
    is_rotation: bool

    @classmethod
    def sampled(cls, times: np.ndarray, values: np.ndarray, is_rotation: bool) -> KeyTrack:
        """Return a smooth motion through samples (k, w) at equal steps: a cubic spline, whose
        slopes are centred differences of order 4, near the ends of order 2. Fewer than three
        samples are LINEAR keys.
        """
        if len(times) < 3:
            keys = np.pad(values[:, None], ((0, 0), (1, 1), (0, 0)))
            return cls(times, keys, 'LINEAR', is_rotation)
        return cls(times, _splined(times, values, is_rotation), 'CUBICSPLINE', is_rotation)

    def at(self, times: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Values (..., w) at ``times`` (...) s, and their derivatives per s; a rotation's values
        are unit quaternions.
        """
        value, rate = self._at(np.ravel(times).astype(float))
        shape = (*np.shape(times), value.shape[1])
        return value.reshape(shape), rate.reshape(shape)

    def _at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (t, w) at ``times`` (t,), and their derivatives."""
        last = len(self.times) - 1
        after = np.searchsorted(self.times, times).clip(0, last)
        before = np.maximum(after - 1, 0)
        key = np.where(np.abs(self.times[before] - times) < np.abs(self.times[after] - times),
                       before, after)
        near = np.abs(self.times[key] - times) <= KEY_TOLERANCE
        times = np.where(near, self.times[key], times)
        outside = (times < self.times[0]) | (times > self.times[-1])
        times = times.clip(self.times[0], self.times[-1])
        if last == 0:
            return self._unit(self.values[key, 1], np.zeros_like(self.values[key, 1]))
        value, rate = self._between(
            (np.searchsorted(self.times, times, side='right') - 1).clip(0, last - 1), times)
        other, change = self._between(
            (np.searchsorted(self.times, times) - 1).clip(0, last - 1), times)
        if self.is_rotation:
            # A slerp may end in the negative of the quaternion at which the next one begins.
            change = change * np.where(np.sum(value * other, axis=1) < 0, -1.0, 1.0)[:, None]
        return value, np.where(outside[:, None], 0.0, (rate + change) / 2)

    def _between(self, first: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and derivatives within the intervals after the keys ``first`` (t,), their ends
        included.
        """
        length = (self.times[first + 1] - self.times[first])[:, None]
        share = (times - self.times[first])[:, None] / length
        begin, leave = self.values[first, 1], self.values[first, 2]
        arrive, end = self.values[first + 1, 0], self.values[first + 1, 1]
        if self.interpolation == 'STEP':
            return self._unit(np.where(share >= 1, end, begin), np.zeros_like(begin))
        if self.interpolation == 'CUBICSPLINE':
            powers = np.concatenate([np.ones_like(share), share, share ** 2, share ** 3], axis=1)
            slopes = np.concatenate([np.zeros_like(share), np.ones_like(share), 2 * share,
                                     3 * share ** 2], axis=1) / length
            points = HERMITE @ np.stack([begin, length * leave, end, length * arrive], axis=1)
            return self._unit(*(np.einsum('ti,tiw->tw', each, points)
                                for each in (powers, slopes)))
        if self.is_rotation:
            return _slerp(begin, end, share, length)
        return begin + share * (end - begin), (end - begin) / length

    def _unit(self, values: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations' values as unit quaternions, with their derivatives; others as they are."""
        if not self.is_rotation:
            return values, rates
        norms = np.linalg.norm(values, axis=1, keepdims=True)
        small = norms < 1e-9
        unit = np.where(small, rotation.IDENTITY, values / np.where(small, 1.0, norms))
        along = np.sum(unit * rates, axis=1, keepdims=True)
        return unit, np.where(small, 0.0, (rates - unit * along) / np.where(small, 1.0, norms))


HERMITE = np.array(((1.0, 0, 0, 0), (0, 1, 0, 0), (-3, -2, 3, -1), (2, 1, -2, 1)))
"""Coefficients of 1, s, s^2, s^3 of a cubic: of its value and slope at 0, and at 1."""


def _slerp(begin: np.ndarray, end: np.ndarray, share: np.ndarray,
           length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quaternions (t, 4) on the shorter arcs, at constant speed, and their derivatives; ``share``
    and ``length`` (t, 1).
    """
    begin = rotation.normalized(begin)
    arc = rotation.rotation_vector(rotation.multiply(
        rotation.inverse(begin), rotation.normalized(end)))
    value = rotation.multiply(begin, rotation.from_rotation_vector(share * arc))
    return value, rotation.multiply(value, np.append(arc / (2 * length), np.zeros_like(length),
                                                     axis=1))


def _splined(times: np.ndarray, values: np.ndarray, is_rotation: bool) -> np.ndarray:
    """In-tangent, value and out-tangent (k, 3, w) of a spline through samples (k, w)."""
    if is_rotation:
        # q and -q are the same rotation: from key to key the nearer one.
        turns = np.sum(values[1:] * values[:-1], axis=1) < 0
        values = values * np.append(1.0, np.where(turns, -1.0, 1.0).cumprod())[:, None]
    step = (times[-1] - times[0]) / (len(times) - 1)
    slopes = np.gradient(values, step, axis=0, edge_order=2)
    slopes[2:-2] = (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * step)
    return np.stack([slopes, values, slopes], axis=1)

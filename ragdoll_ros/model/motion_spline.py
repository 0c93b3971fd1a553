"""MotionSpline: the coordinates of a doll over time, as an animation has them."""
from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import errors, rotation
from .dof_layout import DofLayout, GeneralizedState
from .pose import Pose

STRAIGHT = 1e-9
"""rad: a smaller turn in a repetition is none."""


@dataclass(frozen=True, eq=False)
class MotionSpline:
    """Coordinates of one doll over time, in its own frame: cubic Hermite splines through samples.

    Velocities are the derivatives of these splines, which are continuous. An angle stays within
    its limits; its rate is zero where the spline would leave them.

    Args:
        layout: of q and v of the doll alone.
        times: (k,) s, increasing from 0.
        q: (k, nq) of the samples.
        derivatives: (k, nq) of q, per s.
    """

    layout: DofLayout
    times: np.ndarray
    q: np.ndarray
    derivatives: np.ndarray

    @classmethod
    def sampled(cls, layout: DofLayout, times: np.ndarray,
                samples: list[GeneralizedState]) -> MotionSpline:
        """The motion through these coordinates and velocities at ``times`` (k,) s."""
        q = layout.continued(np.array([sample.q for sample in samples]))
        return cls(layout, times, q, np.array([
            layout.derivatives(GeneralizedState(row, sample.v))
            for row, sample in zip(q, samples, strict=True)]))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MotionSpline) and all(
            np.array_equal(getattr(self, key), getattr(other, key))
            for key in ('times', 'q', 'derivatives'))

    def __hash__(self) -> int:
        return hash(self.times.tobytes())

    def __repr__(self) -> str:
        return f'MotionSpline of {self.duration:g} s'

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return float(self.times[-1])

    @cached_property
    def _advance(self) -> tuple[complex, float]:
        """Translation x + iy, m, and turn about z, rad, that take the root from where it begins to
        where it ends; height and tilt are not in it.
        """
        at, turned = self.layout.root_positions[0], self.layout.root_orientations[0]
        begin, end = (complex(*self.q[k][at][:2]) for k in (0, -1))
        whole = rotation.multiply(self.q[-1][turned], rotation.inverse(self.q[0][turned]))
        turn = math.remainder(2 * math.atan2(whole[2], whole[3]), 2 * math.pi)
        return end - _turned(begin, turn), turn

    def repeated(self, count: int) -> Pose:
        """Pose of the motion's frame after ``count`` repetitions, each of which begins where the
        one before ended and faces as that did; height and tilt are those of the beginning.
        """
        step, turn = self._advance
        if abs(turn) < STRAIGHT:
            moved, turn = count * step, 0.0
        else:
            # The sum of step turned by 0, turn, ... (count - 1) turn.
            sines = [rotation.sine_and_cosine(n * turn / 2)[0] for n in (count, 1)]
            moved = _turned(step * sines[0] / sines[1], (count - 1) * turn / 2)
        return Pose(np.array([moved.real, moved.imag, 0.0]),
                    rotation.from_axis_angle((0.0, 0.0, 1.0), count * turn))

    def at(self, time: float) -> GeneralizedState:
        """Coordinates and velocities at ``time`` s. Raises OutOfRange."""
        errors.check_range('time', time, 0.0, self.duration)
        last = max(0, len(self.times) - 2)
        first = min(max(0, int(np.searchsorted(self.times, time, side='right')) - 1), last)
        q, derivatives = self.q[first], self.derivatives[first]
        if len(self.times) > 1:
            q, derivatives = self._between(first, time)
        norms, layout = _norms(self.layout, q), self.layout
        q, derivatives = q / norms, derivatives / norms
        v = layout.velocities(q, derivatives)
        at, rates = layout.limited
        bounded = np.clip(q[at], *layout.limits)
        v[rates[bounded != q[at]]] = 0.0
        q[at] = bounded
        return GeneralizedState(q, v)

    def _between(self, first: int, time: float) -> tuple[np.ndarray, np.ndarray]:
        """The spline and its derivative in the interval after sample ``first``."""
        length = float(self.times[first + 1] - self.times[first])
        s = (time - float(self.times[first])) / length
        begin, end = self.q[first], self.q[first + 1]
        leave, arrive = length * self.derivatives[first], length * self.derivatives[first + 1]
        rise = end - begin
        bend, twist = 3 * rise - 2 * leave - arrive, leave + arrive - 2 * rise
        return (begin + s * (leave + s * (bend + s * twist)),
                (leave + s * (2 * bend + s * 3 * twist)) / length)


def _turned(place: complex, angle: float) -> complex:
    """Turn x + iy by an angle, rad."""
    sine, cosine = rotation.sine_and_cosine(angle)
    return place * complex(cosine, sine)


def _norms(layout: DofLayout, q: np.ndarray) -> np.ndarray:
    """(nq,) lengths of the quaternions in q, each in all of its four places; 1 elsewhere."""
    norms = np.ones(len(q))
    norms[layout.quaternions] = np.linalg.norm(q[layout.quaternions], axis=1, keepdims=True)
    return norms

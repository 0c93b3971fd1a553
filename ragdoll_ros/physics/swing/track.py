"""Track: bone states at ticks, interpolated between them."""
import bisect

import numpy as np

from ...model import rotation
from ...model.state import State


class Track:
    """States of bones over the last ``memory`` s; track(time) interpolates them.

    Interpolation is cubic Hermite: of positions with the linear velocities, of orientations by a
    rotation vector whose rates at both ends are the angular velocities. Its error is of fourth
    order in the tick; velocities are those of the path. Whole turns between two states are chosen
    by the angular velocities. Before the first and after the last state it is constant.
    """

    def __init__(self, memory: float = 0.02) -> None:
        self._memory = memory
        self._times: list[float] = []
        self._states: list[State] = []

    def add(self, time: float, state: State) -> None:
        """Add the state at ``time`` s; a time not later than the last restarts the track."""
        if self._times and time <= self._times[-1]:
            self._times.clear()
            self._states.clear()
        old = max(bisect.bisect_right(self._times, time - self._memory) - 1, 0)
        del self._times[:old], self._states[:old]
        self._times.append(time)
        self._states.append(state)

    def __call__(self, time: float) -> State:
        """State at ``time`` s."""
        index = bisect.bisect_left(self._times, time)
        if index == len(self._times):
            return self._states[-1]
        if index == 0 or self._times[index] == time:
            return self._states[index]
        begin, end = self._times[index - 1], self._times[index]
        return between(self._states[index - 1], self._states[index], end - begin,
                       (time - begin) / (end - begin))


def between(first: State, last: State, span: float, part: float) -> State:
    """State at fraction ``part`` (0 to 1) of the path of ``span`` s between two states."""
    positions, linear = _hermite(first.positions, last.positions, first.linear_velocities,
                                 last.linear_velocities, span, part)
    turn = _turn(first, last, span)
    zero = np.zeros_like(turn)
    ending = _rate_of_vector(turn, last.angular_velocities)
    vector, rate = _hermite(zero, turn, first.angular_velocities, ending, span, part)
    orientations = rotation.multiply(rotation.from_rotation_vector(vector), first.orientations)
    return State(positions, orientations, linear, _rate_of_turn(vector, rate))


def _hermite(a: np.ndarray, b: np.ndarray, a_rate: np.ndarray, b_rate: np.ndarray,
             span: float, part: float) -> tuple[np.ndarray, np.ndarray]:
    """Cubic Hermite interpolation of a and b with these rates, and its rate."""
    s, change = part, (b - a) / span
    value = (a + span * s * (a_rate * (1 - s) ** 2 + change * s * (3 - 2 * s)
                             - b_rate * s * (1 - s)))
    rate = a_rate * (1 - s) * (1 - 3 * s) + change * 6 * s * (1 - s) + b_rate * s * (3 * s - 2)
    return value, rate


def _turn(first: State, last: State, span: float) -> np.ndarray:
    """Rotation vectors (n, 3) rad from the first orientations to the last, with whole turns."""
    turn = rotation.multiply(last.orientations, rotation.inverse(first.orientations))
    vector = rotation.rotation_vector(turn)
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    mean = (first.angular_velocities + last.angular_velocities) * (span / 2)
    if not np.any(np.einsum('ij,ij->i', mean, mean) > 1):
        return vector
    speed = np.linalg.norm(mean, axis=1, keepdims=True)
    axis = np.where(angle > 1e-12, vector, mean) / np.where(angle > 1e-12, angle, speed + 1e-300)
    wanted = np.sum(mean * axis, axis=1, keepdims=True)
    return axis * (angle + 2 * np.pi * np.round((wanted - angle) / (2 * np.pi)))


def _rate_of_turn(vector: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Angular velocities of rotation vectors with these rates: the left Jacobian of SO(3).

    Barfoot, State Estimation for Robotics, 2017, eq. 7.77.
    """
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    half = angle / 2
    first = np.sinc(half / np.pi) ** 2 / 2
    small = angle < 1e-3
    safe = np.where(small, 1, angle)
    second = np.where(small, 1 / 6 - angle ** 2 / 120, (safe - np.sin(safe)) / safe ** 3)
    once = np.cross(vector, rate)
    return rate + first * once + second * np.cross(vector, once)


def _rate_of_vector(vector: np.ndarray, angular: np.ndarray) -> np.ndarray:
    """Rates of rotation vectors with these angular velocities: the inverse left Jacobian, eq. 7.76.

    Beyond 1.5 pi, near its singularity, the angular velocity itself.
    """
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    half = angle / 2
    usable = angle < 1.5 * np.pi
    safe = np.where((angle > 1e-3) & usable, half, 1)
    factor = np.where(angle > 1e-3, (1 - safe / np.tan(safe)) / (4 * safe ** 2), 1 / 12)
    once = np.cross(vector, angular)
    exact = angular - once / 2 + factor * np.cross(vector, once)
    return np.where(usable, exact, angular)

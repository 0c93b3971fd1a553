"""Event-driven integration of planar rods with feet: contact events located, impacts solved.

Between events DOP853 at 1e-12 with fixed contact modes (contact_modes.py). Events are a touch-down,
a lift-off, the begin and the end of sliding. At a touch-down all closed feet obey Newton's law, by
which w_n becomes -e times itself, and Moreau's friction law.
"""
from collections.abc import Callable, Iterator

import numpy as np

from . import contact_modes as modes_of
from .contact_modes import BACKWARD, FORWARD, OPEN, SIGNS, STICK
from .integration import TOLERANCE
from .planar_rods import PlanarRods

MAX_STEP = 1e-3
"""Maximum step, s: a penetration within a step is missed, up to 12 um at 100 m/s^2."""

TOUCH = 1e-14
"""m: depth at which a touch-down is detected; afterwards the gap is projected to 0."""

STILL = 1e-6
"""m/s: slower feet in contact are stopped, which ends infinite sequences of alternate impacts."""

CLOSED = 1e-9
"""m and m/s: tolerance of a closed contact, and of one that does not slide."""

MAX_PENETRATION = 1e-6
"""m: undetected penetration that is an error."""

MAX_EVENTS = 2000
"""More are an error."""

Hint = dict[int, tuple[str, ...]]
"""Possible modes of the foot after its event."""

Event = Callable[[float, np.ndarray], float]


def rows(figure: PlanarRods, y: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Coordinates and velocities (t, 2 (n + 2)) at ``times`` s, from ``y`` at the first."""
    rows, now, hint = np.empty((len(times), len(y))), float(times[0]), {}
    for _ in range(MAX_EVENTS):
        closed = np.abs(figure.gaps(y)) <= CLOSED
        y = _at_rest(figure, _after_impact(figure, _projected(figure, y, closed), closed), closed)
        resting = closed & (np.abs(figure.contact(y)[0] @ figure.speeds(y))[:, 0] <= CLOSED)
        modes = _modes(figure, y, resting, hint)
        solved, hint = _until_event(figure, now, float(times[-1]), y, modes)
        inside = (times >= now) & (times <= solved.t[-1])
        if inside.any():
            rows[inside] = solved.sol(times[inside]).T
        now, y = float(solved.t[-1]), solved.y[:, -1]
        if now >= times[-1]:
            return rows
    raise ArithmeticError(f'more than {MAX_EVENTS} events up to {now} s')


def _projected(figure: PlanarRods, y: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Project the gaps of closed feet to 0 m, in the metric of the mass matrix."""
    if not closed.any():
        return y
    mass, _ = figure.dynamics(y)
    normals = figure.contact(y)[0][closed, 0]
    mobile = np.linalg.solve(mass, normals.T)
    lift = mobile @ np.linalg.lstsq(normals @ mobile, -figure.gaps(y)[closed], rcond=1e-12)[0]
    return np.concatenate([y[:len(lift)] + lift, y[len(lift):]])


def _after_impact(figure: PlanarRods, y: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Apply the impact impulses of closed feet; unchanged if none approaches the ground."""
    jacobian, speeds = figure.contact(y)[0][closed], figure.speeds(y)
    before = jacobian @ speeds
    if not (before[:, 0] < 0).any():
        return y
    mass, _ = figure.dynamics(y)
    bounce = np.where(before[:, 0] < -figure.restitution_speed, 1 + figure.restitution, 1.0)
    free = before * np.stack([bounce, np.ones(len(bounce))], axis=1)
    options = [modes_of.choices(figure.friction)] * len(free)
    _, impulses = modes_of.solve(mass, jacobian, free, figure.friction, options)
    change = np.linalg.solve(mass, np.einsum('kdj,kd->j', jacobian, impulses))
    return np.concatenate([y[:len(change)], speeds + change])


def _at_rest(figure: PlanarRods, y: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Set velocities of closed feet below STILL to 0, in the metric of the mass matrix."""
    speeds, rows = figure.speeds(y), figure.contact(y)[0][closed]
    rows = (rows if figure.friction > 0 else rows[:, :1]).reshape(-1, len(speeds))
    rows = rows[np.abs(rows @ speeds) < STILL]
    mobile = np.linalg.solve(figure.dynamics(y)[0], rows.T)
    change = mobile @ np.linalg.lstsq(rows @ mobile, -rows @ speeds, rcond=1e-12)[0]
    return np.concatenate([y[:len(change)], speeds + change])


def _modes(figure: PlanarRods, y: np.ndarray, resting: np.ndarray, hint: Hint) -> tuple[str, ...]:
    """Modes of all feet after an event; ``hint`` restricts those of the foot of the event."""
    places, modes = np.flatnonzero(resting), [OPEN] * len(figure.feet)
    if not len(places):
        return tuple(modes)
    mass, force = figure.dynamics(y)
    jacobian, drift = (array[places] for array in figure.contact(y))
    along = (jacobian @ figure.speeds(y))[:, 1]
    slides = np.abs(along) > CLOSED
    options = [hint.get(int(place), _options(figure, speed)) for place, speed in
               zip(places, along, strict=True)]
    free = jacobian @ np.linalg.solve(mass, force) + drift
    found, _ = modes_of.solve(mass, jacobian, free, figure.friction, options, slides)
    for place, mode in zip(places, found, strict=True):
        modes[place] = mode
    return tuple(modes)


def _options(figure: PlanarRods, along: float) -> tuple[str, ...]:
    """Possible modes of a closed foot that slides at ``along`` m/s."""
    if abs(along) <= CLOSED or FORWARD not in modes_of.choices(figure.friction):
        return modes_of.choices(figure.friction)
    return (OPEN, FORWARD if along > 0 or figure.friction == 0 else BACKWARD)


def _until_event(figure: PlanarRods, begin: float, end: float, y: np.ndarray,
                 modes: tuple[str, ...]) -> tuple[object, Hint]:
    """Solution up to the next event, and the possible modes of its foot afterwards."""
    from scipy.integrate import solve_ivp

    def derivative(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([figure.speeds(y), figure.forces(y, modes)[0]])

    events, hints = [], []
    for foot, mode in enumerate(modes):
        for event, after in _events(figure, foot, mode, modes):
            event.terminal, event.direction = True, -1
            events.append(event)
            hints.append({foot: after} if after else {})
    solved = solve_ivp(derivative, (begin, end), y, 'DOP853', dense_output=True, events=events,
                       rtol=TOLERANCE, atol=TOLERANCE, max_step=MAX_STEP)
    if not solved.success or min(figure.gaps(row).min() for row in solved.y.T) < -MAX_PENETRATION:
        raise ArithmeticError(f'a touch-down was missed between {begin} and {solved.t[-1]} s')
    met = [hint for hint, found in zip(hints, solved.t_events, strict=True) if len(found)]
    return solved, met[0] if met else {}


def _events(figure: PlanarRods, foot: int, mode: str, modes: tuple[str, ...],
            ) -> Iterator[tuple[Event, tuple[str, ...]]]:
    """Yield the events that end a foot's mode, as functions that fall through 0, each with the
    possible modes afterwards.
    """
    def gap(_: float, y: np.ndarray) -> float:
        return figure.gaps(y)[foot] + TOUCH

    def pressure(_: float, y: np.ndarray) -> float:
        return figure.forces(y, modes)[1][foot, 0]

    def slip(_: float, y: np.ndarray) -> float:
        return SIGNS[mode] * (figure.contact(y)[0][foot, 1] @ figure.speeds(y))

    def grip(way: str) -> Event:
        def left(_: float, y: np.ndarray) -> float:
            normal, along = figure.forces(y, modes)[1][foot]
            return figure.friction * normal + SIGNS[way] * along
        return left
    if mode == OPEN:
        yield gap, ()
        return
    yield pressure, (OPEN,)
    if mode == STICK:
        yield grip(FORWARD), (FORWARD,)
        yield grip(BACKWARD), (BACKWARD,)
    elif mode in SIGNS and figure.friction > 0:
        yield slip, tuple(other for other in modes_of.MODES if other != mode)

"""Grabs: hands that hold points of bones by springs of limited force.

A hand is where it was told to be, reached evenly, so that twenty pointer events a second do not
jerk. Between it and the point it holds is a spring of stiffness k = M w^2 with the damping
c = 2 M w, M the doll's mass: hung by it, the doll is critically damped and sags by g / w^2.
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import errors
from ..model.coordinates import GeneralizedState
from ..model.scene import Scene
from ..model.state import State
from ..model.vectors import Vector, floats
from .engine.protocol import AppliedWrench
from .flight import Dynamics
from .motion import point_motion
from .plain.mechanics import Mechanics

FREQUENCY = 30.0
"""rad/s, w: a doll follows within 0.2 s (e^-6 of the way is left) and sags by 11 mm."""

LARGEST_PULL = 2000.0
"""N that a hand pulls with at the most."""

LARGEST_ACCELERATION = 40.0
"""m/s^2 that a hand may give a whole doll: four times its weight. Light dolls get no more."""

LONGEST = 2.5e-3
"""s for which a hand's force stays as it is."""

FRESH = 5e-3
"""s for which a bone is taken to be as mobile, along its own axes, as it was."""

REACH = 2.0
"""Distances of a bone's centre from its farthest corner within which a hand may hold it: a skin
is wider than its bones, but a lever of any length would break joints."""

FARTHEST = 1e6
"""m from the world's origin that a hand may be."""

MOST_HANDS = 20
"""Hands that may hold something at once; one more is refused."""

EVENLY = 0.05
"""s within which a hand gets where it shall be: the time between two of 20 events a second."""


@dataclass(frozen=True)
class Grab:
    """What a hand holds: a ``point`` (m, from the bone's centre of mass along the bone's axes),
    and the ``target`` (m, world) that the hand was told to be at.
    """

    hand: str
    bone: str
    point: Vector
    target: Vector


class Pull(AppliedWrench):
    """The load of a hand."""


@dataclass
class _Hand:
    """A hand that holds something, and the way it still has to go."""

    bone: int
    point: np.ndarray
    position: np.ndarray
    target: np.ndarray
    left: float = 0.0
    """s until it is at its target."""
    mobility: np.ndarray | None = None
    """(3, 3) 1/kg of the point, along the bone's axes."""
    fresh: float = 0.0
    """s for which that is taken for granted."""

    def after(self, duration: float) -> np.ndarray:
        """Position (3,) m after ``duration`` s."""
        if duration >= self.left:
            return self.target
        return self.position + (self.target - self.position) * (duration / self.left)

    def move(self, duration: float) -> None:
        self.position = self.after(duration)
        self.left = max(0.0, self.left - duration)
        self.fresh -= duration


class Hands:
    """All hands of a scene that hold something; false if there is none."""

    def __init__(self, scene: Scene, mechanics: Mechanics) -> None:
        self._scene = scene
        self._doll_of = mechanics.doll_of
        self._gravity = mechanics.gravity
        self._masses = mechanics.doll_masses
        self._hands: dict[str, _Hand] = {}

    def __bool__(self) -> bool:
        return bool(self._hands)

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """What is held, the longest held first."""
        return tuple(Grab(name, self._scene.bone_names[hand.bone], tuple(hand.point.tolist()),
                          tuple(hand.target.tolist())) for name, hand in self._hands.items())

    def grab(self, name: str, bone: str, point: Sequence[float],
             target: Sequence[float] | None, state: State) -> None:
        """Let a hand hold a point of a bone. Raises UnknownBone, NotFinite or OutOfRange."""
        index = self._scene.bone_index(bone)
        held = np.array(_checked('point', point))
        reach = REACH * math.hypot(*self._scene.bones[index].shape.half_extents)
        if math.hypot(*held) > reach:
            raise errors.OutOfRange('point', point, f'at most {reach:.3g} m from the centre')
        now, _ = point_motion(state, index, held)
        aim = now if target is None else np.array(_checked('target', target))
        self.let_go(name)
        if len(self._hands) >= MOST_HANDS:
            raise errors.OutOfRange('hands', MOST_HANDS + 1, f'at most {MOST_HANDS}')
        self._hands[name] = _Hand(index, held, now, aim, 0.0 if target is None else EVENLY)

    def drag(self, name: str, target: Sequence[float], within: float) -> None:
        """Move a hand; one that holds nothing holds nothing still."""
        aim = np.array(_checked('target', target))
        errors.check_range('within', within, 0.0, 1e6)
        if name in self._hands:
            hand = self._hands[name]
            hand.target, hand.left = aim, within

    def let_go(self, name: str) -> None:
        """Open a hand."""
        self._hands.pop(name, None)

    def stretch(self, duration: float) -> float:
        """Length, s, of the first of equal stretches short enough for a steady force."""
        return duration / math.ceil(duration / LONGEST - 1e-6)

    def move(self, duration: float) -> None:
        """Let all hands go on by ``duration`` s."""
        for hand in self._hands.values():
            hand.move(duration)

    def pulls(self, dynamics: Dynamics, coordinates: GeneralizedState, state: State,
              duration: float) -> list[Pull]:
        """Loads of all hands for the next ``duration`` s; ``dynamics``: see mobility()."""
        for hand in self._hands.values():
            if hand.fresh <= 0:
                turn = state.rotation_matrices[hand.bone]
                hand.mobility = turn.T @ mobility(
                    dynamics, coordinates, hand.bone, hand.point) @ turn
                hand.fresh = FRESH
        dolls = [self._doll_of[hand.bone] for hand in self._hands.values()]
        return [self._pull(hand, dolls.count(doll), self._masses[doll], state, duration)
                for hand, doll in zip(self._hands.values(), dolls, strict=True)]

    def _pull(self, hand: _Hand, sharing: int, mass: float, state: State, h: float) -> Pull:
        """Pull of a spring and damper at the end of the step that it makes (backward Euler).

        f = -k (x + h u' - x_hand) - c (u' - u_hand), u' = u + h (g + W f), W the mobility: all
        of a doll falls with g, whatever its joints. Stable for any h, as the hand never does
        more than bring the point where it shall be. Hands that share a doll see W times their
        number, as their pulls add up.
        """
        stiffness, damping = mass * FREQUENCY ** 2, 2 * mass * FREQUENCY
        turn = state.rotation_matrices[hand.bone]
        place, velocity = point_motion(state, hand.bone, hand.point)
        velocity = velocity + h * self._gravity
        end = hand.after(h)
        force = -(stiffness * (place + h * velocity - end)
                  + damping * (velocity - (end - hand.position) / h))
        yielding = turn @ hand.mobility @ turn.T
        softened = np.eye(3) + h * (damping + h * stiffness) * sharing * yielding
        force = np.linalg.solve(softened, force)
        most = min(LARGEST_PULL, LARGEST_ACCELERATION * mass)
        force *= min(1.0, most / max(np.linalg.norm(force), 1e-300))
        return Pull(hand.bone, force, np.zeros(3), hand.point)


def mobility(dynamics: Dynamics, coordinates: GeneralizedState, bone: int,
             point: np.ndarray) -> np.ndarray:
    """Acceleration (3, 3) 1/kg of a point of a bone per force there: W = J H^-1 J^T.

    The inverse of the operational space inertia (Khatib 1987), got column by column from the
    accelerations under unit forces. ``dynamics`` know no contacts and limits, which would take
    some of it away: a hand that counts on more is the gentler.
    """
    still = GeneralizedState(coordinates.q, np.zeros_like(coordinates.v))
    rest = dynamics.acceleration(still)
    columns = []
    for axis in np.eye(3):
        gained = dynamics.acceleration(still,
                                       [AppliedWrench(bone, axis, np.zeros(3), point)]) - rest
        moved = dynamics.state(GeneralizedState(coordinates.q, gained))
        columns.append(point_motion(moved, bone, point)[1])
    return np.array(columns).T


def _checked(name: str, values: Sequence[float]) -> Vector:
    values = floats(values)
    errors.check_finite(name, values)
    if len(values) != 3 or max(map(abs, values)) > FARTHEST:
        raise errors.OutOfRange(name, values, f'three numbers (m) up to {FARTHEST:g}')
    return values

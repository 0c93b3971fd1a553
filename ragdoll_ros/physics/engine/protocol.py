"""What an engine must be able to do. Everything is SI, world frame, quaternions x, y, z, w."""
from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...model import errors
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.state import State
from ..accuracy import Accuracy
from ..motion import Motion

GROUND = -1
"""Index that stands for the ground where a bone's would stand."""

PRESSED = 0.025
"""Overlap, as a share of half the thinnest bone's thickness, up to which bones rest or slide on
each other where a motion starts. What overlaps by more was put there, and would burst apart."""


class MissingEngine(errors.RagdollError):
    """An engine whose library is not installed, or does not work here."""


@dataclass(frozen=True)
class Contacts:
    """All c points at which two things touch: bone ``a`` with bone ``b``, or with the GROUND."""

    a: np.ndarray
    """(c,) indices of bones."""
    b: np.ndarray
    """(c,) those of others, or GROUND."""
    positions: np.ndarray
    """(c, 3) m on a's surface."""
    normals: np.ndarray
    """(c, 3) of length one, from b to a."""
    depths: np.ndarray
    """(c,) m; negative: a gap."""
    forces: np.ndarray
    """(c,) N along the normal in the last substep."""

    def __len__(self) -> int:
        return len(self.a)

    @classmethod
    def of(cls, rows: Sequence[Sequence[float]]) -> Contacts:
        """From rows (c, 10) of all these side by side."""
        table = np.array(rows, float).reshape(-1, 10)
        a, b = table[:, :2].T.astype(np.int64)
        return cls(a, b, table[:, 2:5], table[:, 5:8], table[:, 8], table[:, 9])


@dataclass(frozen=True)
class AppliedWrench:
    """A force (3,) N and a torque (3,) N m on a bone, for one step.

    ``point`` (3,) m is where the force attacks, from the bone's centre of mass along the bone's
    own axes. ``local``: so are force and torque, else they are along the world's.
    """

    bone: int
    force: np.ndarray
    torque: np.ndarray
    point: np.ndarray
    local: bool = False


Wrenches = Sequence[AppliedWrench]
"""All that acts during one step."""


@dataclass(frozen=True)
class Spring:
    """A hand's spring: it pulls a bone with -k (x - hand) - c (v - hand's velocity), ``most`` N at
    the most, where x and v are position and velocity of the ``point``.
    """

    bone: int
    point: np.ndarray
    """(3,) m from the bone's centre of mass along the bone's axes."""
    position: np.ndarray
    """(3,) m where the hand is now."""
    target: np.ndarray
    """(3,) m where it goes, evenly."""
    left: float
    """s until it is there."""
    stiffness: float
    """k, N/m."""
    damping: float
    """c, N s/m."""
    most: float

    def after(self, duration: float) -> Spring:
        """The same ``duration`` s later, its hand farther on."""
        if duration >= self.left:
            return dataclasses.replace(self, position=self.target, left=0.0)
        way = (self.target - self.position) * (duration / self.left)
        return dataclasses.replace(self, position=self.position + way, left=self.left - duration)


@dataclass(frozen=True)
class AppliedHold:
    """A spring that holds an angle of the joint above a bone: -k (angle - target) - c rate, N m."""

    bone: int
    axis: int
    """Which of the joint's axes, from 0 on."""
    target: float
    """rad"""
    stiffness: float
    """k, N m/rad."""
    damping: float
    """c, N m s/rad."""


Springs = Sequence[Spring | AppliedHold]


@dataclass(frozen=True)
class AppliedDrive:
    """Pushes a bone at its centre of mass with c (u - v), ``most`` N at the most, where v is its
    velocity and u that which it shall have, and turns it likewise; world axes.
    """

    bone: int
    targets: np.ndarray
    """(2, 3) u, m/s, and that of turning, rad/s."""
    gains: tuple[float, float]
    """c, N s/m, and that of turning, N m s; 0 leaves it free."""
    most: tuple[float, float]
    """N and N m."""


Drives = Sequence[AppliedDrive]


class Engine(Protocol):
    """A scene in motion: where it is, what moves it on, what went wrong.

    It begins where the scene's placements say, as after place().
    """

    scene: Scene
    layout: DofLayout
    accuracy: Accuracy
    """May be changed between ticks."""
    energy_error: float
    """Share of the energy at hand that a tick may make from nothing; more is no error of the method
    but a bad state."""
    holds: bool
    """Whether joints can be held; for an engine where they can not, none are."""
    resting: np.ndarray
    """(d,) dolls that stand until something pushes, grabs or comes near them."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        """``workers``: threads that it may use; what comes of it is the same to the bit."""

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls now."""

    @property
    def joint_angles(self) -> np.ndarray:
        """Joint angles (k,) rad of these coordinates, in the order of Scene.angle_names."""

    @property
    def joint_rates(self) -> np.ndarray:
        """What they change by (k,), rad/s."""

    @property
    def motion(self) -> Motion:
        """Sums over each doll now."""

    @property
    def groups(self) -> np.ndarray:
        """Number (d,) of what each doll goes on with: dolls of one number fall asleep together."""

    def place(self, coordinates: GeneralizedState) -> None:
        """Put all dolls there and begin: nothing has been gained or lost yet.

        Bones of one doll that overlap by more than pressed() collide no more, for good or until
        they have come apart; a doll that is deeper in the ground is lifted onto it.
        """

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        """Go on by ``duration`` s under wrenches and drives that neither begin nor end within it,
        and springs of hands and of held joints.
        """

    def stop(self, dolls: np.ndarray) -> None:
        """Bring dolls (d,), whole groups, to rest where they are; the energy that is left is lost
        for good.
        """

    def grounded(self) -> np.ndarray:
        """Which dolls (d,) rest on the ground."""

    def contacts(self) -> Contacts:
        """What touches now."""

    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,), true or false, have contacts with the ground now."""

    @property
    def energy_excess(self) -> float:
        """Energy, J, above that at the start and all work since; losses make it negative."""

    def measures(self) -> dict[str, float]:
        """What went wrong since the start: names end in their units."""

    def save(self) -> object:
        """A snapshot that restore brings back to the bit, accounts included."""

    def restore(self, snapshot: object) -> None:
        """Go back to a snapshot."""

    def forget(self, snapshot: object) -> None:
        """Release what a snapshot holds."""

    def checkpoint(self) -> object:
        """Where all is and what the accounts say: far cheaper than save()."""

    def go_back(self, checkpoint: object) -> None:
        """Go on from the checkpoint of an engine of the same scene; what touches is found anew."""

    def close(self) -> None:
        """Release everything; a second time does nothing."""


def pressed(scene: Scene) -> float:
    """Depth, m, up to which a scene's bones may rest in each other and in the ground."""
    return PRESSED * min(min(part.shape.half_extents)
                         for bone in scene.bones for part in bone.shape.parts)

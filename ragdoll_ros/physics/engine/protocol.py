"""The interface of a physics engine. SI units, world frame, quaternions x, y, z, w."""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...model import errors
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ..accuracy import Accuracy
from .capabilities import Capability
from .doll_totals import DollTotals

GROUND = -1
"""Body index of the ground, in place of a bone's."""

ALLOWED_PENETRATION = 0.025
"""Initial penetration, as a fraction of the thinnest bone's half thickness, that still counts as a
contact. A deeper overlap is part of the pose, and its contact forces would burst the doll apart."""


class MissingEngine(errors.RagdollError):
    """The library of an engine is not installed or does not work."""


@dataclass(frozen=True)
class Contacts:
    """All c contact points, each between bone ``a`` and bone ``b``, a static body or the ground.

    Forces are the impulse of the last step or substep over its duration; with mujoco they are those
    at the current state.
    """

    a: np.ndarray
    """(c,) bone indices."""
    b: np.ndarray
    """(c,) bone indices, or GROUND for the ground and for static bodies."""
    bodies: np.ndarray
    """(c,) indices in Scene.bodies of static bodies, or GROUND for the ground and for bones."""
    positions: np.ndarray
    """(c, 3) m, on the surface of a."""
    normals: np.ndarray
    """(c, 3) unit vectors from b to a."""
    depths: np.ndarray
    """(c,) penetration, m; negative for a gap."""
    forces: np.ndarray
    """(c,) normal force, N."""
    wrenches: np.ndarray
    """(c, 6) on a: force with friction, N, and torque about the contact point, N m, world frame."""

    def __len__(self) -> int:
        return len(self.a)

    @classmethod
    def of(cls, rows: Sequence[Sequence[float]]) -> Contacts:
        """Make contacts from rows (c, 17): a, b, body, position, normal, depth, force, wrench."""
        table = np.array(rows, float).reshape(-1, 17)
        a, b, bodies = table[:, :3].T.astype(np.int64)
        return cls(a, b, bodies, table[:, 3:6], table[:, 6:9], table[:, 9], table[:, 10],
                   table[:, 11:])


@dataclass(frozen=True)
class Overlap:
    """An overlap of a bone with another bone, a static body or the ground at given coordinates.

    Args:
        bone: its name in the scene.
        other: name of another bone or of a static body, or 'ground'.
        depth: penetration, m: the shortest way for one of the two out of the other.
    """

    bone: str
    other: str
    depth: float

    def __str__(self) -> str:
        return f'{self.bone} is {1000 * self.depth:.1f} mm deep in {self.other}'


@dataclass(frozen=True)
class Impacts:
    """All c impacts of contact patches in an advance, each between bone ``a`` and bone ``b``, a
    static body or the ground.
    """

    a: np.ndarray
    """(c,) bone indices."""
    b: np.ndarray
    """(c,) bone indices, or GROUND for the ground and for static bodies."""
    bodies: np.ndarray
    """(c,) indices in Scene.bodies of static bodies, or GROUND for the ground and for bones."""
    elapsed: np.ndarray
    """(c,) s since the beginning of the advance."""
    positions: np.ndarray
    """(c, 3) m: the patch's center of pressure."""
    normals: np.ndarray
    """(c, 3) unit vectors from b to a."""
    speeds: np.ndarray
    """(c,) m/s, of approach along the normal at that point."""
    impulses: np.ndarray
    """(c,) N s, along the normal."""
    effective_masses: np.ndarray
    """(c,) kg, along the normal at that point, of both sides with what hangs on them."""
    mobilities: np.ndarray
    """(c, 2) 1/kg: speed of the center of mass of a, and of b, per impulse along the normal."""
    dropped: int = 0
    """How many more there were, for which the log had no room."""


@dataclass(frozen=True)
class AppliedWrench:
    """A force (3,) N and a torque (3,) N m on a bone, constant as long as it is applied: during one
    advance(), or one of its intervals.

    ``point`` (3,) m is where the force acts, in the bone's frame, from its centre of mass. Force
    and torque are in the bone's frame if ``local``, else in the world frame.
    """

    bone: int
    force: np.ndarray
    torque: np.ndarray
    point: np.ndarray
    local: bool = False


Wrenches = Sequence[AppliedWrench]


@dataclass(frozen=True)
class Spring:
    """A spring and damper between a hand and a point of a bone: f = -k (x - h) - c (v - h').

    x and v are the point's position and velocity, h and h' the hand's. |f| is limited to ``most``.
    """

    bone: int
    point: np.ndarray
    """(3,) m, in the bone's frame, from its centre of mass."""
    position: np.ndarray
    """(3,) m: the hand's position h now."""
    target: np.ndarray
    """(3,) m: the position that the hand approaches at constant velocity."""
    left: float
    """s until the hand reaches the target."""
    stiffness: float
    """k, N/m."""
    damping: float
    """c, N s/m."""
    most: float
    """N: force limit."""

    def after(self, duration: float) -> Spring:
        """The spring ``duration`` s later, with the hand moved towards its target."""
        if duration >= self.left:
            return dataclasses.replace(self, position=self.target, left=0.0)
        way = (self.target - self.position) * (duration / self.left)
        return dataclasses.replace(self, position=self.position + way, left=self.left - duration)


@dataclass(frozen=True)
class AppliedJointSpring:
    """A spring on an angle of the joint above a bone: torque -k (angle - target) - c (rate - u),
    N m, limited to ``most``. The target moves on at u.
    """

    bone: int
    axis: int
    """Index of the joint's axis."""
    target: float
    """rad, now"""
    stiffness: float
    """k, N m/rad."""
    damping: float
    """c, N m s/rad."""
    most: float = math.inf
    """N m: torque limit."""
    rate: float = 0.0
    """u, rad/s, of the target."""
    left: float = math.inf
    """s for which the target moves; then u is 0."""


Springs = Sequence[Spring | AppliedJointSpring]


@dataclass(frozen=True)
class AppliedDrive:
    """Velocity control of a bone: force c (u - v) at its centre of mass, and a torque likewise.

    u is the target velocity and v the bone's, world frame.
    """

    bone: int
    targets: np.ndarray
    """(2, 3) linear, m/s, and angular target velocity, rad/s."""
    gains: tuple[float, float]
    """Linear c, N s/m, and angular, N m s; 0: not controlled."""
    most: tuple[float, float]
    """Limits of force, N, and torque, N m."""


Drives = Sequence[AppliedDrive]


class Engine(Protocol):
    """A scene's physics: state, time step, contacts, energy account.

    A new engine has the pose and velocities of the scene's placements.
    """

    scene: Scene
    layout: DofLayout
    accuracy: Accuracy
    """May be changed between ticks."""
    energy_error: float
    """Relative energy gain in a tick above which the state counts as diverged; see Guard."""
    capabilities: frozenset[Capability]
    """Methods that are marked with one are there only with it."""
    sleeping: np.ndarray
    """(d,) bool: dolls that are not integrated until a load or another doll wakes them."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        """Build the scene; results do not depend on ``workers``, the number of threads."""

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls."""

    @property
    def joint_angles(self) -> np.ndarray:
        """Joint angles (k,) rad, in the order of Scene.angle_names."""

    @property
    def joint_rates(self) -> np.ndarray:
        """Time derivatives of the joint angles (k,) rad/s."""

    @property
    def doll_totals(self) -> DollTotals:
        """Energy, momentum and inertia of each doll."""

    @property
    def cluster_of_doll(self) -> np.ndarray:
        """Cluster index (d,): dolls of one cluster are integrated together and sleep together."""

    def set_coordinates(self, coordinates: GeneralizedState) -> None:
        """Set the state, wake all dolls and restart the energy account.

        Two bones of one doll do not collide, with bullet and mujoco for good, if they overlap by
        more than allowed_penetration(); with rigid until they separate, if they overlap by more
        than 1 mm here and in the scene's placements, and while a joint between them is outside its
        limits. A doll that is deeper in the ground than allowed_penetration() is lifted onto it.
        """

    def set_doll(self, doll: int, coordinates: GeneralizedState) -> None:
        """Set the coordinates and velocities of one doll to those in ``coordinates``, and wake all
        dolls of its old cluster. The change of energy counts as work of pushes. If it is deeper in
        the ground than allowed_penetration(), it is lifted onto it. If its joint angles change,
        collision is disabled between its bones as by set_coordinates(); with rigid wherever they
        now overlap by more than 1 mm.
        """

    def set_twists(self, dolls: np.ndarray, twists: np.ndarray) -> None:
        """Set the twists (n, 6), world frame, at which ``dolls`` (n,) that follow exactly move from
        now on: velocity of the centre of mass, m/s, and angular velocity, rad/s; wake their
        clusters. DRIVEN_BODIES.
        """

    def set_kinematic(self, doll: int, kinematic: bool) -> None:
        """Make an animated doll kinematic, so that it moves at its velocities whatever acts on it,
        or end that. A kinematic doll has no contacts with itself, static bodies and the ground, and
        its energy counts as zero. Its bones that overlap when that ends do not collide until they
        separate. An engine without kinematic dolls leaves all motion to set_motion(), and disables
        collision of overlapping bones for good when that ends.
        """

    def set_motion(self, dolls: Sequence[int], coordinates: GeneralizedState) -> None:
        """Set the coordinates and velocities of kinematic ``dolls`` to those in ``coordinates``,
        and wake their clusters. They are not lifted out of the ground, and their contacts are kept.
        The change of energy counts as work of pushes.
        """

    def with_dolls(self, scene: Scene) -> Engine:
        """A new engine at the start of ``scene``, which differs from this one's in its dolls alone;
        it shares what depends on a doll and not on its state. SCENE_CHANGES.
        """

    def continue_from(self, engine: Engine, change: SceneChange) -> None:
        """Take the states of the dolls that stay, to the bit, from ``engine``, that of the scene
        before the change; clusters of ``engine`` that lose a doll wake. A doll that comes adds its
        energy to the account, one that goes takes its energy from it; total excess and work stay
        the same. SCENE_CHANGES.
        """

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        """Integrate over ``duration`` s, under loads that act during all of it; dolls on which they
        act wake. ``springs`` may include AppliedJointSpring with JOINT_SPRINGS.
        """

    def put_to_sleep(self, dolls: np.ndarray) -> None:
        """Set the velocities of dolls (d,), whole clusters, to zero; their energy is removed."""

    def set_velocities(self, dolls: np.ndarray, velocities: np.ndarray) -> None:
        """Set the generalized velocities of dolls (d,), whole clusters, to those in ``velocities``
        (nv,), except for kinematic dolls and fixed roots. The change of energy counts as work of
        pushes. COPIES, for StabilityTest.
        """

    def simulate_copy(self, dolls: np.ndarray, velocities: np.ndarray,
                      interval: float) -> Generator[np.ndarray, None, None]:
        """Simulate a copy of ``dolls`` (d,), whole clusters, without loads and without other dolls,
        from ``velocities`` (nv,). Yield its kinetic energies (d,) J at the start and after each
        ``interval``, s, in coarse steps; the first interval is shorter, in finer steps. Closing the
        generator restores the state of the dolls to the bit. COPIES.
        """

    def dolls_on_ground(self) -> np.ndarray:
        """Which dolls (d,) the ground, a static body or a fixed root bears, and kinematic ones; all
        or none with bullet and mujoco.
        """

    def contacts(self) -> Contacts:
        """All contact points."""

    @property
    def contact_impulses(self) -> np.ndarray:
        """Impulse (n, 3) N s of contacts on each bone since the start. CONTACT_IMPULSES."""

    def overlaps(self, coordinates: GeneralizedState) -> tuple[Overlap, ...]:
        """Overlaps of bones with bones, static bodies or the ground at ``coordinates`` that are
        deeper than a contact, the deepest first; the state stays the same to the bit. OVERLAPS.
        """

    def log_impacts(self, enabled: bool) -> None:
        """Begin or end to log impacts. IMPACTS."""

    @property
    def impacts(self) -> Impacts | None:
        """Impacts in the last advance(); None: they are not logged. IMPACTS."""

    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,) touch the ground or a static body."""

    @property
    def energy_excesses(self) -> np.ndarray:
        """Energy of each doll (d,) J, minus that at the start and all work since; negative after
        losses. Only changes, summed over a cluster, are meaningful: work is that of the cluster.
        """

    @property
    def work(self) -> tuple[float, float]:
        """Work since the start, J: of pushes, drives and kinematic bodies; and of hands and joint
        springs.
        """

    def measures(self) -> dict[str, float]:
        """Error measures and counters, of the last advance() or since the start; keys end
        in units.
        """

    def ledger(self) -> dict[str, int]:
        """Counters of what the steps since the start are made of, see LEDGER; empty where a library
        takes the steps.
        """

    def save(self) -> object:
        """Take a snapshot that restore() reproduces to the bit, energy account included."""

    def restore(self, snapshot: object) -> None:
        """Restore a snapshot."""

    def discard(self, snapshot: object) -> None:
        """Release the memory of a snapshot."""

    def checkpoint(self) -> object:
        """Save coordinates, energy account and what else can not be recomputed: far cheaper than
        save().
        """

    def restore_checkpoint(self, checkpoint: object) -> None:
        """Restore a checkpoint, also of another engine of the scene; contacts are recomputed."""

    def close(self) -> None:
        """Release all resources; closing again does nothing."""


def allowed_penetration(scene: Scene) -> float:
    """Largest initial penetration, m, that counts as a contact with the ground, and with bullet and
    mujoco between bones.
    """
    return ALLOWED_PENETRATION * min(min(part.shape.half_extents)
                         for bone in scene.bones for part in bone.shape.parts)

"""SubsteppedEngine: loads, work and energy account of engines with equal substeps."""
import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np

from ....model.coordinates import DofLayout, GeneralizedState
from ....model.scene import LARGEST_FRICTION, NO_SLIP, Scene
from ....model.state import State
from ...accuracy import Accuracy
from ...rigid_body import GroundHeights
from ..capabilities import Capability
from ..doll_totals import DollSums, DollTotals
from ..protocol import GROUND, Drives, Springs, Wrenches, allowed_penetration
from .energy_account import EnergyAccount, steady_time, work
from .explicit_springs import CONSTANT_FORCE_TIME, SpringWrench, drive_wrenches, spring_wrenches

SPAN = 0.01
"""s: Accuracy.substeps counts substeps in this time. Also the longest interval under loads, and the
longest between two corrections of energy and momentum."""

LEAST_SHARE = 0.01
"""Shortest interval under loads, as a fraction of the duration, however fast the bone spins."""


class FrictionWarning(UserWarning):
    """A scene's friction is beyond what PyBullet and MuJoCo represent, and is replaced."""


class SubsteppedEngine(ABC):
    """Base class of engines that wrap a library with fixed time steps; see Engine for its methods.

    advance() splits its duration into intervals of constant loads, each of one or more equal
    substeps. One thread computes all of them, whatever ``workers`` is.
    """

    capabilities: frozenset[Capability] = frozenset()

    lags = True
    """Whether substeps are semi-implicit Euler: positions advance by the velocity at the end."""

    energy_error = 0.1
    """See Engine; the largest gain measured with PyBullet, under hard pushes, is 0.016."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        self.scene, self.accuracy = scene, accuracy
        _warn_of_friction(scene)
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._sums, self._heights = DollSums(scene), GroundHeights(scene)
        self.sleeping = np.zeros(len(scene.dolls), bool)
        self._taken = 0
        """Substeps of the last advance()."""
        self._invalidate()

    @property
    def state(self) -> State:
        if self._state is None:
            self._state = self._read_state()
        return self._state

    @property
    def coordinates(self) -> GeneralizedState:
        if self._coordinates is None:
            self._coordinates = self._read_coordinates()
        return self._coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        return self.layout.joint_angles(self.coordinates.q)

    @property
    def joint_rates(self) -> np.ndarray:
        return self.layout.joint_rates(self.coordinates)

    @property
    def doll_totals(self) -> DollTotals:
        if self._doll_totals is None:
            self._doll_totals = self._sums.totals(self.state)
        return self._doll_totals

    @property
    def cluster_of_doll(self) -> np.ndarray:
        """Zeros (d,): all dolls form one cluster."""
        return np.zeros(len(self.sleeping), np.int64)

    def set_coordinates(self, coordinates: GeneralizedState) -> None:
        self.sleeping[:] = False
        self._set_state(coordinates)
        self._lift_out_of_ground(range(len(self.sleeping)))
        self._exclude_overlaps()
        self._invalidate()
        self._account = EnergyAccount.opened(self.doll_totals.energy)
        self._taken = 0

    def set_doll(self, doll: int, coordinates: GeneralizedState) -> None:
        before, here = self.doll_totals.energy.sum(), self.coordinates
        q, v = here.q.copy(), here.v.copy()
        q[self.layout.doll_q[doll]] = coordinates.q[self.layout.doll_q[doll]]
        v[self.layout.doll_v[doll]] = coordinates.v[self.layout.doll_v[doll]]
        joints = slice(self.layout.doll_q[doll].start + 7, self.layout.doll_q[doll].stop)
        moved = (here.q[joints] != q[joints]).any()
        self.sleeping[:] = False
        self._set_state(GeneralizedState(q, v))
        self._lift_out_of_ground([doll])
        if moved:
            self._exclude_overlaps()
        self._account.add_work(doll, self.doll_totals.energy.sum() - before, by_hand=False)

    def set_kinematic(self, doll: int, kinematic: bool) -> None:
        """Disable collision of overlapping bones when an animation ends; nothing else, as within a
        tick an animated doll yields to what it meets.
        """
        if not kinematic:
            self._exclude_overlaps()

    def set_motion(self, dolls: Sequence[int], coordinates: GeneralizedState) -> None:
        before, here, layout = self.doll_totals.energy.sum(), self.coordinates, self.layout
        q, v = here.q.copy(), here.v.copy()
        for doll in dolls:
            q[layout.doll_q[doll]] = coordinates.q[layout.doll_q[doll]]
            v[layout.doll_v[doll]] = coordinates.v[layout.doll_v[doll]]
        self.sleeping[:] = False
        self._set_state(GeneralizedState(q, v))
        self._account.add_work(dolls[0], self.doll_totals.energy.sum() - before, by_hand=False)

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        self.sleeping[:] = False
        self._taken, least, left = 0, LEAST_SHARE * duration, duration
        while left > 1e-12 * duration:
            longest = max(least, min(left, *self._interval_limits(wrenches, springs or drives)))
            length = left / math.ceil(left / longest - 1e-6)
            self._advance_interval(length, [
                *wrenches, *spring_wrenches(springs, self._sums, self.state, length),
                *drive_wrenches(drives, self._sums, self.state, length)])
            springs = [spring.after(length) for spring in springs]
            left -= length

    def take_substeps(self, duration: float, substeps: int, loads: Wrenches = ()) -> None:
        """Take equal substeps under constant loads as a program that uses the library alone would.

        No energy account, no correction and no reading of poses; the account is wrong afterwards.
        There are more than ``substeps`` where explicit damping would be unstable.
        """
        self._run_substeps(duration, max(substeps, self._least_substeps(duration)), loads)
        self._invalidate()

    def put_to_sleep(self, dolls: np.ndarray) -> None:
        """Put all dolls to sleep: set all velocities to zero and lower the allowed energies to what
        is left.
        """
        self.sleeping[:] = True
        here = self.coordinates
        self._set_state(GeneralizedState(here.q, np.zeros_like(here.v)))
        self._account.lower(self.doll_totals.energy)
        self._taken = 0

    def dolls_on_ground(self) -> np.ndarray:
        """Whether any doll touches the ground or a static body, the same for all (d,): they are one
        cluster.
        """
        return np.full(len(self.sleeping), any(GROUND in pair for pair in self._touching_pairs()))

    def bones_on_ground(self) -> np.ndarray:
        contacts, on = self.contacts(), np.zeros(len(self.scene.bones), bool)
        on[contacts.a[contacts.b == GROUND]] = True
        return on

    @property
    def energy_excesses(self) -> np.ndarray:
        excesses = np.zeros(len(self.sleeping))
        excesses[0] = self._account.excess(self.doll_totals.energy)
        return excesses

    @property
    def work(self) -> tuple[float, float]:
        return self._account.pushes, self._account.grabs

    def measures(self) -> dict[str, float]:
        """Measures of the energy account, and the substeps of the last advance()."""
        return {**self._account.measures(self.doll_totals.energy), 'substeps': self._taken}

    def ledger(self) -> dict[str, int]:
        return {}

    def save(self) -> object:
        return self._save(), self._account.copy()

    def restore(self, snapshot: object) -> None:
        held, account = snapshot
        self.sleeping[:] = False
        self._restore(held)
        self._account, self._taken = account.copy(), 0
        self._invalidate()

    def discard(self, snapshot: object) -> None:
        self._discard(snapshot[0])

    def checkpoint(self) -> object:
        return self.coordinates, self._account.copy()

    def restore_checkpoint(self, checkpoint: tuple) -> None:
        coordinates, account = checkpoint
        self._set_state(coordinates)
        self._account = account.copy()

    @property
    def _conserves(self) -> bool:
        """Whether _conserve() runs after each interval."""
        return False

    def _interval_limits(self, wrenches: Wrenches, springs: Springs | Drives) -> Iterator[float]:
        """Upper bounds, s, on an interval of constant loads."""
        yield SPAN if wrenches or springs or self._conserves else math.inf
        yield CONSTANT_FORCE_TIME if springs else math.inf
        for wrench in wrenches:
            yield steady_time(wrench, self.state, self._sums.inertias[wrench.bone])

    def _advance_interval(self, duration: float, loads: Wrenches) -> None:
        """Step over ``duration`` s under constant loads and add their work to the account."""
        before, substeps = self.state, max(self._least_substeps(duration), math.ceil(
            self.accuracy.substeps * duration / SPAN - 1e-6))
        touched = self._run_substeps(duration, substeps, loads)
        self._taken += substeps
        self._invalidate()
        for load in loads:
            joules = work(load, before, self.state, duration,
                          duration / substeps if self.lags else 0.0)
            self._account.add_work(self._sums.doll_of[load.bone], joules,
                                   isinstance(load, SpringWrench))
        if self._conserves:
            self._conserve(before, duration, loads, touched)

    def _conserve(self, before: State, duration: float, loads: Wrenches,
                  touched: set[tuple[int, int]]) -> None:
        """Correct energy and momentum after an interval in which these pairs of dolls touched."""
        raise NotImplementedError

    def _lift_out_of_ground(self, dolls: Sequence[int]) -> None:
        """Raise those ``dolls`` that are deeper in the ground than allowed_penetration(): else they
        stay there or are thrown.
        """
        heights = self._heights(self.state)
        depths = -np.array([heights[own].min() for own in self.scene.bone_slices])
        sunk = (depths > allowed_penetration(self.scene)) & np.isin(np.arange(len(depths)), dolls)
        if sunk.any():
            q = self.coordinates.q.copy()
            q[self.layout.root_positions] += np.outer(np.where(sunk, depths, 0),
                                                      self.scene.ground.normal)
            self._set_state(GeneralizedState(q, self.coordinates.v))

    def _set_state(self, coordinates: GeneralizedState) -> None:
        self._write_coordinates(coordinates)
        self._invalidate()

    def _invalidate(self) -> None:
        """Discard cached values."""
        self._state: State | None = None
        self._coordinates: GeneralizedState | None = None
        self._doll_totals: DollTotals | None = None

    def _least_substeps(self, duration: float) -> int:
        """Lower bound on the substeps of an interval, for stability."""
        return 1

    @abstractmethod
    def _run_substeps(self, duration: float, substeps: int,
                       loads: Wrenches) -> set[tuple[int, int]]:
        """Take equal substeps; returns the pairs of dolls, or doll and GROUND, that touched."""

    @abstractmethod
    def _touching_pairs(self) -> set[tuple[int, int]]:
        """Pairs of dolls, or doll and GROUND, that touched in the last substep."""

    @abstractmethod
    def _read_state(self) -> State: ...

    @abstractmethod
    def _read_coordinates(self) -> GeneralizedState: ...

    @abstractmethod
    def _write_coordinates(self, coordinates: GeneralizedState) -> None: ...

    @abstractmethod
    def _exclude_overlaps(self) -> None:
        """Disable collision of bones of one doll that penetrate beyond allowed_penetration()."""

    @abstractmethod
    def _save(self) -> object: ...

    @abstractmethod
    def _restore(self, held: object) -> None: ...

    @abstractmethod
    def _discard(self, held: object) -> None: ...


def _warn_of_friction(scene: Scene) -> None:
    """Warn where finite_friction() replaces the friction of the ground, a bone or a static body."""
    most = max(scene.material.on(surface)[0] for surface in (None, *scene.bones, *scene.bodies))
    if most > LARGEST_FRICTION:
        text = (f'unlimited friction is a coefficient of {NO_SLIP:g}' if math.isinf(most) else
                f'friction {most:g} is a coefficient of {LARGEST_FRICTION:g}')
        warnings.warn(f'scene {scene.name}: with PyBullet and MuJoCo {text}', FrictionWarning,
                      stacklevel=5)

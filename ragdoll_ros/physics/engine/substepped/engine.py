"""What engines that go in equal substeps share: stretches, loads and their work, the account."""
from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np

from ....model.coordinates import DofLayout, GeneralizedState
from ....model.scene import Scene
from ....model.state import State
from ...accuracy import Accuracy
from ...ground_heights import GroundHeights
from ...motion import Motion
from ..protocol import GROUND, Drives, Springs, Wrenches, pressed
from .doll_sums import DollSums
from .energy_account import Account
from .explicit_springs import LONGEST, Pull, driven, pulls
from .work import longest_stretch, work

SPAN = 0.01
"""s for which Accuracy counts substeps, and the longest stretch of which work or an account is
taken."""

LEAST_SHARE = 0.01
"""Of what is asked for: stretches under loads are no shorter, however fast the bone spins."""


class SubsteppedEngine(ABC):
    """An Engine but for its library: how that steps, reads, places and tells what touches.

    A stretch is some substeps under loads that are taken to be steady. One thread takes all of
    them, however many ``workers`` there may be.
    """

    holds = False

    lags = True
    """Whether a substep moves all by the velocity at its end (semi-implicit Euler)."""

    energy_error = 0.1
    """See Engine; PyBullet made 0.016 of hard pushes, where the account had not yet taken it."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        self.scene, self.accuracy = scene, accuracy
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._sums, self._heights = DollSums(scene), GroundHeights(scene)
        self.resting = np.zeros(len(scene.dolls), bool)
        self._taken = 0
        """Substeps that the last advance took."""
        self._changed()

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""
        if self._state is None:
            self._state = self._read_state()
        return self._state

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls now."""
        if self._coordinates is None:
            self._coordinates = self._read_coordinates()
        return self._coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        """Joint angles (k,) rad now."""
        return self.layout.joint_angles(self.coordinates.q)

    @property
    def joint_rates(self) -> np.ndarray:
        """What they change by (k,), rad/s."""
        return self.layout.joint_rates(self.coordinates)

    @property
    def motion(self) -> Motion:
        """Sums over each doll now."""
        if self._motion is None:
            self._motion = self._sums.motion(self.state)
        return self._motion

    @property
    def groups(self) -> np.ndarray:
        """Zeros (d,): all dolls go on together."""
        return np.zeros(len(self.resting), np.int64)

    def place(self, coordinates: GeneralizedState) -> None:
        """Put all dolls there and begin; see Engine."""
        self.resting[:] = False
        self._put(coordinates)
        self._lift_out()
        self._exclude_overlaps()
        self._changed()
        self._account = Account.opened(self.motion.energy)
        self._taken = 0

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        """Go on by ``duration`` s; see Engine."""
        self.resting[:] = False
        self._taken, least, left = 0, LEAST_SHARE * duration, duration
        while left > 1e-12 * duration:
            longest = max(least, min(left, *self._steady(wrenches, springs or drives)))
            length = left / math.ceil(left / longest - 1e-6)
            self._stretch(length, [*wrenches, *pulls(springs, self._sums, self.state, length),
                                   *driven(drives, self._sums, self.state, length)])
            springs = [spring.after(length) for spring in springs]
            left -= length

    def stop(self, dolls: np.ndarray) -> None:
        """Bring all to rest where it is; the energy that is left is lost for good."""
        self.resting[:] = True
        here = self.coordinates
        self._put(GeneralizedState(here.q, np.zeros_like(here.v)))
        self._account.lower(self.motion.energy)
        self._taken = 0

    def grounded(self) -> np.ndarray:
        """Whether anything touches the ground, for all dolls (d,) the same."""
        return np.full(len(self.resting), any(GROUND in pair for pair in self._touched()))

    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,) touch the ground now."""
        contacts, on = self.contacts(), np.zeros(len(self.scene.bones), bool)
        on[contacts.a[contacts.b == GROUND]] = True
        return on

    @property
    def energy_excess(self) -> float:
        """Energy, J, above that at the start and all work since."""
        return self._account.excess(self.motion.energy)

    def measures(self) -> dict[str, float]:
        """What the account says, and the substeps that the last advance took."""
        return {**self._account.measures(self.motion.energy), 'substeps': self._taken}

    def save(self) -> object:
        """A snapshot that restore brings back to the bit."""
        return self._save(), self._account.copy()

    def restore(self, snapshot: object) -> None:
        """Go back to a snapshot."""
        held, account = snapshot
        self.resting[:] = False
        self._restore(held)
        self._account, self._taken = account.copy(), 0
        self._changed()

    def forget(self, snapshot: object) -> None:
        """Release what a snapshot holds."""
        self._forget(snapshot[0])

    def checkpoint(self) -> object:
        """Where all is and what the account says: far cheaper than save()."""
        return self.coordinates, self._account.copy()

    def go_back(self, checkpoint: tuple) -> None:
        """Go on from a checkpoint; see Engine."""
        coordinates, account = checkpoint
        self._put(coordinates)
        self._account = account.copy()

    @property
    def _accounts(self) -> bool:
        """Whether an account is closed after each stretch."""
        return False

    def _steady(self, wrenches: Wrenches, springs: Springs | Drives) -> Iterator[float]:
        """For how long loads may be taken as steady, and an account may wait, s."""
        yield SPAN if wrenches or springs or self._accounts else math.inf
        yield LONGEST if springs else math.inf
        for wrench in wrenches:
            yield longest_stretch(wrench, self.state, self._sums.inertias[wrench.bone])

    def _stretch(self, duration: float, loads: Wrenches) -> None:
        """Go through substeps under steady loads, and enter their work."""
        before, substeps = self.state, max(self._least_substeps(duration), math.ceil(
            self.accuracy.substeps * duration / SPAN - 1e-6))
        touched = self._run(duration, substeps, loads)
        self._taken += substeps
        self._changed()
        for load in loads:
            joules = work(load, before, self.state, duration,
                          duration / substeps if self.lags else 0.0)
            self._account.add_work(self._sums.doll_of[load.bone], joules, isinstance(load, Pull))
        if self._accounts:
            self._conserve(before, duration, loads, touched)

    def _conserve(self, before: State, duration: float, loads: Wrenches,
                  touched: set[tuple[int, int]]) -> None:
        """Close the account of a stretch in which pairs of dolls ``touched``, where one is kept."""
        raise NotImplementedError

    def _lift_out(self) -> None:
        """Set dolls that are in the ground onto it: else they stay, or are thrown out."""
        heights = self._heights(self.state)
        depths = -np.array([heights[own].min() for own in self.scene.bone_slices])
        sunk = depths > pressed(self.scene)
        if sunk.any():
            q = self.coordinates.q.copy()
            q[self.layout.root_positions] += np.outer(np.where(sunk, depths, 0),
                                                      self.scene.ground.normal)
            self._put(GeneralizedState(q, self.coordinates.v))

    def _put(self, coordinates: GeneralizedState) -> None:
        self._set(coordinates)
        self._changed()

    def _changed(self) -> None:
        """Forget what was read."""
        self._state: State | None = None
        self._coordinates: GeneralizedState | None = None
        self._motion: Motion | None = None

    def _least_substeps(self, duration: float) -> int:
        """Substeps that a stretch must have, whatever the accuracy says."""
        return 1

    @abstractmethod
    def _run(self, duration: float, substeps: int, loads: Wrenches) -> set[tuple[int, int]]:
        """Go on in equal substeps; pairs of dolls, or of a doll and GROUND, that touched."""

    @abstractmethod
    def _touched(self) -> set[tuple[int, int]]:
        """Such pairs in the last substep."""

    @abstractmethod
    def _read_state(self) -> State: ...

    @abstractmethod
    def _read_coordinates(self) -> GeneralizedState: ...

    @abstractmethod
    def _set(self, coordinates: GeneralizedState) -> None:
        """Put the dolls there."""

    @abstractmethod
    def _exclude_overlaps(self) -> None:
        """Let bones of one doll that overlap by more than pressed() now collide no more."""

    @abstractmethod
    def _save(self) -> object: ...

    @abstractmethod
    def _restore(self, held: object) -> None: ...

    @abstractmethod
    def _forget(self, held: object) -> None: ...

"""RigidEngine connects broad phase, clusters and kernels, and provides state and statistics.

The algorithm of a tick is in kernels/advance.py.
"""
from __future__ import annotations

import dataclasses
from collections.abc import Generator, Iterable, Iterator, Sequence

import numpy as np

from ....model import rotation
from ....model.coordinates import DofLayout, GeneralizedState, placed_coordinates
from ....model.scene import Scene
from ....model.scene_change import SceneChange
from ....model.state import State
from ...accuracy import DRAFT, Accuracy
from ...rigid_body import GroundHeights
from ...kernels.system import JOINT_OUTSIDE_LIMITS, OVERLAPPING
from ..capabilities import Capability
from ..doll_totals import DollTotals
from ..protocol import (
    GROUND,
    Contacts,
    Drives,
    Impacts,
    Overlap,
    Springs,
    Wrenches,
    allowed_penetration,
)
from .broad_phase import BroadPhase
from .clusters import Cluster, Clusters
from .contact_points import contact_wrenches
from .initial_overlaps import find_overlaps
from .loads import NO_LOADS, NO_SPRINGS, load_records, spring_records

ERROR_STEP_RATIO = 0.25
"""Ratio of step lengths with which the last interval is repeated to estimate its error."""

LOOK_AHEAD = 0.05
"""s: dolls that may touch within this time form a cluster."""

COPY_STEPS, COPY_START = 2, 0.1
"""Contact steps in an interval of simulate_copy(), and the share of its first one, of twice as many
steps: in a long step contacts take all of a disturbance, also what would make a doll depart."""

MAX_AGE = 10
"""Intervals for which a cluster is kept, unless another doll comes near."""


class RigidEngine:
    """An Engine of rigid bodies; see Engine."""

    energy_error = 1e-2
    capabilities = frozenset(Capability)

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1,
                 like: RigidEngine | None = None) -> None:
        """``like``: an engine of a scene that differs in its dolls alone."""
        self.scene, self.accuracy = scene, accuracy
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._clusters = Clusters(scene, self.layout, workers, like and like._clusters)
        self._broad_phase = BroadPhase(scene, self._clusters.reach())
        self._heights = GroundHeights(scene)
        self._spins = self.layout.root_angular_velocities
        for doll, placement in enumerate(scene.dolls):
            if placement.is_animated:
                self._clusters.set_kinematic(doll, True)
        self._twisted: list[int] = []
        """Dolls whose twist has been set since the last interval."""
        self.sleeping = np.zeros(len(scene.dolls), bool)
        self._age = np.full(len(scene.dolls), MAX_AGE)
        """(d,) intervals since the cluster of each doll was formed."""
        self._impacts: Impacts | None = None
        self._standing: tuple = (None, None, b'', [])
        """Clusters, springs, and what yields, of the last interval with springs alone, and their
        records: motors with targets that stand are the same for many intervals."""
        self._initial_overlaps = [np.full(len(own), OVERLAPPING)
                                  for own in self._clusters.excluded(OVERLAPPING)]
        """Pairs that overlap at the start: they are excluded until they separate."""
        self.set_coordinates(placed_coordinates(scene.dolls, self.layout))
        self._initial_overlaps = self._clusters.excluded(OVERLAPPING)

    @property
    def _yielding(self) -> np.ndarray:
        """(d,) dolls that forces move; all others are kinematic."""
        return self._clusters.yielding

    @property
    def state(self) -> State:
        return self._state

    @property
    def coordinates(self) -> GeneralizedState:
        q, v = self._clusters.q.copy(), self._clusters.v.copy()
        v[self._spins] = rotation.rotate(q[self.layout.root_orientations], v[self._spins])
        return GeneralizedState(q, v)

    @property
    def joint_angles(self) -> np.ndarray:
        return self.layout.joint_angles(self._clusters.q)

    @property
    def joint_rates(self) -> np.ndarray:
        # The roots' spins, which v has along the roots' own axes, are none of the joints'.
        return self.layout.joint_rates(GeneralizedState(self._clusters.q, self._clusters.v))

    @property
    def doll_totals(self) -> DollTotals:
        return self._doll_totals

    @property
    def cluster_of_doll(self) -> np.ndarray:
        return self._clusters.of_doll

    def set_coordinates(self, coordinates: GeneralizedState) -> None:
        clusters, q, v = self._clusters, self._clusters.q, self._clusters.v
        q[:] = coordinates.q
        v[:] = self._in_root_axes(coordinates)
        clusters.stats[:] = clusters.contact_impulses[:] = clusters.departed[:] = 0
        clusters.separate()
        self.sleeping[:] = False
        self._refresh()
        self._lift_out_of_ground(range(len(self.scene.dolls)))
        clusters.exclude([own | JOINT_OUTSIDE_LIMITS for own in self._initial_overlaps])
        self._refresh()
        self._age[:] = MAX_AGE
        self._start_energies = self.doll_totals.energy.copy()
        self._last_start = None

    def set_doll(self, doll: int, coordinates: GeneralizedState) -> None:
        clusters, before = self._clusters, self.doll_totals.energy
        self._wake(self.cluster_of_doll == self.cluster_of_doll[doll])
        joints = slice(self.layout.doll_q[doll].start + 7, self.layout.doll_q[doll].stop)
        if (clusters.q[joints] != coordinates.q[joints]).any():
            clusters.exclude_overlaps(doll)
        clusters.set_doll(doll, coordinates.q, self._in_root_axes(coordinates))
        self._refresh()
        self._lift_out_of_ground([doll])
        clusters.set_doll(doll, clusters.q, clusters.v)
        self._refresh()
        self._age[self.cluster_of_doll == self.cluster_of_doll[doll]] = MAX_AGE
        self._last_start = None
        clusters.add_work(self.doll_totals.energy - before)

    def set_twists(self, dolls: np.ndarray, twists: np.ndarray) -> None:
        if np.count_nonzero(self.sleeping):
            self._wake(self._in_clusters_of(dolls))
        self._clusters.set_twists(dolls, twists)
        self._state = State.of(self._clusters.bone_states.copy())
        self._twisted += dolls.tolist()

    def _in_clusters_of(self, dolls: Sequence[int]) -> np.ndarray:
        """Which dolls (d,) are in a cluster of one of ``dolls``."""
        named = np.zeros(len(self.cluster_of_doll), bool)
        named[self.cluster_of_doll[dolls]] = True
        return named[self.cluster_of_doll]

    def set_motion(self, dolls: Sequence[int], coordinates: GeneralizedState) -> None:
        own = self._in_clusters_of(dolls)
        self._wake(own)
        self._clusters.set_motion(dolls, coordinates.q, self._in_root_axes(coordinates))
        self._clusters.advance(0.0, self.accuracy, ~own)
        self._update_state()
        self._twisted += dolls

    def set_kinematic(self, doll: int, kinematic: bool) -> None:
        own = self.cluster_of_doll == self.cluster_of_doll[doll]
        self._wake(own)
        self._clusters.set_kinematic(doll, kinematic)
        self._age[own] = MAX_AGE
        self._last_start = None

    def with_dolls(self, scene: Scene) -> RigidEngine:
        return RigidEngine(scene, self.accuracy, workers=self._clusters.workers, like=self)

    def continue_from(self, engine: RigidEngine, change: SceneChange) -> None:
        gone, excesses = change.new_dolls < 0, engine.energy_excesses
        engine._wake(np.isin(engine.cluster_of_doll, engine.cluster_of_doll[gone]))
        stay = change.old_dolls >= 0
        old = change.old_dolls[stay]
        self.sleeping[stay] = engine.sleeping[old]
        self._start_energies = self._start_energies.copy()  # a snapshot has the other
        self._start_energies[stay] = engine._start_energies[old]
        self._start_energies[0] -= excesses[gone].sum()
        self._clusters.continue_from(engine._clusters, change)
        self._age[stay], self._last_start = engine._age[old], None
        self._update_state()

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        clusters, actions = self._clusters, (wrenches, springs, drives)
        twisted, self._twisted = self._twisted, []
        self._last_start = clusters.q.copy(), clusters.v.copy(), duration, actions, twisted
        of_doll = self.cluster_of_doll
        acted_on = [acts.bone for acts in (*wrenches, *springs, *drives)]
        if acted_on and np.count_nonzero(self.sleeping):
            self._wake(np.isin(of_doll, of_doll[self.scene.doll_of_bone[acted_on]]))
        self._update_clusters(duration)
        self._advance(duration, actions, self.accuracy, twisted)
        self._impacts = self._clusters.impacts()

    def overlaps(self, coordinates: GeneralizedState) -> tuple[Overlap, ...]:
        snapshot, start = self.save(), self._last_start
        try:
            return find_overlaps(self.scene, self._clusters, self._broad_phase, self.layout,
                                 coordinates.q)
        finally:
            self.restore(snapshot)
            self._last_start = start

    def put_to_sleep(self, dolls: np.ndarray) -> None:
        self._clusters.set_velocities(dolls, np.zeros_like(self._clusters.v))
        self.sleeping[dolls] = True
        self._last_start = None
        self._refresh()

    def set_velocities(self, dolls: np.ndarray, velocities: np.ndarray) -> None:
        before = self.doll_totals.energy
        clusters = self._clusters
        clusters.set_velocities(dolls, self._in_root_axes(
            GeneralizedState(clusters.q, velocities)))
        self._last_start = None
        self._refresh()
        clusters.add_work(self.doll_totals.energy - before)

    def simulate_copy(self, dolls: np.ndarray, velocities: np.ndarray,
                      interval: float) -> Generator[np.ndarray, None, None]:
        clusters = self._clusters
        coarse = dataclasses.replace(DRAFT, step=interval / COPY_STEPS)
        fine = dataclasses.replace(coarse, step=COPY_START * coarse.step / 2)
        saved = clusters.save_states(dolls)
        try:
            clusters.set_velocities(dolls, self._in_root_axes(
                GeneralizedState(clusters.q, velocities)))
            clusters.advance(0.0, fine, ~dolls)
            yield clusters.sums['kinetic'].copy()
            clusters.advance(COPY_START * interval, fine, ~dolls)
            while True:
                yield clusters.sums['kinetic'].copy()
                clusters.advance(interval, coarse, ~dolls)
        finally:
            clusters.restore_states(saved)

    def dolls_on_ground(self) -> np.ndarray:
        contacts, bones, _ = self._clusters.contacts()
        found = np.zeros(len(self.scene.dolls), bool)
        on = (bones[:, 1] == GROUND) & (contacts['impulse'][:, 0] > 0)
        found[self.scene.doll_of_bone[bones[on, 0]]] = True
        return found | ~self._yielding | self._clusters.fixed_roots

    def contacts(self) -> Contacts:
        found, touching, dt = self._clusters.contacts()
        return Contacts(*touching.T, found['point'], found['normal'], -found['gap'],
                        found['impulse'][:, 0] / dt, contact_wrenches(found, dt))

    @property
    def contact_impulses(self) -> np.ndarray:
        return self._clusters.contact_impulses

    def log_impacts(self, enabled: bool) -> None:
        self._clusters.log_impacts(enabled)
        self._impacts = None

    @property
    def impacts(self) -> Impacts | None:
        return self._impacts

    def bones_on_ground(self) -> np.ndarray:
        return self._clusters.on_ground()

    @property
    def energy_excesses(self) -> np.ndarray:
        return self._doll_totals.energy - self._start_energies - self._clusters.work()

    @property
    def work(self) -> tuple[float, float]:
        total = self._clusters.total
        return float(total('work_pushes')), float(total('work_grabs'))

    def measures(self) -> dict[str, float]:
        stats = self._clusters.totals()
        return {
            'energy_excess_J': float(self.energy_excesses.sum()),
            'energy_lifted_J': float(stats['work_position_correction']),
            'work_of_pushes_J': float(stats['work_pushes']),
            'work_of_grabs_J': float(stats['work_grabs']),
            'error_estimate_m': self._estimate_error(), 'error_trusted': True,
            'energy_removed_J': float(stats['energy_removed']),
            'energy_unremoved_J': float(stats['energy_unremoved']),
            'flights': int(stats['flight_steps']), 'substeps': int(stats['steps']),
            'flights_cut_total': int(stats['flights_cut']),
            'impacts': int(stats['impacts']), 'unsolved_total': int(stats['unsolved'])}

    def ledger(self) -> dict[str, int]:
        return self._clusters.ledger()

    def save(self) -> object:
        return (self._clusters.save(), self.sleeping.copy(), self._age.copy(),
                self._start_energies)

    def restore(self, snapshot: tuple) -> None:
        saved, self.sleeping[:], self._age[:], self._start_energies = snapshot
        self._clusters.restore(saved)
        self._last_start = None
        self._update_state()

    def discard(self, snapshot: object) -> None:
        """Nothing to release: the memory goes with the object."""

    def checkpoint(self) -> object:
        return self._clusters.checkpoint(), self.sleeping.copy(), self._start_energies

    def restore_checkpoint(self, checkpoint: tuple) -> None:
        saved, self.sleeping[:], self._start_energies = checkpoint
        self._clusters.restore_checkpoint(saved)
        self._age[:] = MAX_AGE
        self._last_start = None
        self._refresh()

    def close(self) -> None:
        self._clusters.close()

    def _update_clusters(self, duration: float) -> None:
        """Form clusters of the dolls that may touch within ``duration`` s, with the static geoms
        near them, and wake sleeping dolls among them. Sleeping dolls in contact stay together.
        """
        clusters = self._clusters
        pairs = self._pairs_to_form(duration) if len(self.scene.dolls) > 1 else None
        found_others = clusters.static_geoms.update(clusters.bone_states, duration,
                                                    ~self.sleeping & self._yielding)
        if pairs is not None:
            clusters.form(pairs)
        elif found_others:
            clusters.form(clusters.pairs)

    def _pairs_to_form(self, duration: float) -> np.ndarray | None:
        """Pairs (k, 2) of dolls from which to form clusters, or None if all clusters stay as they
        are. A cluster is renewed if it is older than MAX_AGE, or if a pair that it does not know,
        or one with a sleeping doll, may touch within ``duration`` s; sleeping dolls near it wake.
        All others are kept, so that their last digits do not depend on other dolls.
        """
        clusters, of_doll = self._clusters, self.cluster_of_doll
        near = self._near_pairs(duration)
        self._age += 1
        stale = clusters.have_pairs & (self._age > MAX_AGE)
        if len(near):
            stale[near[~clusters.knows(near) | self.sleeping[near].any(axis=1)]] = True
        if not np.count_nonzero(stale):
            return None
        while True:
            stale = (np.bincount(of_doll, stale) > 0)[of_doll]
            near = self._near_pairs(max(duration, LOOK_AHEAD))
            near = near[stale[near].any(axis=1)]
            if stale[near].all() and not self.sleeping[near].any():
                break
            stale[near] = True
            self._wake(near)
        self._age[stale] = 0
        kept = clusters.pairs[(~stale[clusters.pairs] | self.sleeping[clusters.pairs]).all(axis=1)]
        return np.unique(np.concatenate([near, kept]), axis=0)

    def _wake(self, dolls: np.ndarray) -> None:
        """Wake dolls, indices or a mask (d,)."""
        self.sleeping[dolls] = False

    def _near_pairs(self, ahead: float) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, at least one awake and one not
        kinematic.
        """
        # Bodies that do not yield have no contacts with each other.
        return self._broad_phase.pairs(self._clusters.bone_states, ahead, ~self.sleeping,
                                       self._yielding, self.cluster_of_doll)

    def _advance(self, duration: float, actions: tuple[Wrenches, Springs, Drives],
                 accuracy: Accuracy, twisted: list[int]) -> None:
        """Advance all clusters that are awake under ``actions``, then remove these. Twists of the
        dolls ``twisted`` have been set.
        """
        if twisted:
            self._clusters.follow_twists(twisted)
        acted = self._apply_actions(actions) if any(actions) else ()
        self._clusters.advance(duration, accuracy, self.sleeping)
        for cluster in acted:
            cluster.set_loads(NO_LOADS, NO_SPRINGS)
        self._update_state()

    def _update_state(self) -> None:
        """Copy state and sums from the clusters."""
        self._state = State.of(self._clusters.bone_states.copy())
        self._doll_totals = DollTotals.of(self._clusters.sum_rows.copy())

    def _apply_actions(self, actions: tuple[Wrenches, Springs, Drives]) -> list[Cluster]:
        """Set loads and springs of the clusters that ``actions`` act on; returns these clusters."""
        wrenches, springs, drives = actions
        clusters, yielding = self._clusters.members, self._yielding.tobytes()
        last_clusters, last_springs, last_yielding, records = self._standing
        if wrenches or drives or springs is not last_springs or clusters is not last_clusters or (
                yielding != last_yielding):
            records = list(self._records_of(actions))
            if not (wrenches or drives):
                self._standing = clusters, springs, yielding, records
        for cluster, loads, held in records:
            cluster.set_loads(loads, held)
        return [cluster for cluster, *_ in records]

    def _records_of(self, actions: tuple[Wrenches, Springs, Drives]) -> Iterator[
            tuple[Cluster, np.ndarray, np.ndarray]]:
        """The clusters that ``actions`` act on, each with its loads and springs."""
        acts: dict[int, tuple[list, list, list]] = {}
        for kind, given in enumerate(actions):
            for one in given:
                doll = self.scene.doll_of_bone[one.bone]
                if not self._yielding[doll]:
                    continue
                place = int(self._clusters.of_doll[doll])
                acts.setdefault(place, ([], [], []))[kind].append(one)
        for place, (loads, springs, drives) in acts.items():
            cluster = self._clusters.members[place]
            bones = cluster.bones.tolist()
            bodies = cluster.system.tree['bone'].tolist()
            yield cluster, load_records(loads, bones), spring_records(
                springs, drives, self.scene, bones, bodies)

    def _refresh(self) -> None:
        """Recompute bone states, sums and gaps from q and v."""
        self._clusters.advance(0.0, self.accuracy, np.zeros(len(self.sleeping), bool))
        self._update_state()

    def _in_root_axes(self, coordinates: GeneralizedState) -> np.ndarray:
        """Velocities (nv,) of ``coordinates``, with the roots' angular velocities along the roots'
        axes.
        """
        v = coordinates.v.copy()
        orientations = rotation.inverse(coordinates.q[self.layout.root_orientations])
        v[self._spins] = rotation.rotate(orientations, v[self._spins])
        return v

    def _lift_out_of_ground(self, dolls: Iterable[int]) -> None:
        """Move those ``dolls`` that penetrate the ground by more than is allowed onto it."""
        if self.scene.ground is None:
            return
        depths = -np.minimum.reduceat(self._heights(self.state),
                                      [own.start for own in self.scene.bone_slices])
        sunk = (depths > allowed_penetration(self.scene)) & self._yielding & (
            ~self._clusters.fixed_roots)
        for doll in (doll for doll in dolls if sunk[doll]):
            at = self.layout.root_positions[doll]
            self._clusters.q[at] += depths[doll] * np.array(self.scene.ground.normal)

    def _estimate_error(self) -> float:
        """Error, m, that the last interval added to the worst position.

        The interval is repeated with steps a quarter as long and a hundredth of the error in
        flight: a scheme of order 2 then has a sixteenth of the error.
        """
        if self._last_start is None:
            return 0.0
        q, v, duration, actions, twisted = self._last_start
        finer = dataclasses.replace(self.accuracy, step=ERROR_STEP_RATIO * self.accuracy.step,
                                    flight_error=self.accuracy.flight_error / 100)
        here, there = self.save(), self.state.positions
        clusters = self._clusters
        clusters.q[:], clusters.v[:] = q, v
        clusters.gather_state()
        clusters.invalidate()
        self._advance(duration, actions, finer, twisted)
        missed = np.linalg.norm(self.state.positions - there, axis=1).max()
        start = self._last_start
        self.restore(here)
        self._last_start = start
        return float(missed / (1 - ERROR_STEP_RATIO ** 2))

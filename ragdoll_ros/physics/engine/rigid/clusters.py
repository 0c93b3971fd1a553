"""Clusters: dolls that may touch soon are integrated as one system, every other doll alone."""
from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from ....model.coordinates import DofLayout
from ....model.scene import Scene
from ....model.scene_change import SceneChange
from ...accuracy import Accuracy
from ...kernels.cluster_state import (CLUSTER_STATE, IMPACT, LEDGER, STEP_STATS, ClusterState,
                                      make_cluster_state)
from ...kernels.compiling.bundle import bind, rebind
from ...kernels.contact_kind import LIMIT
from ...kernels.dynamics.body import MOVED, WORLD
from ...kernels.loaded import advance as kernels, links
from ...kernels.system import JOINT_OUTSIDE_LIMITS, KINEMATIC, OVERLAPPING, System
from ...kernels.workspace import Workspace, make_workspace
from ..protocol import GROUND, Impacts
from .broad_phase import NO_PAIRS
from .build_system import build_system, contact_laws, energy_scale, join_systems, make_pairs
from .contact_points import bone_pairs, contact_points
from .doll_states import SNAPSHOT, DollStates, contact_capacity
from .impact_records import join_impacts, logged_impacts
from .islands import LARGE_CLUSTER, next_window
from .static_geoms import NO_KEYS, StaticGeoms

SUMMED_STATS = ('flight_steps', 'steps', 'impacts', 'sweeps', 'unsolved', 'contacts_dropped',
                'toi_failures', 'restitution_reduced', 'energy_gains', 'work_pushes', 'work_grabs',
                'work_position_correction', 'energy_removed', 'energy_unremoved',
                'flights_cut')
"""Statistics that are summed over clusters."""

CHECKPOINT = ('q', 'v', 'excluded', 'contact_impulses', 'stats')
"""Fields of the states that a checkpoint stores; all others are computed from them."""

LOGGED_IMPACTS = 8
"""Room in the log of impacts, for each bone; what meets more often in a tick rattles."""

OWN_SCRATCH = ('stats', 'excluded', 'gaps')
"""Fields of a workspace that are those of a cluster's state."""

PARTS_PER_THREAD = 4
"""Parts of the work for each thread; a thread that finishes early takes another part."""


@dataclass
class Cluster:
    """Dolls that are integrated as one system, and the static geoms near them."""

    dolls: np.ndarray
    """(d,) in the scene's order."""
    pairs: np.ndarray
    """(k, 2) of dolls that may touch."""
    static_keys: np.ndarray
    """(s,) pairs of bones and static geoms that may touch, see static_geoms.py."""
    bones: np.ndarray
    """(n,) indices in the scene."""
    q_indices: np.ndarray
    v_indices: np.ndarray
    """(nq,), (nv,): indices of its coordinates and velocities in the scene's."""
    system: System
    state: ClusterState
    workspaces: list[Workspace]
    bundles: list[list[np.ndarray]]
    """Rows that bind system, state, and a workspace for each thread; see compiling/bundle.py."""
    islands: list[Cluster] = field(default_factory=list)
    """Those that were advanced in its place in the last window of a tick; see islands.py."""

    def job(self, worker: int) -> tuple[int, int, int]:
        """Addresses of system, workspace and state for the kernels on one of the threads."""
        system, state, *workspaces = (rows[0].ctypes.data for rows in self.bundles)
        return system, workspaces[worker % len(workspaces)], state

    def set_loads(self, loads: np.ndarray, springs: np.ndarray) -> None:
        """Set the loads and springs; discard the dense step."""
        state, row = self.state, self.bundles[1][0]
        if loads is not state.loads:
            rebind(row, CLUSTER_STATE, 'loads', loads)
        if springs is not state.springs:
            rebind(row, CLUSTER_STATE, 'springs', springs)
        self.state = state._replace(loads=loads, springs=springs)
        state.dense_step[:] = 0

    def log_impacts(self, enabled: bool) -> None:
        """Begin or end to log impacts."""
        if enabled != bool(len(self.state.impact_log)):
            self.state = self.state._replace(
                impact_log=np.zeros(enabled * LOGGED_IMPACTS * len(self.bones), IMPACT),
                impact_count=np.zeros(1, np.int64))
            self.bundles[1][0][:] = bind(self.state)[0]


class Clusters:
    """All dolls of a scene in clusters; coordinates, states and sums of the whole scene."""

    def __init__(self, scene: Scene, layout: DofLayout, workers: int,
                 like: Clusters | None = None) -> None:
        self._scene = scene
        self._systems, self._laws = _each_doll(scene, like)
        self.yielding = np.array([not placement.is_kinematic for placement in scene.dolls])
        """(d,) dolls that forces move; kinematic ones move at their velocities, whatever acts."""
        self.fixed_roots = np.array([placement.fixed_root for placement in scene.dolls])
        """(d,) dolls whose roots stay where they are."""
        self._q = [np.arange(own.start, own.stop) for own in layout.doll_q]
        self._v = [np.arange(own.start, own.stop) for own in layout.doll_v]
        self._doll_of_v = np.repeat(np.arange(len(self._v)), list(map(len, self._v)))
        self._fixed_v = np.zeros(len(self._doll_of_v), bool)
        """(nv,) those of fixed roots."""
        for doll in np.flatnonzero(self.fixed_roots):
            self._fixed_v[self._v[doll][:6]] = True
        self._bones = [np.arange(own.start, own.stop) for own in scene.bone_slices]
        self._shared: dict[int, tuple[list[Workspace], list[list[np.ndarray]]]] = {}
        """Of each system by its id: the workspaces that equal dolls share, and what binds both."""
        self.workers, self._threads = workers, None
        self._states = DollStates(self._systems)
        whole = self._states.arrays
        self.q, self.v, self.bone_states = whole['q'], whole['v'], whole['bone_states'].reshape(
            -1, 13)
        self.contact_impulses = whole['contact_impulses'].reshape(-1, 3)
        self.sum_rows = whole['doll_sums'].view(float).reshape(-1, 20)
        """(d, 20): the sums as DollTotals has them."""
        self.sums, self.stats = whole['doll_sums'], whole['stats']
        """The statistics of a cluster of several dolls are stored at its first doll."""
        self.departed = np.zeros(1, STEP_STATS)
        """Summed statistics of dolls that are gone."""
        first = STEP_STATS.fields['work_pushes'][1] // STEP_STATS.fields['work_grabs'][0].itemsize
        self._work = self.stats.view(float).reshape(len(self.stats), -1)[:, first:first + 2]
        """(d, 2) J, of pushes and of grabs."""
        trees = {id(system): system.tree['bone'] for system in self._systems}
        self._bone_of_body = np.concatenate([bones[trees[id(system)]] for system, bones in zip(
            self._systems, self._bones, strict=True)])
        """(n,) bones in the order of the dolls' trees."""
        self._first, self._first_q, self._first_v = (
            np.array([own.start for own in slices])
            for slices in (scene.bone_slices, layout.doll_q, layout.doll_v))
        self._effort = np.zeros(len(scene.dolls), np.int64)
        self._singles = [self._single(doll) for doll in range(len(scene.dolls))]
        self.members = list(self._singles)
        self.of_doll = np.arange(len(scene.dolls))
        """(d,) index in ``members`` of the cluster of each doll."""
        self.static_geoms = StaticGeoms(scene, self.reach())
        self._logs_impacts = False
        self._logged: list[Impacts] = []
        self._set_clusters(self.members)

    def __iter__(self) -> object:
        return iter(self.members)

    def reach(self) -> np.ndarray:
        """Upper bound (n,) m on the distance of each bone's farthest point from its
        center of mass.
        """
        reach = np.zeros(len(self._scene.bones))
        for system, bones in zip(self._systems, self._bones, strict=True):
            np.maximum.at(reach, bones[system.tree['bone'][system.geoms['body']]],
                          system.geoms['reach'])
        return reach

    def knows(self, pairs: np.ndarray) -> np.ndarray:
        """Which of these pairs (k, 2) of dolls are pairs of the clusters."""
        return np.array([key in self._keys_of_pairs for key in self._pair_keys(pairs).tolist()],
                        bool)

    def form(self, pairs: np.ndarray) -> None:
        """Form clusters of dolls that ``pairs`` (k, 2) connect; every other doll stays alone."""
        label = np.arange(len(self._singles))
        for one, other in pairs:
            low, high = sorted((label[one], label[other]))
            label[label == high] = low
        old = {_cluster_key(cluster.dolls, cluster.pairs, cluster.static_keys): cluster
               for cluster in self.members}
        made = []
        for first in np.unique(label):
            dolls = np.flatnonzero(label == first)
            own = pairs[label[pairs[:, 0]] == first] if len(pairs) else NO_PAIRS
            cluster = old.pop(_cluster_key(dolls, own, self.static_geoms.keys_of(dolls)), None)
            made.append(cluster or self._make(dolls, own))
        self._set_clusters(made)

    def advance(self, duration: float, accuracy: Accuracy, sleeping: np.ndarray) -> None:
        """Advance all clusters by ``duration`` s, except those of ``sleeping`` dolls (d,)."""
        jobs, whole = self._jobs, ~sleeping[self._firsts]
        self._logged = []
        for cluster in self._joined if duration else ():
            place = self.of_doll[cluster.dolls[0]]
            if not whole[place]:
                continue
            if len(cluster.system.tree) > LARGE_CLUSTER and (
                    self._advance_by_islands(cluster, duration, accuracy)):
                whole[place] = False
            elif cluster.islands:
                _invalidate(cluster)
        if np.count_nonzero(whole) < len(whole):  # a third of what all() costs
            jobs = jobs[:, whole]
        if self.workers == 1 or jobs.shape[1] < 2:
            kernels.advance(jobs[0], duration, *_tolerances(accuracy))
        else:
            self._advance_parallel(jobs, duration, accuracy, self._firsts[whole])
        for cluster in self._joined:
            if whole[self.of_doll[cluster.dolls[0]]]:
                self._scatter_state(cluster)
        if self._logs_impacts:
            self._collect_impacts(itertools.compress(self.members, whole), 0.0)

    def log_impacts(self, enabled: bool) -> None:
        """Begin or end to log impacts."""
        self._logs_impacts = enabled
        for cluster in (*self._singles, *self.members):
            cluster.log_impacts(enabled)

    def impacts(self) -> Impacts | None:
        """Impacts in the last advance(); None: they are not logged."""
        if not self._logs_impacts:
            return None
        return join_impacts(self._logged)

    def set_velocities(self, dolls: np.ndarray, velocities: np.ndarray) -> None:
        """Set the velocities of ``dolls`` (d,), whole clusters, to those in ``velocities``, but for
        those of kinematic ones and of fixed roots.
        """
        own = (dolls & self.yielding)[self._doll_of_v] & ~self._fixed_v
        self.v[own] = velocities[own]
        self._states.arrays['dense_step'][dolls] = 0
        for cluster in self._joined:
            if dolls[cluster.dolls[0]]:
                cluster.state.v[:] = self.v[cluster.v_indices]
                cluster.state.dense_step[:] = 0

    def set_twists(self, dolls: np.ndarray, twists: np.ndarray) -> None:
        """Set the twists (m, 6), world frame, of kinematic ``dolls`` (m,) of one bone; the contacts
        of their clusters are kept.
        """
        links.set_twists(self.q, self.v, self.bone_states, self._first_q, self._first_v,
                         self._first, dolls, twists)
        for place in set(self.of_doll[dolls].tolist()):
            cluster = self.members[place]
            if not self._is_single(cluster):
                cluster.state.v[:] = self.v[cluster.v_indices]
                cluster.state.dense_step[:] = 0

    def set_motion(self, dolls: Sequence[int], q: np.ndarray, v: np.ndarray) -> None:
        """Set the coordinates and velocities of kinematic ``dolls`` to theirs in ``q`` (nq,) and
        ``v`` (nv,) of the scene; the contacts of their clusters are kept.
        """
        for doll in dolls:
            self.q[self._q[doll]], self.v[self._v[doll]] = q[self._q[doll]], v[self._v[doll]]
            cluster = self.members[self.of_doll[doll]]
            cluster.state.q[:] = self.q[cluster.q_indices]
            cluster.state.v[:] = self.v[cluster.v_indices]
            cluster.state.dense_step[:] = 0
            cluster.state.stats['gaps_current'] = 0

    def set_kinematic(self, doll: int, kinematic: bool) -> None:
        """Make a doll kinematic, so that it moves at its velocities whatever acts on it, or end
        that. A kinematic doll has no contacts with itself, static bodies and the ground, and no
        joint limits. When that ends, its geoms that overlap do not collide until they separate, nor
        those with a joint outside its limits between them until it is inside.
        """
        self.yielding[doll] = not kinematic
        cluster, single = self.members[self.of_doll[doll]], self._singles[doll]
        for one in {id(each): each for each in (single, cluster)}.values():
            system, place = one.system, int(np.searchsorted(one.dolls, doll))
            system.tree['kinematic'][system.body_doll == place] = MOVED if kinematic else 0
            own = system.geoms[system.geoms['body'] != WORLD]
            if not system.tree['kinematic'].all():
                system.energy_scale[:] = energy_scale(system.tree, own, system.gravity)
            excluded = self._own_excluded(one, doll)
            excluded[:] = excluded | KINEMATIC if kinematic else (
                excluded & ~KINEMATIC | OVERLAPPING | JOINT_OUTSIDE_LIMITS)
            _invalidate(one)

    def follow_twists(self, dolls: list[int]) -> None:
        """Mark that the twists of ``dolls`` were set: in the next advance() what touches them
        follows at once.
        """
        self.stats['twist_changed'][self._firsts[self.of_doll[dolls]]] = 1

    def set_doll(self, doll: int, q: np.ndarray, v: np.ndarray) -> None:
        """Set the coordinates and velocities of a doll to its own in ``q`` (nq,) and ``v`` (nv,) of
        the scene, and discard what its cluster has computed from the old ones.
        """
        self.q[self._q[doll]], self.v[self._v[doll]] = q[self._q[doll]], v[self._v[doll]]
        cluster = self.members[self.of_doll[doll]]
        cluster.state.q[:] = self.q[cluster.q_indices]
        cluster.state.v[:] = self.v[cluster.v_indices]
        _invalidate(cluster)

    def add_work(self, energies: np.ndarray) -> None:
        """Add energies (d,) J to the work of pushes of the dolls' clusters."""
        np.add.at(self.stats['work_pushes'], self._firsts[self.of_doll], energies)

    def gather_state(self) -> None:
        """Copy the scene's q and v into the clusters that have their own."""
        for cluster in self._joined:
            cluster.state.q[:] = self.q[cluster.q_indices]
            cluster.state.v[:] = self.v[cluster.v_indices]

    def exclude(self, flags: list[np.ndarray]) -> None:
        """Set the exclusion flags (p,) of each doll's pairs of geoms; see kernels/system.py."""
        for cluster, own, yields in zip(self._singles, flags, self.yielding, strict=True):
            cluster.state.excluded[:] = own | KINEMATIC * (not yields)

    def exclude_overlaps(self, doll: int) -> None:
        """Exclude those pairs of geoms of a doll that overlap in the state that is set next, until
        they separate, and those with a joint outside its limits between them, until it is inside.
        """
        for one in (self._singles[doll], self.members[self.of_doll[doll]]):
            excluded = self._own_excluded(one, doll)
            excluded |= OVERLAPPING | JOINT_OUTSIDE_LIMITS

    def _own_excluded(self, cluster: Cluster, doll: int) -> np.ndarray:
        """View of the exclusion flags (p,) of a doll's pairs in the state of its cluster."""
        before = sum(len(self._singles[other].state.excluded)
                     for other in itertools.takewhile(lambda other: other != doll, cluster.dolls))
        return cluster.state.excluded[before:before + len(self._singles[doll].state.excluded)]

    def excluded(self, kind: int) -> list[np.ndarray]:
        """Flags (p,) of each doll's pairs: of ``kind``, OVERLAPPING or JOINT_OUTSIDE_LIMITS."""
        return [cluster.state.excluded & kind for cluster in self._singles]

    def separate(self) -> None:
        """Make each doll a cluster by itself, with nothing near, and invalidate their contacts,
        gaps and steps.
        """
        self.static_geoms.clear()
        self._set_clusters(list(self._singles))
        self.invalidate()

    def invalidate(self) -> None:
        """Discard contacts, gaps and steps of flight: q and v have been set."""
        for cluster in self.members:
            _invalidate(cluster)

    def close(self) -> None:
        """End the threads."""
        if self._threads:
            self._threads.shutdown()
            self._threads = None

    def work(self) -> np.ndarray:
        """Work (d,) of pushes and grabs since the start, J; that of a cluster at its first doll."""
        return self._work.sum(axis=1)

    def totals(self) -> dict[str, float]:
        """Statistics since the start, summed over clusters."""
        return {name: self.total(name) for name in SUMMED_STATS}

    def total(self, name: str) -> float:
        """One of the `totals`."""
        return self.stats[name].sum() + self.departed[name][0]

    def ledger(self) -> dict[str, int]:
        """Counters of what all steps since the start are made of; see LEDGER."""
        counted = ('steps', 'impacts', 'flight_steps', 'sweeps')
        both = np.concatenate([self.stats, self.departed])
        return {**{name: int(both[name].sum()) for name in counted},
                **{name: int(both['ledger'][name].sum()) for name in LEDGER.names}}

    def contacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Contacts (c,) of each cluster's last step, without joint limits; clusters in flight have
        none. Also what touches, (c, 3), as indices in the scene: a bone, another bone or GROUND,
        and a static body or GROUND; and the length (c,) s of the step.
        """
        if len(self._singles) == 1:
            return self._points_of(self.members[0], self._bone_of_body)
        arrays, single = self._states.arrays, np.ones(len(self._singles), bool)
        for cluster in self._joined:
            single[cluster.dolls] = False
        known, dolls = self._states.contacts_of(single & (arrays['dense_step']['valid'] == 0))
        found = [contact_points(arrays['contacts'][known], self._bone_of_body, self._first[dolls],
                                np.full(len(known), GROUND), self.stats['last_dt'][dolls])]
        found += [self._points_of(cluster, cluster.bones[cluster.system.tree['bone']])
                  for cluster in itertools.chain.from_iterable(
                      cluster.islands or [cluster] for cluster in self._joined)]
        return tuple(map(np.concatenate, zip(*found, strict=True)))

    def on_ground(self) -> np.ndarray:
        """Which bones (n,) have a contact with the ground or a static body; in a scene of one doll
        ten times as fast as contacts().
        """
        on = np.zeros(len(self._bone_of_body), bool)
        if len(self._singles) == 1:
            known = _known_contacts(self.members[0])
            touching = (known['kind'] != LIMIT) & (known['body_b'] < 0)
            on[self._bone_of_body[known['body_a'][touching]]] = True
        else:
            _, bones, _ = self.contacts()
            on[bones[bones[:, 1] == GROUND, 0]] = True
        return on

    def _points_of(self, cluster: Cluster,
                   bone_of_body: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What contacts() returns, of one cluster."""
        known = _known_contacts(cluster)
        return contact_points(known, bone_of_body, np.zeros(len(known), np.int64),
                              self._touched_bodies(cluster, known),
                              np.full(len(known), cluster.state.stats['last_dt'][0]))

    def static_bodies(self, cluster: Cluster) -> np.ndarray:
        """Static body (s,), as an index in the scene, of each of the s static geoms of a cluster,
        which are its last geoms.
        """
        _, near = self.static_geoms.bones_and_geoms(cluster.static_keys)
        return self.static_geoms.bodies[np.unique(near)]

    def _touched_bodies(self, cluster: Cluster, contacts: np.ndarray) -> np.ndarray:
        """Indices (c,) of the static bodies that contacts of a cluster touch, or GROUND."""
        bodies = np.full(len(contacts), GROUND)
        if len(cluster.static_keys):
            system, static = cluster.system, self.static_bodies(cluster)
            of_geom = np.append(np.full(len(system.geoms) - len(static), GROUND), static)
            pair = contacts['patch'] - len(system.geoms)
            bodies[pair >= 0] = of_geom[system.pairs['b'][pair[pair >= 0]]]
        return bodies

    def _collect_impacts(self, clusters: Iterable[Cluster], since: float) -> None:
        """Read the impact logs of clusters; their times count from ``since`` s after the start of
        the advance.
        """
        for cluster in clusters:
            count, log = int(cluster.state.impact_count[0]), cluster.state.impact_log
            if count:
                log = log[:count]
                pairs = bone_pairs(log, cluster.bones[cluster.system.tree['bone']],
                                   np.zeros(len(log), np.int64), self._touched_bodies(cluster, log))
                self._logged.append(logged_impacts(log, pairs, since, count - len(log)))

    def save(self) -> object:
        """A snapshot that restore() brings back to the bit."""
        return (self._states.save(), self.departed.copy(), self.members, self.static_geoms.save(),
                [_saved(cluster) for cluster in self._joined])

    def restore(self, snapshot: tuple) -> None:
        """Restore a snapshot."""
        states, self.departed[:], members, near, several = snapshot
        self._states.restore(states)
        self.static_geoms.restore(near)
        if members is not self.members:
            self._set_clusters(members)
        for saved in several:
            _restore(*saved)

    def continue_from(self, other: Clusters, change: SceneChange) -> None:
        """Take from ``other``, of the scene before the change, the states of the dolls that stay,
        and the clusters of which no doll goes. All other dolls become clusters by themselves.
        """
        for doll, old in enumerate(change.old_dolls):
            if old >= 0:
                self._states.copy(doll, other._states, old)
        self._depart(other, change.new_dolls < 0)
        whole = np.ones(len(change.new_dolls), bool)
        members = {}
        for cluster in other.members:
            dolls = change.new_dolls[cluster.dolls]
            if (dolls >= 0).all():
                members[dolls[0]] = self._moved(cluster, other, change)
            else:
                whole[cluster.dolls] = False
        of_member = {doll for cluster in members.values() for doll in cluster.dolls.tolist()}
        for doll, single in enumerate(self._singles):
            if doll not in of_member:
                members[doll] = single
                _invalidate(single)
        self.static_geoms.continue_from(other.static_geoms, change, whole)
        self._set_clusters([members[first] for first in sorted(members)])

    def save_states(self, dolls: np.ndarray) -> list[tuple]:
        """Copy the states of ``dolls`` (d,), whole clusters."""
        return [_saved(cluster) for cluster in self.members if dolls[cluster.dolls[0]]]

    def restore_states(self, saved: list[tuple]) -> None:
        """Restore states of clusters to the bit; the clusters must still be the same."""
        for cluster, *rest in saved:
            _restore(cluster, *rest)
            if not self._is_single(cluster):
                self._scatter_state(cluster)

    def checkpoint(self) -> dict[str, np.ndarray]:
        """Copy the fields CHECKPOINT of all states, and the statistics of departed dolls, as bytes,
        because numpy copies records slowly.
        """
        return {'departed': self.departed.view(np.uint8).copy(), **{
            name: self._states.arrays[name].view(np.uint8).copy() for name in CHECKPOINT}}

    def restore_checkpoint(self, checkpoint: dict[str, np.ndarray]) -> None:
        """Restore a checkpoint, each doll a cluster by itself."""
        self.departed.view(np.uint8)[:] = checkpoint['departed']
        for name in CHECKPOINT:
            self._states.arrays[name].view(np.uint8)[:] = checkpoint[name]
        self.separate()

    def _depart(self, other: Clusters, gone: np.ndarray) -> None:
        """Add the statistics of the dolls of ``other`` that are ``gone`` (d,) to the departed."""
        self.departed[:] = other.departed
        for name in SUMMED_STATS:
            self.departed[name] += other.stats[name][gone].sum()
        for name in LEDGER.names:
            self.departed['ledger'][name] += other.stats['ledger'][name][gone].sum()

    def _moved(self, cluster: Cluster, other: Clusters, change: SceneChange) -> Cluster:
        """A cluster of ``other``, all of whose dolls stay, with the indices of the scene after a
        change. Its state is shared, but for the statistics; a single doll's cluster is this scene's
        own.
        """
        dolls = change.new_dolls[cluster.dolls]
        if other._is_single(cluster):
            return self._singles[dolls[0]]
        bones, q, v = (np.concatenate([parts[doll] for doll in dolls])
                       for parts in (self._bones, self._q, self._v))
        stats = self.stats[dolls[0]:dolls[0] + 1]
        moved = _bind_cluster(
            dolls, change.new_dolls[cluster.pairs],
            self.static_geoms.moved_keys(cluster.static_keys, change), bones, q, v, cluster.system,
            cluster.state._replace(stats=stats),
            [workspace._replace(stats=stats) for workspace in cluster.workspaces])
        moved.islands = [self._moved(island, other, change) for island in cluster.islands]
        return moved

    def _pair_keys(self, pairs: np.ndarray) -> np.ndarray:
        """A unique number of each pair (k, 2)."""
        return pairs[:, 0] * len(self._singles) + pairs[:, 1]

    def _is_single(self, cluster: Cluster) -> bool:
        """Whether a cluster's state is a view of the scene's; of others it is copied there."""
        return cluster is self._singles[cluster.dolls[0]]

    def _set_clusters(self, clusters: list[Cluster]) -> None:
        self.members = clusters
        for cluster in clusters:
            cluster.log_impacts(self._logs_impacts)
        for place, cluster in enumerate(clusters):
            self.of_doll[cluster.dolls] = place
        self._joined = [cluster for cluster in clusters if not self._is_single(cluster)]
        self._firsts = np.array([cluster.dolls[0] for cluster in clusters])
        self.pairs = np.concatenate([NO_PAIRS, *(cluster.pairs for cluster in self._joined)])
        """(k, 2) of dolls that may touch, of all clusters."""
        self.have_pairs = np.zeros(len(self._singles), bool)
        """(d,) which dolls may touch others."""
        self.have_pairs[self.pairs] = True
        self._keys_of_pairs = frozenset(self._pair_keys(self.pairs).tolist())
        self._jobs = np.array([[cluster.job(worker) for cluster in clusters]
                               for worker in range(self.workers)], np.int64)
        """(workers, k, 3)"""

    def _advance_parallel(self, jobs: np.ndarray, duration: float, accuracy: Accuracy,
                          firsts: np.ndarray) -> None:
        """Advance clusters on several threads, those first that took most steps the last time.
        ``firsts`` (k,): the first doll of each.
        """
        self._threads = self._threads or ThreadPoolExecutor(self.workers - 1, 'clusters')
        effort = self.stats['steps'] + self.stats['impacts'] + 6 * self.stats['flight_steps']
        spent, self._effort = effort - self._effort, effort
        order = np.argsort(-spent[firsts], kind='stable')
        shares = min(len(order), PARTS_PER_THREAD * self.workers)
        parts = itertools.count()

        def work(worker: int) -> None:
            while (part := next(parts)) < shares:
                kernels.advance(jobs[worker, order[part::shares]], duration, *_tolerances(accuracy))

        others = [self._threads.submit(work, worker) for worker in range(1, self.workers)]
        work(0)
        for other in others:
            other.result()

    def _advance_by_islands(self, cluster: Cluster, duration: float, accuracy: Accuracy) -> bool:
        """Advance a cluster by ``duration`` s in windows in which it falls into islands. Returns
        whether it was advanced; not, if loads or springs act or the first window has no islands:
        then it is to be advanced as a whole.
        """
        if len(cluster.state.loads) or len(cluster.state.springs):
            return False
        body_counts = np.array([len(self._bones[doll]) for doll in cluster.dolls])
        left, made = duration, {}
        while left > 0:
            window, label = next_window(np.array(cluster.job(0)), body_counts, left,
                                        accuracy.touching)
            if not window and not made:
                return False
            made = self._form_islands(cluster, label, made)
            window = window or left
            kernels.advance(np.array([island.job(0) for island in made.values()]), window,
                            *_tolerances(accuracy))
            for island in made.values():
                if not self._is_single(island):
                    self._scatter_state(island)
            if self._logs_impacts:
                self._collect_impacts(made.values(), duration - left)
            cluster.state.q[:] = self.q[cluster.q_indices]
            cluster.state.v[:] = self.v[cluster.v_indices]
            left -= window
        # Not invalidated before it is advanced itself: an island shares its statistics.
        cluster.state.bone_states[:] = self.bone_states[cluster.bones]
        cluster.state.contact_impulses[:] = self.contact_impulses[cluster.bones]
        cluster.state.doll_sums[:] = self.sums[cluster.dolls]
        cluster.state.excluded[:] = np.concatenate(self._excluded(cluster))
        cluster.islands = list(made.values())
        return True

    def _form_islands(self, cluster: Cluster, label: np.ndarray,
                      before: dict[bytes, Cluster]) -> dict[bytes, Cluster]:
        """Form the islands of a cluster by ``label`` (d,); an island of the window ``before`` that
        has the same dolls is kept.
        """
        made = {}
        for number in np.unique(label):
            dolls = cluster.dolls[label == number]
            key = dolls.tobytes()
            made[key] = before.get(key)
            if made[key] is None:
                own = cluster.pairs[np.isin(cluster.pairs, dolls).all(axis=1)]
                made[key] = self._make(dolls, own)
        return made

    def _excluded(self, cluster: Cluster) -> list[np.ndarray]:
        """Exclusion flags of the pairs of each doll of a cluster."""
        return [self._singles[doll].state.excluded for doll in cluster.dolls]

    def _scatter_state(self, cluster: Cluster) -> None:
        """Copy the state of a cluster that has a state of its own into the scene's arrays."""
        self.q[cluster.q_indices], self.v[cluster.v_indices] = cluster.state.q, cluster.state.v
        self.bone_states[cluster.bones] = cluster.state.bone_states
        self.contact_impulses[cluster.bones] = cluster.state.contact_impulses
        self.sums[cluster.dolls] = cluster.state.doll_sums
        at = 0
        for excluded in self._excluded(cluster):
            excluded[:] = cluster.state.excluded[at:at + len(excluded)]
            at += len(excluded)

    def _single(self, doll: int) -> Cluster:
        """The cluster of one doll, a view of the scene's state; equal dolls share workspaces."""
        system, state = self._systems[doll], self._states[doll]
        bones, q, v = self._bones[doll], self._q[doll], self._v[doll]
        if id(system) not in self._shared:
            made = [make_workspace(system, state) for _ in range(self.workers)]
            self._shared[id(system)] = made, [bind(part) for part in (system, *made)]
        shared, (bound, *each) = self._shared[id(system)]
        workspaces = [one._replace(**{name: getattr(state, name) for name in OWN_SCRATCH})
                      for one in shared]
        rows = [_bound_alike(rows, one) for rows, one in zip(each, workspaces, strict=True)]
        return Cluster(np.array([doll]), NO_PAIRS, NO_KEYS, bones, q, v, system, state, workspaces,
                       [bound, bind(state), *rows])

    def _make(self, dolls: np.ndarray, pairs: np.ndarray) -> Cluster:
        """A cluster of ``dolls`` with their present coordinates and velocities."""
        keys = self.static_geoms.keys_of(dolls)
        made = (self._join(dolls, pairs, keys) if len(dolls) > 1 or len(keys)
                else self._singles[dolls[0]])
        made.log_impacts(self._logs_impacts)
        _invalidate(made)
        return made

    def _join(self, dolls: np.ndarray, pairs: np.ndarray, keys: np.ndarray) -> Cluster:
        """Make a cluster that has a state of its own; ``keys`` (s,): its pairs of bones and static
        geoms that may touch.
        """
        systems = [self._systems[doll] for doll in dolls]
        bones, q, v = (np.concatenate([parts[doll] for doll in dolls])
                       for parts in (self._bones, self._q, self._v))
        touching, points, static_geoms = self._static_pairs(systems, bones, keys)
        doll_pairs = _pairs_of_dolls(dolls, systems, pairs)
        geom_pairs = np.concatenate([doll_pairs, touching])
        points = np.concatenate([np.zeros(len(doll_pairs), np.int64), points])
        laws = np.concatenate([*(self._laws[doll] for doll in dolls),
                               self.static_geoms.laws[static_geoms]])
        system = join_systems(systems, make_pairs(geom_pairs, laws, points),
                              *self.static_geoms.take(static_geoms))
        state = make_cluster_state(system, contact_capacity(system))._replace(
            q=self.q[q], v=self.v[v], contact_impulses=self.contact_impulses[bones],
            stats=self.stats[dolls[0]:dolls[0] + 1],
            excluded=np.concatenate([self._singles[doll].state.excluded for doll in dolls]))
        return _bind_cluster(dolls, pairs, keys, bones, q, v, system, state,
                             [make_workspace(system, state)])

    def _static_pairs(self, systems: list[System], bones: np.ndarray,
                      keys: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pairs (p, 2) of geoms of joined ``systems`` with static geoms, which are numbered after
        them, by ``keys``. Also, for pairs with planes, which point (p,) of the geom may touch it,
        else 0; and the indices (s,) of the static geoms in the scene.
        """
        bone_of_geom = np.concatenate([
            own[system.tree['bone'][system.geoms['body']]] for system, own in zip(
                systems, np.split(bones, np.cumsum([len(one.tree) for one in systems])[:-1]),
                strict=True)])
        near_bones, near_geoms = self.static_geoms.bones_and_geoms(keys)
        static_geoms, place = np.unique(near_geoms, return_inverse=True)
        # Geoms are in the order of bones.
        begin = np.searchsorted(bone_of_geom, near_bones)
        count = np.searchsorted(bone_of_geom, near_bones, side='right') - begin
        geoms = np.repeat(begin - np.cumsum(count) + count, count) + np.arange(count.sum())
        place = np.repeat(place, count)
        pairs = np.stack([geoms, len(bone_of_geom) + place], 1)
        touching = np.concatenate([system.geoms[['kind', 'point_count']] for system in systems])
        repeats = self.static_geoms.pair_counts(touching[geoms], static_geoms[place])
        points = np.arange(repeats.sum()) - np.repeat(np.cumsum(repeats) - repeats, repeats)
        return np.repeat(pairs, repeats, axis=0), points, static_geoms


def _pairs_of_dolls(dolls: np.ndarray, systems: list[System], pairs: np.ndarray) -> np.ndarray:
    """All pairs (p, 2) of geoms of the ``dolls`` (d,) that ``pairs`` (k, 2) of dolls connect; geoms
    are numbered through the ``systems`` of all dolls.
    """
    firsts = np.cumsum([0, *(len(system.geoms) for system in systems)])
    place = {int(doll): k for k, doll in enumerate(dolls)}
    found = [NO_PAIRS]
    for one, other in pairs:
        a, b = (np.arange(firsts[k], firsts[k + 1]) for k in (place[int(one)], place[int(other)]))
        found.append(_every_pair(a, b))
    return np.concatenate(found)


def _every_pair(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """All pairs (p, 2) of an index of ``a`` and one of ``b``, in the order of ``a``, then
    of ``b``.
    """
    return np.stack(np.meshgrid(a, b, indexing='ij'), -1).reshape(-1, 2)


def _cluster_key(dolls: np.ndarray, pairs: np.ndarray, keys: np.ndarray) -> tuple:
    return dolls.tobytes(), pairs.tobytes(), keys.tobytes()


def _tolerances(accuracy: Accuracy) -> tuple[float, float, float, float]:
    """The arguments of kernels.advance() that come from an accuracy, in their order."""
    return accuracy.step, accuracy.flight_error, accuracy.solve_error, accuracy.touching


def _invalidate(cluster: Cluster) -> None:
    """Discard a cluster's dense step, contacts, gaps and step lengths: q or v has been set."""
    cluster.islands = []
    cluster.state.dense_step[:] = cluster.state.contact_accelerations[:] = 0
    for name in ('contact_count', 'ended_without_impact', 'last_dt', 'next_dt', 'smooth_dt',
                 'acceleration_dt', 'gaps_current'):
        cluster.state.stats[name] = 0


def _saved(cluster: Cluster) -> tuple[Cluster, ClusterState, list[tuple]]:
    """A cluster with a copy of its state, and its islands with theirs."""
    return cluster, _copied(cluster.state), [_saved(island) for island in cluster.islands]


def _restore(cluster: Cluster, state: ClusterState, islands: list[tuple]) -> None:
    """Write the saved copies of the states of a cluster and of its islands back to them."""
    cluster.islands = [island for island, *_ in islands]
    for saved in islands:
        _restore(*saved)
    for name in SNAPSHOT:
        getattr(cluster.state, name)[:] = getattr(state, name)
    cluster.state.contacts[:len(state.contacts)] = state.contacts


def _bind_cluster(*parts: object) -> Cluster:
    """Make a Cluster from ``parts``, its fields up to ``workspaces``, and bind system, state and
    workspaces.
    """
    system, state, workspaces = parts[-3:]
    return Cluster(*parts, [bind(part) for part in (system, state, *workspaces)])


def _bound_alike(rows: list[np.ndarray], workspace: Workspace) -> list[np.ndarray]:
    """Rows that bind ``workspace``, made from the ``rows`` of another one that differs only in
    OWN_SCRATCH: to bind all of its arrays would take most of the time of adding and removing dolls.
    """
    row, at = rows[0].copy(), 0
    for name, part in zip(workspace._fields, workspace, strict=True):
        if name in OWN_SCRATCH:
            row[at] = part.ctypes.data
        at += 1 if isinstance(part, tuple) else 1 + part.ndim
    return [row, *rows[1:]]


def _each_doll(scene: Scene, like: Clusters | None) -> tuple[list[System], list[np.ndarray]]:
    """The system of each doll by itself, and the contact laws of its geoms; equal dolls share
    theirs, also with those of ``like``, whose scene differs in its dolls alone.
    """
    made: dict[tuple[object, ...], tuple[System, np.ndarray]] = {}
    if like is not None:
        made = dict(zip(_keys(like._scene), zip(like._systems, like._laws, strict=True),
                        strict=True))
    keys = _keys(scene)
    for key, placement in zip(keys, scene.dolls, strict=True):
        if key not in made:
            alone = dataclasses.replace(scene, dolls=(placement,), bodies=(), robots=())
            made[key] = build_system(alone), contact_laws(alone)
    each = [made[key] for key in keys]
    return [system for system, _ in each], [laws for _, laws in each]


def _keys(scene: Scene) -> list[tuple[object, ...]]:
    """A key for each doll of a scene: dolls of equal keys have the same system. The system of an
    animated doll changes when it goes limp, so its key is unique to the doll and the scene.
    """
    return [(id(placement.doll), placement.is_kinematic, placement.fixed_root)
            if not placement.is_animated
            else (id(placement.doll), placement.name, id(scene)) for placement in scene.dolls]


def _known_contacts(cluster: Cluster) -> np.ndarray:
    """Contacts, and joints at their limits, of a cluster's last step; none in flight."""
    state = cluster.state
    return state.contacts[:0 if state.dense_step['valid'][0]
                          else int(state.stats['contact_count'][0])]


def _copied(state: ClusterState) -> ClusterState:
    known = state.contacts[:int(state.stats['contact_count'][0])]
    return ClusterState(*(part.copy() for part in state._replace(contacts=known)))

"""Dolls that may touch go on together, each other doll goes its own way."""
from __future__ import annotations

import dataclasses
import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ....model.coordinates import DofLayout
from ....model.scene import Scene
from ...accuracy import Accuracy
from ...kernels.compiling.bundle import bind
from ...kernels.loaded import advance as kernels
from ...kernels.system import TALLY, Course, Room, System, make_course, make_room
from ..protocol import GROUND
from .broad_phase import NO_COUPLES
from .build_system import joined, pairs_between, system_of
from .doll_states import KEPT, Courses, room_for_contacts

COUNTS = ('flights', 'steps', 'impacts', 'sweeps', 'unsolved', 'left_out', 'stalls', 'softened',
          'gains', 'pushed', 'handed', 'lifted')
"""What of a tally is summed over clusters."""

UNSEEN = ('q', 'v', 'within', 'tally')
"""What of the courses is in a checkpoint: all else follows from it."""

SHARES = 4
"""Parts of the work for each thread: who is done early takes one more."""


@dataclass
class Cluster:
    """Some dolls, in the scene's order, and which of them may touch each other: (k, 2)."""

    dolls: np.ndarray
    couples: np.ndarray
    bones: np.ndarray
    """Their places in the scene."""
    q: np.ndarray
    v: np.ndarray
    """Where their coordinates and velocities stand among the scene's."""
    system: System
    course: Course
    rooms: list[Room]
    bundles: list[list[np.ndarray]]
    """The rows that bind system, course, and a room for each worker; see compiling/bundle.py."""

    def addresses(self, worker: int) -> list[int]:
        """Of its bundles, for compiled code."""
        system, course, *rooms = (rows[0].ctypes.data for rows in self.bundles)
        return [system, rooms[worker % len(rooms)], course]

    def use(self, course: Course) -> None:
        """Go on with this course, of which other arrays act than before."""
        self.course = course
        self.bundles[1][0][:] = bind(course)[0]


class Clusters:
    """All dolls of a scene, in clusters; states and sums of the whole scene."""

    def __init__(self, scene: Scene, layout: DofLayout, workers: int) -> None:
        self._scene = scene
        self._systems = _systems(scene)
        self._q = [np.arange(own.start, own.stop) for own in layout.doll_q]
        self._v = [np.arange(own.start, own.stop) for own in layout.doll_v]
        self._doll_of_v = np.repeat(np.arange(len(self._v)), list(map(len, self._v)))
        self._bones = [np.arange(own.start, own.stop) for own in scene.bone_slices]
        self._rooms: dict[int, list[Room]] = {}
        self._workers, self._threads = workers, None
        self._courses = Courses(self._systems)
        whole = self._courses.whole
        self.q, self.v, self.rows = whole['q'], whole['v'], whole['rows'].reshape(-1, 13)
        self.sums, self.tally = whole['sums'], whole['tally']
        """A joined cluster counts where its first doll does."""
        first = TALLY.fields['pushed'][1] // TALLY.fields['handed'][0].itemsize
        self._work = self.tally.view(float).reshape(len(self.tally), -1)[:, first:first + 2]
        """(d, 2) J, of pushes and of hands."""
        trees = {id(system): system.tree['bone'] for system in self._systems}
        self._records = np.concatenate([bones[trees[id(system)]] for system, bones in zip(
            self._systems, self._bones, strict=True)])
        """(n,) bones in the order of the dolls' trees."""
        self._first = np.array([own.start for own in scene.bone_slices])
        self._effort = np.zeros(len(scene.dolls), np.int64)
        self._alone = [self._single(doll) for doll in range(len(scene.dolls))]
        self.members = list(self._alone)
        self.of_doll = np.arange(len(scene.dolls))
        """Which of ``members`` each doll is in."""
        self._set(self.members)

    def __iter__(self) -> object:
        return iter(self.members)

    def reach(self) -> np.ndarray:
        """Reach (n,) m of each bone from its centre of mass."""
        reach = np.zeros(len(self._scene.bones))
        for system, bones in zip(self._systems, self._bones, strict=True):
            np.maximum.at(reach, bones[system.tree['bone'][system.geoms['bone']]],
                          system.geoms['reach'])
        return reach

    @property
    def all_alone(self) -> bool:
        """Whether each doll goes on by itself."""
        return not self._joined

    def know(self, couples: np.ndarray) -> bool:
        """Whether all these (k, 2) are in the couples of the clusters."""
        return not len(couples) or bool(np.isin(
            self._numbers(couples), self._known_numbers).all())

    def group(self, couples: np.ndarray) -> None:
        """Let those dolls go on together that ``couples`` (k, 2) join, others by themselves."""
        label = np.arange(len(self._alone))
        for one, other in couples:
            low, high = sorted((label[one], label[other]))
            label[label == high] = low
        old = {self._key(cluster.dolls, cluster.couples): cluster for cluster in self.members}
        made = []
        for first in np.unique(label):
            dolls = np.flatnonzero(label == first)
            own = couples[label[couples[:, 0]] == first] if len(couples) else NO_COUPLES
            cluster = old.pop(self._key(dolls, own), None)
            made.append(cluster or (self._join(dolls, own) if len(dolls) > 1
                                    else self._alone[dolls[0]]))
            if cluster is None:
                self._begin(made[-1])
        self._set(made)

    def advance(self, duration: float, accuracy: Accuracy, resting: np.ndarray) -> None:
        """Take all clusters on by ``duration`` s, but for those of ``resting`` dolls (d,)."""
        jobs = self._jobs
        if np.count_nonzero(resting):
            jobs = jobs[:, ~resting[self._firsts]]
        if self._workers == 1 or jobs.shape[1] < 2:
            kernels.advance(jobs[0], duration, accuracy.step, accuracy.flight_error)
        else:
            self._spread_out(jobs, duration, accuracy, resting)
        for cluster in self._joined:
            if not resting[cluster.dolls[0]]:
                self._spread(cluster)

    def stop(self, dolls: np.ndarray) -> None:
        """Take all speed from ``dolls`` (d,), whole clusters."""
        self.v[dolls[self._doll_of_v]] = 0.0
        self._courses.whole['path'][dolls] = 0
        for cluster in self._joined:
            if dolls[cluster.dolls[0]]:
                cluster.course.v[:] = 0.0
                cluster.course.path[:] = 0

    def gather(self) -> None:
        """Let joined clusters go on from where the scene's q and v are."""
        for cluster in self._joined:
            cluster.course.q[:], cluster.course.v[:] = self.q[cluster.q], self.v[cluster.v]

    def within(self, flags: list[np.ndarray]) -> None:
        """Enter why pairs of each doll do not collide."""
        for cluster, own in zip(self._alone, flags, strict=True):
            cluster.course.within[:] = own

    def flags(self, kind: int) -> list[np.ndarray]:
        """Those of a kind, WITHIN or OUTSIDE, of each doll's pairs."""
        return [cluster.course.within & kind for cluster in self._alone]

    def begin(self) -> None:
        """Let all go on by themselves, nothing known of what is to come."""
        self._set(list(self._alone))
        self.forget()

    def forget(self) -> None:
        """What is known of contacts, gaps and flights is no more true."""
        for cluster in self.members:
            self._begin(cluster)

    def close(self) -> None:
        """End the threads."""
        if self._threads:
            self._threads.shutdown()
            self._threads = None

    def work(self) -> float:
        """Of pushes and hands since the start, J."""
        return float(self._work.sum())

    def totals(self) -> dict[str, float]:
        """What has been counted since the start."""
        return {name: self.tally[name].sum() for name in COUNTS}

    def touching(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Contacts (c,) of all last steps, none in flight; which bones (c, 2) of the scene touch,
        or GROUND; how long (c,) s the step lasted.
        """
        if len(self._alone) == 1:
            return self._touching_of_one()
        courses, lone = self._courses, np.bincount(self.of_doll)[self.of_doll] == 1
        known, dolls = courses.contacts_of(lone & (courses.whole['path']['valid'] == 0))
        found = [_touching(courses.whole['known'][known], self._records, self._first[dolls],
                           self.tally['lasted'][dolls])]
        for cluster in self._joined:
            tally = cluster.course.tally[0]
            if not cluster.course.path['valid'][0]:
                known = cluster.course.known[:tally['contacts']]
                found.append(_touching(known, cluster.bones[cluster.system.tree['bone']],
                                       np.zeros(len(known), np.int64),
                                       np.full(len(known), tally['lasted'])))
        return tuple(map(np.concatenate, zip(*found, strict=True)))

    def _touching_of_one(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of a scene of one doll, three times as quick."""
        known, lasted = self._known_of_one(), self._alone[0].course.tally['lasted'][0]
        return _touching(known, self._records, np.zeros(len(known), np.int64),
                         np.full(len(known), lasted))

    def on_ground(self) -> np.ndarray:
        """Which bones (n,) of the scene touch the ground; of one doll a tenth of the work that
        touching() is.
        """
        on = np.zeros(len(self._records), bool)
        if len(self._alone) == 1:
            known = self._known_of_one()
            on[self._records[known['a'][(known['kind'] > 1) & (known['b'] < 0)]]] = True
        else:
            _, bones, _ = self.touching()
            on[bones[bones[:, 1] == GROUND, 0]] = True
        return on

    def _known_of_one(self) -> np.ndarray:
        """Contacts, and joints at their limits, of the last step of a scene of one doll."""
        course = self._alone[0].course
        return course.known[:0 if course.path['valid'][0] else int(course.tally['contacts'][0])]

    def save(self) -> object:
        """A snapshot that restore() brings back to the bit."""
        return (self._courses.save(), self.members,
                [(cluster, _copied(cluster.course)) for cluster in self._joined])

    def restore(self, snapshot: tuple) -> None:
        """Go back to a snapshot."""
        courses, members, joint = snapshot
        self._courses.restore(courses)
        if members is not self.members:
            self._set(members)
        for cluster, course in joint:
            for name in KEPT:
                getattr(cluster.course, name)[:] = getattr(course, name)
            cluster.course.known[:len(course.known)] = course.known

    def checkpoint(self) -> dict[str, np.ndarray]:
        """What no look at the scene would tell; as bytes, as numpy copies records slowly."""
        return {name: self._courses.whole[name].view(np.uint8).copy() for name in UNSEEN}

    def go_back(self, checkpoint: dict[str, np.ndarray]) -> None:
        """Go on from a checkpoint, all by themselves."""
        for name, values in checkpoint.items():
            self._courses.whole[name].view(np.uint8)[:] = values
        self.begin()

    def _numbers(self, couples: np.ndarray) -> np.ndarray:
        """A number for each couple (k, 2)."""
        return couples[:, 0] * len(self._alone) + couples[:, 1]

    def _key(self, dolls: np.ndarray, couples: np.ndarray) -> tuple:
        return dolls.tobytes(), couples.tobytes()

    def _set(self, clusters: list[Cluster]) -> None:
        self.members = clusters
        for place, cluster in enumerate(clusters):
            self.of_doll[cluster.dolls] = place
        self._joined = [cluster for cluster in clusters if len(cluster.dolls) > 1]
        self._firsts = np.array([cluster.dolls[0] for cluster in clusters])
        self.couples = np.concatenate(
            [NO_COUPLES, *(cluster.couples for cluster in self._joined)])
        """(k, 2), of all clusters: who may touch whom."""
        self._known_numbers = self._numbers(self.couples)
        self._jobs = np.array([[cluster.addresses(worker) for cluster in clusters]
                               for worker in range(self._workers)], np.int64)
        """(workers, k, 3)"""

    def _spread_out(self, jobs: np.ndarray, duration: float, accuracy: Accuracy,
                    resting: np.ndarray) -> None:
        """Let several threads take clusters on: the dearest of the last time first, in turns."""
        self._threads = self._threads or ThreadPoolExecutor(self._workers - 1, 'clusters')
        effort = self.tally['steps'] + self.tally['impacts'] + 6 * self.tally['flights']
        spent, self._effort = effort - self._effort, effort
        order = np.argsort(-spent[self._firsts[~resting[self._firsts]]], kind='stable')
        shares = min(len(order), SHARES * self._workers)
        parts = itertools.count()

        def work(worker: int) -> None:
            while (part := next(parts)) < shares:
                kernels.advance(jobs[worker, order[part::shares]], duration, accuracy.step,
                                accuracy.flight_error)

        others = [self._threads.submit(work, worker) for worker in range(1, self._workers)]
        work(0)
        for other in others:
            other.result()

    def _spread(self, cluster: Cluster) -> None:
        """Enter what a joined cluster has come to among the scene's."""
        self.q[cluster.q], self.v[cluster.v] = cluster.course.q, cluster.course.v
        self.rows[cluster.bones] = cluster.course.rows
        self.sums[cluster.dolls] = cluster.course.sums
        at = 0
        for doll in cluster.dolls:
            within = self._alone[doll].course.within
            within[:] = cluster.course.within[at:at + len(within)]
            at += len(within)

    def _begin(self, cluster: Cluster) -> None:
        """Nothing is known of its contacts, its gaps and its next flight."""
        cluster.course.path[:] = cluster.course.reaction[:] = 0
        for name in ('contacts', 'settled', 'lasted', 'next', 'seen'):
            cluster.course.tally[name] = 0

    def _single(self, doll: int) -> Cluster:
        """A doll by itself; its state is a part of the scene's, its scratch that of its equals."""
        system = self._systems[doll]
        bones, q, v = self._bones[doll], self._q[doll], self._v[doll]
        course = self._courses[doll]
        if id(system) not in self._rooms:
            self._rooms[id(system)] = [make_room(system, course) for _ in range(self._workers)]
        rooms = [room._replace(tally=course.tally, within=course.within, gaps=course.gaps)
                 for room in self._rooms[id(system)]]
        return _bound(np.array([doll]), NO_COUPLES, bones, q, v, system, course, rooms)

    def _join(self, dolls: np.ndarray, couples: np.ndarray) -> Cluster:
        """Several dolls that go on from where they are."""
        systems = [self._systems[doll] for doll in dolls]
        bones, q, v = (np.concatenate([parts[doll] for doll in dolls])
                       for parts in (self._bones, self._q, self._v))
        firsts = np.cumsum([0, *(len(system.geoms) for system in systems)])
        place = {int(doll): k for k, doll in enumerate(dolls)}
        geoms = np.concatenate([
            np.stack(np.meshgrid(np.arange(firsts[a], firsts[a + 1]),
                                 np.arange(firsts[b], firsts[b + 1]), indexing='ij'), -1)
            .reshape(-1, 2) for one, other in couples
            for a, b in [(place[int(one)], place[int(other)])]])
        scene = dataclasses.replace(
            self._scene, dolls=tuple(self._scene.dolls[doll] for doll in dolls))
        system = joined(systems, pairs_between(scene, geoms))
        alone = [self._alone[doll].course for doll in dolls]
        course = make_course(system, room_for_contacts(system))._replace(
            q=self.q[q], v=self.v[v], tally=self.tally[dolls[0]:dolls[0] + 1],
            within=np.concatenate([course.within for course in alone]))
        return _bound(dolls, couples, bones, q, v, system, course, [make_room(system, course)])


def _bound(*parts: object) -> Cluster:
    """A cluster of these, its system, course and rooms bound; they live as long as it."""
    system, course, rooms = parts[-3:]
    return Cluster(*parts, [bind(part) for part in (system, course, *rooms)])


def _systems(scene: Scene) -> list[System]:
    """The tables of each doll by itself; equal dolls share them."""
    made: dict[int, System] = {}
    for placement in scene.dolls:
        if id(placement.doll) not in made:
            made[id(placement.doll)] = system_of(dataclasses.replace(scene, dolls=(placement,)))
    return [made[id(placement.doll)] for placement in scene.dolls]


def _touching(known: np.ndarray, records: np.ndarray, first: np.ndarray,
              lasted: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of ``known`` ones the contacts, their bones and times, as Clusters.touching() tells them.

    Their records count from the ``first`` (c,) of ``records``, which hold the scene's bones.
    """
    touch = np.flatnonzero(known['kind'] > 1)
    # take: an index in brackets goes through such wide records field by field
    known, first, lasted = known.take(touch), first[touch], lasted[touch]
    bones = np.empty((len(known), 2), np.int64)
    bones[:, 0] = records[first + known['a']]
    bones[:, 1] = np.where(known['b'] < 0, GROUND, records[first + known['b']])
    return known, bones, np.where(lasted > 0, lasted, 1.0)


def _copied(course: Course) -> Course:
    known = course.known[:int(course.tally['contacts'][0])]
    return Course(*(part.copy() for part in course._replace(known=known)))

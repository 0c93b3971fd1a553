"""The package's own engine: rigid bodies, machine code from a stretch's start to its end.

What it does is in kernels/: advance.py reads as the algorithm. Here are only its tables, its state
and what is told of it.
"""
from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.state import State
from ..ground_heights import ground_heights
from ..kernels.bundle import bind
from ..kernels.loaded import advance as kernels
from ..kernels.system import CONTACT, DOLL, OUTSIDE, WITHIN, Course, make_course, make_room
from ..motion import Motion, damping_rate
from ..settings import Accuracy
from ..system import pairs_between, system_of
from .neighbours import Neighbours
from .protocol import GROUND, Contact, Spring, Springs, Wrenches, pressed

STIFFEST = 1000.0
"""1/s at which joint damping may end a motion for it to be flown; above, steps take it
implicitly."""

MOST_CONTACTS = 400
"""Contacts at a time; those beyond are counted and left out."""

FINER = 0.25
"""Share of the step by which the last stretch is gone again to tell its error."""

CONTACTS_OF_GEOM = 12
"""Contacts for which there is room, for each part of a bone."""

NO_HANDS = np.empty((0, 18))
NO_LOADS = np.empty((0, 11))


@dataclass
class _Snapshot:
    """All that the next stretch depends on."""

    course: Course
    start_energy: float


class RigidEngine:
    """An Engine by the rigid core; see Engine."""

    def __init__(self, scene: Scene, accuracy: Accuracy) -> None:
        self.scene, self.accuracy = scene, accuracy
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._whole = self._system = system_of(scene)
        self._neighbours = Neighbours(scene, self._whole)
        self._flies = damping_rate(scene) < STIFFEST
        self._spins = self.layout.root_spins
        self._longest = math.inf
        """s that a path of flight may be long, as far as neighbours are known."""
        self._course = make_course(self._whole)
        self._designed = np.full(len(self._whole.pairs), WITHIN)
        """Pairs that are within each other as bound: they are left so until they come apart."""
        self.place(self._placed())
        self._designed = self._course.within & WITHIN

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""
        return self._state

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls now."""
        q, v = self._course.q.copy(), self._course.v.copy()
        v[self._spins] = rotation.rotate(q[self.layout.root_orientations], v[self._spins])
        return GeneralizedState(q, v)

    @property
    def motion(self) -> Motion:
        """Sums over each doll now."""
        return self._motion

    def place(self, coordinates: GeneralizedState) -> None:
        """Put all dolls there and begin; see Engine."""
        q, v = self._course.q, self._course.v
        q[:], v[:] = coordinates.q, coordinates.v
        turns = rotation.inverse(q[self.layout.root_orientations])
        v[self._spins] = rotation.rotate(turns, v[self._spins])
        self._leave_path()
        self._course.tally[:] = 0
        self._use(self._whole)
        self._look()
        self._lift_out()
        self._course.within[:] = self._designed | OUTSIDE
        self._look()
        self._neighbours.forget()
        self._start_energy = float(self.motion.energy.sum())
        self._departure = None

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = ()) -> None:
        """Go on by ``duration`` s; see Engine."""
        self._departure = (self._course.q.copy(), self._course.v.copy(), duration, wrenches,
                           springs)
        self._meet(duration)
        if wrenches or springs:
            self._leave_path()
        self._go(duration, wrenches, springs, self.accuracy)
        if wrenches or springs:
            self._leave_path()

    def stop(self) -> None:
        """Bring all to rest where it is; the energy that is left is lost for good."""
        self._course.v[:] = 0.0
        self._leave_path()
        self._departure = None
        self._look()

    def grounded(self) -> bool:
        """Whether anything rests on the ground."""
        now = self._contacts
        return bool(((now['kind'] > 1) & (now['b'] < 0) & (now['impulse'][:, 0] > 0)).any())

    def contacts(self) -> list[Contact]:
        """What touches now."""
        bones, lasted = self._system.tree['bone'], self._course.tally['lasted'][0] or 1.0
        return [Contact(int(bones[c['a']]), int(bones[c['b']]) if c['b'] >= 0 else GROUND,
                        c['point'].copy(), c['normal'].copy(), -float(c['gap']),
                        float(c['impulse'][0]) / lasted)
                for c in self._contacts if c['kind'] > 1]

    def measures(self) -> dict[str, float]:
        """What went wrong since the start, and what was done: names end in their units."""
        tally = self._course.tally[0]
        pushed, handed = float(tally['pushed']), float(tally['handed'])
        energy = float(self.motion.energy.sum())
        return {
            'energy_excess_J': energy - self._start_energy - (pushed + handed),
            'energy_lifted_J': float(tally['lifted']),
            'work_of_pushes_J': pushed, 'work_of_grabs_J': handed,
            'error_estimate_m': self._estimate_error(), 'error_trusted': 1.0,
            'flights': int(tally['flights']), 'substeps': int(tally['steps']),
            'impacts': int(tally['impacts']), 'unsolved_total': int(tally['unsolved'])}

    def save(self) -> object:
        """A snapshot that restore brings back to the bit."""
        return _Snapshot(Course(*(part.copy() for part in self._course)), self._start_energy)

    def restore(self, snapshot: _Snapshot) -> None:
        """Go back to a snapshot."""
        self._use(self._whole)
        self._put(snapshot.course)
        self._start_energy = snapshot.start_energy
        self._departure = None
        self._neighbours.forget()
        self._look()

    def forget(self, snapshot: object) -> None:
        """Nothing to release: the memory goes with the object."""

    def close(self) -> None:
        """Nothing to release: the memory goes with the object."""

    @property
    def _contacts(self) -> np.ndarray:
        """Contacts of the last step; none in flight."""
        course = self._course
        return course.known[:0 if course.path['valid'][0] else int(course.tally['contacts'][0])]

    def _leave_path(self) -> None:
        """The next flight begins anew."""
        self._course.path[:] = 0

    def _put(self, course: Course) -> None:
        """Go on from there; what is known of contacts may be of fewer of them."""
        for own, other in zip(self._course[:-1], course[:-1], strict=True):
            own[:] = other
        count = min(len(course.known), len(self._course.known))
        self._course.known[:count] = course.known[:count]

    def _go(self, duration: float, wrenches: Wrenches, springs: Springs,
            accuracy: Accuracy) -> None:
        rows, sums = np.empty((len(self.scene.bones), 13)), np.empty(len(self.scene.dolls), DOLL)
        kernels.advance(*self._addresses, duration, _loads(wrenches), self._hands(springs),
                        accuracy.step, accuracy.flight_error, self._flies and not springs,
                        self._longest, rows, sums)
        self._state, self._motion = State.of(rows), Motion.of(sums.view(float).reshape(-1, 20))

    def _hands(self, springs: Springs) -> np.ndarray:
        """Springs as a table (m, 18) for compiled code, the last four its own."""
        if not springs:
            return NO_HANDS
        bones = self._system.tree['bone'].tolist()
        return np.array([_hand(bones.index(spring.bone), spring) for spring in springs])

    def _meet(self, duration: float) -> None:
        """See that all geoms of two dolls that may meet within ``duration`` s are paired."""
        self._longest = math.inf
        if len(self.scene.dolls) > 1:
            couples = self._neighbours.update(self.state, duration)
            if couples is not None:
                pairs = np.concatenate([self._whole.pairs,
                                        pairs_between(self.scene, self._whole.geoms, couples)])
                self._use(self._system._replace(pairs=pairs))
                self._leave_path()
            self._longest = duration

    def _use(self, system: object) -> None:
        """Work with these tables from now on; contacts are found anew."""
        self._system = system
        contacts = min(MOST_CONTACTS, CONTACTS_OF_GEOM * len(system.geoms) + len(system.bounds))
        self._course = self._course._replace(known=np.zeros(contacts, CONTACT))
        self._course.tally['contacts'] = 0
        self._room = make_room(system, self._course)
        self._rows = [bind(part) for part in (system, self._room, self._course)]
        self._addresses = [rows[0].ctypes.data for rows in self._rows]

    def _look(self) -> None:
        """See where all is."""
        self._go(0.0, (), (), self.accuracy)

    def _lift_out(self) -> None:
        """Set dolls that are in the ground onto it."""
        heights = ground_heights(self.scene, self.state)
        for doll, own in enumerate(self.scene.bone_slices):
            depth = -heights[own].min()
            if depth > pressed(self.scene):
                at = self.layout.root_positions[doll]
                self._course.q[at] += depth * np.array(self.scene.ground.normal)

    def _placed(self) -> GeneralizedState:
        """Where the scene's placements stand."""
        q, v = np.zeros(self.layout.sizes[0]), np.zeros(self.layout.sizes[1])
        for bone in self._whole.tree:
            if bone['free'] and bone['parent'] >= 0:
                q[bone['q'] + 3] = 1.0
        for doll, placement in enumerate(self.scene.dolls):
            pose = placement.bone_pose(placement.doll.root)
            q[self.layout.root_positions[doll]] = pose.position
            q[self.layout.root_orientations[doll]] = pose.orientation
            v[self.layout.root_velocities[doll]] = placement.root_velocity()
            v[self._spins[doll]] = placement.spin
        return GeneralizedState(q, v)

    def _estimate_error(self) -> float:
        """Error, m, that the last stretch added to the worst position.

        It is gone again in steps a quarter as long, flights with a hundredth of the error: what is
        of order 2 then errs by a sixteenth.
        """
        if self._departure is None:
            return 0.0
        q, v, duration, wrenches, springs = self._departure
        finer = dataclasses.replace(self.accuracy, step=FINER * self.accuracy.step,
                                    flight_error=self.accuracy.flight_error / 100)
        here, there = self.save(), self.state.positions
        self._course.q[:], self._course.v[:] = q, v
        self._leave_path()
        self._course.tally['contacts'] = 0
        self._go(duration, wrenches, springs, finer)
        missed = np.linalg.norm(self.state.positions - there, axis=1).max()
        self._put(here.course)
        self._look()
        return float(missed / (1 - FINER ** 2))


def _loads(wrenches: Wrenches) -> np.ndarray:
    """Wrenches as a table (m, 11) for compiled code."""
    if not wrenches:
        return NO_LOADS
    rows = np.empty((len(wrenches), 11))
    for row, load in zip(rows, wrenches, strict=True):
        row[0], row[1:4], row[4:7], row[7:10], row[10] = (
            load.bone, load.force, load.torque, load.point, load.local)
    return rows


def _hand(record: int, spring: Spring) -> np.ndarray:
    spring = spring.after(0.0)
    speed = (spring.target - spring.position) / spring.left if spring.left > 0 else np.zeros(3)
    return np.concatenate([[record], spring.point, spring.position, speed, [
        spring.left, spring.stiffness, spring.damping, spring.most, 1.0, 0.0, 0.0, 0.0]])

"""Simulate a fall from its start and record its frames."""
import functools
import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from ..files.limits import load_limits
from ..model.biomechanical_limits import BiomechanicalLimits
from ..model.coordinates import GeneralizedState
from ..model.errors import RagdollError
from ..model.scene import SECOND, Scene
from ..people import standing
from ..people.fall_phases import ONSET_DURATION, Phases, find_phases
from ..people.passive import end_widths
from ..physics.guard import Guard
from ..physics.rigid_body import GroundHeights
from ..physics.sensors.contact_pulse import PulseLaw, PulseLog
from ..physics.sensors.impacts import Impact, bones_that_hit
from ..physics.sensors.joint_stop import JointStops
from ..physics.sensors.soft_joints import SoftJoints
from ..physics.simulation import Simulation
from .fall import Fall
from .recipe import Recipe
from .start import Start, start_of
from .worst_impacts import WorstImpacts


def generate(recipe: Recipe, falls: Iterable[int]) -> Iterator[Fall]:
    """Simulate falls of a recipe by their numbers; each depends on recipe and number alone."""
    for number in falls:
        yield simulate(recipe, start_of(recipe, number))


@functools.cache
def _limits() -> BiomechanicalLimits:
    """Biomechanical limits for all falls, read once per process."""
    return load_limits()


def simulate(recipe: Recipe, start: Start) -> Fall:
    """Simulate the fall that begins at ``start``."""
    scene, frames, limits = start.scene, _Recorder(recipe, start), _limits()
    hits = _Hits(recipe, scene, limits)
    # Not 'auto': falls must not depend on which engines are installed.
    with Simulation(scene, accuracy=recipe.data['accuracy'], engine='rigid') as simulation:
        try:
            begin(simulation, start)
            failure = ''
        except RagdollError as error:
            failure = str(error)
        simulation.samples_per_tick = recipe.samples_per_frame
        simulation.record_impacts(limits)
        guard, events = Guard(simulation), _events(simulation, start)
        hands = _MovingHands(simulation, start)
        while frames.valid < recipe.frames and not failure:
            frames.add(simulation)
            if simulation.asleep and simulation.time > start.last_event:
                frames.hold()
            elif frames.valid < recipe.frames:
                while events and events[0][0] <= simulation.time:
                    events.pop(0)[1]()
                hands.move()
                bad = guard.advance()
                failure = bad.reason if bad else ''
                if not bad:
                    hits.add(simulation.impacts)
        excess = simulation.energy_excess if frames.valid else np.nan
    if any(imu.get('contact_pulse') for imu in recipe.imus):
        hits.add_stops(recipe, scene, frames)
    states, touching = frames.states[:frames.valid], frames.touching[:frames.valid]
    phases = find_phases(
        scene, states, touching, recipe.data['feet'], round(ONSET_DURATION * recipe.rate),
        **recipe.data['phases']) if frames.valid and recipe.falls else Phases()
    return Fall(start.number, start.drawn, scene, np.arange(recipe.frames) / recipe.rate,
                frames.states, frames.angles, frames.rates, frames.touching, recipe.imus,
                recipe.samples_per_frame, frames.imu_states, frames.valid, failure, phases, excess,
                recipe.philox_key, hits.worst, tuple(hits.contacts), tuple(recipe.data['feet']),
                hits.pulses.pulses)


class _Hits:
    """Impacts of a fall: the worst ones, each contact, and the durations of impacts and of joint
    stops.
    """

    def __init__(self, recipe: Recipe, scene: Scene, limits: BiomechanicalLimits) -> None:
        self._limits = limits
        self.worst = WorstImpacts.none_yet(scene, limits)
        self.contacts: list[Impact] = []
        """Each impact once: of two bones that meet, that of the first."""
        self.pulses = PulseLog(PulseLaw(scene, limits),
                               (recipe.frames - 1) * recipe.samples_per_frame,
                               1 / recipe.rate / recipe.samples_per_frame)

    def add(self, impacts: Sequence[Impact]) -> None:
        """Add the impacts of a tick."""
        if impacts:
            self.worst = self.worst.after(impacts, self._limits)
            self.contacts += _once(impacts)
            self.pulses.add(impacts)

    def add_stops(self, recipe: Recipe, scene: Scene, frames: '_Recorder') -> None:
        """Add the stops of joints between successive frames to the pulses."""
        stops, per_frame = (JointStops(scene, end_widths(scene.dolls[0].doll)),
                            recipe.samples_per_frame)
        joints = list(zip(frames.angles, frames.rates, strict=True))[:frames.valid]
        soft = SoftJoints(len(joints), len(scene.angle_names), 1 / recipe.rate)
        for at, (before, after) in enumerate(itertools.pairwise(joints)):
            first, last = at * per_frame, (at + 1) * per_frame
            for stop in stops.find(before, after, 1 / recipe.rate, soft):
                # When within the tick is not known; what else it has is little beside.
                for sample in range(first, last):
                    self.pulses.enter(sample, *stop)
            soft.advance(after[1] - before[1], *self.pulses.between(first, last))


def _once(impacts: Sequence[Impact]) -> Iterator[Impact]:
    """Yield the impacts of a tick, each once: where two bones meet, both have an impact, and that
    of the second, which follows, is left out.
    """
    for before, hit in zip((None, *impacts), impacts, strict=False):
        if before is None or (before.time, before.against, before.bone) != (
                hit.time, hit.bone, hit.against):
            yield hit


def _events(simulation: Simulation, start: Start) -> list[tuple[int, Callable[[], None]]]:
    """Times, ns, and what happens then, in order of time."""
    events = [(limp.at, partial(simulation.go_limp, limp.angles)) for limp in start.limp]
    for index, grab in enumerate(start.grabs):
        hand = f'hand {index}'
        events += [(grab.at, partial(simulation.grab, hand, grab.bone)),
                   (grab.until, partial(simulation.let_go, hand))]
    return sorted(events, key=lambda event: event[0])


class _MovingHands:
    """Moves the hands of a start's ``grabs`` that go somewhere, tick by tick."""

    def __init__(self, simulation: Simulation, start: Start) -> None:
        self._simulation, self._starts = simulation, {}
        self._moving = {f'hand {index}': grab for index, grab in enumerate(start.grabs) if grab.to}

    def move(self) -> None:
        """Drag each hand that holds something to where it is at the end of the next tick."""
        if not self._moving:
            return
        step = self._simulation.step
        for held in self._simulation.grabs:
            if grab := self._moving.get(held.hand):
                start = self._starts.setdefault(held.hand, np.array(held.target))
                end = self._simulation.time + round(step * SECOND)
                self._simulation.drag(held.hand, grab.place(start, end), step)


class _Recorder:
    """Recorded frames. Where not recorded yet, ``touching`` is False and the rest is NaN."""

    def __init__(self, recipe: Recipe, start: Start) -> None:
        count, self._per_frame = recipe.frames, recipe.samples_per_frame
        self._imu_bones = [start.scene.bone_index(imu['bone']) for imu in recipe.imus]
        self.imu_states = np.full(
            ((count - 1) * self._per_frame + 1, len(self._imu_bones), 13), np.nan)
        n, k = len(start.scene.bones), len(start.scene.angle_names)
        self.states, self.touching = np.full((count, n, 13), np.nan), np.zeros((count, n), bool)
        self.angles, self.rates = np.full((2, count, k), np.nan)
        self.valid = 0
        bodies = start.scene.bodies
        self._furniture = [k for k, body in enumerate(bodies) if body.name not in recipe.floor]
        self._floor = {'ground', *recipe.floor}

    def add(self, simulation: Simulation) -> None:
        """Record the current state as the next frame."""
        at = self.valid
        self.states[at] = simulation.state.rows
        self.touching[at] = self._bones_on_ground(simulation)
        if at:
            self.touching[at] |= bones_that_hit(simulation.scene, simulation.impacts, self._floor)
        self.angles[at], self.rates[at] = simulation.joint_angles, simulation.joint_rates
        if self._imu_bones:
            last = at * self._per_frame
            substates = simulation.substates
            for back, state in enumerate(substates[:0:-1] if at else substates):
                self.imu_states[last - back] = state.rows[self._imu_bones]
        self.valid += 1

    def _bones_on_ground(self, simulation: Simulation) -> np.ndarray:
        """Which bones (n,) touch the ground or a body that counts as ground."""
        if not self._furniture:
            return simulation.bones_on_ground  # ground or any static body
        contacts, found = simulation.contacts, np.zeros(self.touching.shape[1], bool)
        found[contacts.a[(contacts.b < 0) & ~np.isin(contacts.bodies, self._furniture)]] = True
        return found

    def hold(self) -> None:
        """Repeat the last frame up to the end: the doll sleeps."""
        at = self.valid - 1
        for each in (self.states, self.touching, self.angles, self.rates):
            each[at:] = each[at]
        last = at * self._per_frame
        self.imu_states[last:] = self.imu_states[last]
        self.valid = len(self.states)


def begin(simulation: Simulation, start: Start) -> None:
    """Place the doll with its lowest point at the clearance, queue pushes, hold joints.

    If it then overlaps with bodies, it is moved up along the ground's normal until it does not, at
    most by HIGHEST.
    """
    scene = start.scene
    normal = np.array(scene.ground.normal)
    bound = simulation.coordinates
    q = bound.q.copy()
    # So far up that no bone penetrates the ground.
    q[:3] += normal * 3 * scene.dolls[0].doll.extent
    high = start.coordinates(GeneralizedState(q, bound.v))
    simulation.place(high)
    lowest = float(GroundHeights(scene)(simulation.state).min())
    lift = np.zeros_like(high.q)
    lift[:3] = normal * (start.clearance - lowest)
    simulation.place(GeneralizedState(high.q + lift, high.v))
    if scene.bodies:
        _lift_out_of_bodies(simulation, normal)
    for push in start.pushes:
        simulation.push(push)
    if start.limp:
        for angle, spring in standing(scene.dolls[0].doll).items():
            simulation.hold(angle, *spring)


HIGHEST, PRECISION = 4.0, 1e-3
"""m: how far a doll is lifted at most to be out of the bodies, and how exactly."""


def _lift_out_of_bodies(simulation: Simulation, normal: np.ndarray) -> None:
    """Move the doll along ``normal`` (3,), by bisection, until no body overlaps with it, at most by
    HIGHEST.
    """
    names = {body.name for body in simulation.scene.bodies}
    start = simulation.coordinates

    def is_free(height: float) -> bool:
        q = start.q.copy()
        q[:3] += height * normal
        simulation.place(GeneralizedState(q, start.v))
        return not any(overlap.other in names for overlap in simulation.initial_overlaps)

    low, high = 0.0, HIGHEST
    if is_free(low):
        return
    while high - low > PRECISION:
        middle = (low + high) / 2
        low, high = (low, middle) if is_free(middle) else (middle, high)
    is_free(high)

"""A fall, from how it begins to its frames."""
from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ..model.coordinates import GeneralizedState
from ..model.errors import RagdollError
from ..people import standing
from ..physics.ground_heights import GroundHeights
from ..physics.guard import Guard
from ..physics.simulation import Simulation
from .fall import Fall, Phases
from .phases import LASTS, find_phases
from .recipe import Recipe
from .start import Start, start_of


def generate(recipe: Recipe, falls: Iterable[int]) -> Iterator[Fall]:
    """Falls of a recipe by their numbers, each from the recipe and its number alone."""
    for number in falls:
        yield simulate(recipe, start_of(recipe, number))


def simulate(recipe: Recipe, start: Start) -> Fall:
    """The fall that begins as ``start`` says."""
    scene, frames = start.scene, _Frames(recipe, start)
    # Not 'auto': what falls are is not to depend on what is installed.
    with Simulation(scene, accuracy=recipe.data['accuracy'], engine='rigid') as simulation:
        try:
            begin(simulation, start)
            failure = ''
        except RagdollError as error:
            failure = str(error)
        simulation.samples_per_tick = recipe.parts
        guard, limp = Guard(simulation), list(start.limp)
        while frames.valid < recipe.frames and not failure:
            frames.add(simulation)
            if simulation.asleep and simulation.time > start.last_act:
                frames.hold()
            elif frames.valid < recipe.frames:
                while limp and limp[0].at <= simulation.time:
                    simulation.go_limp(limp.pop(0).angles)
                bad = guard.advance()
                failure = bad.reason if bad else ''
        excess = simulation.energy_excess if frames.valid else np.nan
    states, touching = frames.states[:frames.valid], frames.touching[:frames.valid]
    phases = find_phases(
        scene, states, touching, recipe.data['feet'], round(LASTS * recipe.rate),
        **recipe.data['phases']) if frames.valid else Phases()
    return Fall(start.number, start.drawn, scene, np.arange(recipe.frames) / recipe.rate,
                frames.states, frames.angles, frames.rates, frames.touching, recipe.imus,
                recipe.parts, frames.worn, frames.valid, failure, phases, excess, recipe.key)


class _Frames:
    """What is recorded, NaN where nothing is yet."""

    def __init__(self, recipe: Recipe, start: Start) -> None:
        count, self._parts = recipe.frames, recipe.parts
        self._wearers = [start.scene.bone_index(imu['bone']) for imu in recipe.imus]
        self.worn = np.full(((count - 1) * self._parts + 1, len(self._wearers), 13), np.nan)
        n, k = len(start.scene.bones), len(start.scene.angle_names)
        self.states, self.touching = np.full((count, n, 13), np.nan), np.zeros((count, n), bool)
        self.angles, self.rates = np.full((2, count, k), np.nan)
        self.valid = 0

    def add(self, simulation: Simulation) -> None:
        """Record what is now."""
        at = self.valid
        self.states[at] = simulation.state.rows
        self.touching[at] = simulation.bones_on_ground
        self.angles[at], self.rates[at] = simulation.joint_angles, simulation.joint_rates
        if self._wearers:
            last = at * self._parts
            substates = simulation.substates
            for back, state in enumerate(substates[:0:-1] if at else substates):
                self.worn[last - back] = state.rows[self._wearers]
        self.valid += 1

    def hold(self) -> None:
        """Nothing changes any more."""
        at = self.valid - 1
        for each in (self.states, self.touching, self.angles, self.rates):
            each[at:] = each[at]
        self.worn[at * self._parts:] = self.worn[at * self._parts]
        self.valid = len(self.states)


def begin(simulation: Simulation, start: Start) -> None:
    """Put the doll where it starts, its lowest point at its clearance, queue the pushes, hold the
    joints that will go limp.
    """
    scene = start.scene
    normal = np.array(scene.ground.normal)
    high = start.coordinates(_far_up(simulation, normal))
    simulation.place(high)
    lowest = float(GroundHeights(scene)(simulation.state).min())
    lift = np.zeros_like(high.q)
    lift[:3] = normal * (start.clearance - lowest)
    simulation.place(GeneralizedState(high.q + lift, high.v))
    for push in start.pushes:
        simulation.push(push)
    if start.limp:
        for angle, spring in standing(scene.dolls[0].doll).items():
            simulation.hold(angle, *spring)


def _far_up(simulation: Simulation, normal: np.ndarray) -> GeneralizedState:
    """Where the scene's placement stands, but so far from the ground that nothing is in it."""
    bound = simulation.coordinates
    q = bound.q.copy()
    q[:3] += normal * 3 * simulation.scene.dolls[0].doll.extent
    return GeneralizedState(q, bound.v)

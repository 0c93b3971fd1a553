"""Steps after which energy and momentum are what they must be: stepping.py, then conservation.py.

Data flow of one substep: the Stepper moves the scene on, the wrenches' work and impulse are
entered, what the step has erred in momentum and energy is projected away.
"""
from __future__ import annotations

import dataclasses

import numpy as np

from ..model.coordinates import GeneralizedState
from ..model.scene import Scene
from ..model.state import State
from . import backend
from .engine.protocol import Engine, Wrenches, pressed
from .grab import Pull
from .motion import Motion
from .settings import Accuracy
from .stepping import Stepper, StepResult
from .work import mean_load, work


class ConservingStepper:
    """Moves a scene on and keeps account. Holds where it is: ``state`` and ``motion``."""

    def __init__(self, scene: Scene, engine: type[Engine], accuracy: Accuracy) -> None:
        self._scene = scene
        self.stepper = Stepper(scene, engine, accuracy)
        self.mechanics = backend.mechanics_of(scene)
        self.conservation = backend.conservation_of(scene, self.mechanics,
                                                    self.stepper.engine.layout)

    def begin(self) -> None:
        """Take where the stepper is for the start."""
        self._update_state(self.stepper.state)
        self.conservation.open(self.state)
        self.work_of_grabs = 0.0
        """J: work of hands since the start."""

    def lift_out(self) -> None:
        """Set dolls that begin in the ground onto it: else they stay, or are thrown out."""
        stepper, layout = self.stepper, self.stepper.engine.layout
        heights = stepper.reach.heights(stepper.state)
        depths = -np.array([heights[own].min() for own in self._scene.bone_slices])
        sunk = depths > pressed(self._scene)
        if sunk.any():
            q = stepper.coordinates.q.copy()
            q[layout.root_positions] += np.outer(np.where(sunk, depths, 0),
                                                 self._scene.ground.normal)
            stepper.place(dataclasses.replace(stepper.coordinates, q=q))
            stepper.begin()

    def substep(self, duration: float, loads: Wrenches) -> float:
        """Go through one stretch of motion, of at most ``duration`` s; its length, s."""
        stepper, before, motion = self.stepper, self.state, self.motion
        start = stepper.coordinates
        result = stepper.step(duration, loads)
        self._update_state(stepper.state)
        if loads:
            self._enter_work(loads, before, result)
        if stepper.accuracy.momentum and (result.substep or not stepper.dynamics.keeps_momentum):
            self._keep_momentum(motion, result, loads, before)
        if stepper.accuracy.energy:
            self._keep_energy(start, result.touched)
        return result.duration

    def stop(self) -> None:
        """Bring all to rest where it is; the energy that is left is lost for good."""
        coordinates = self.stepper.coordinates
        self._correct(dataclasses.replace(coordinates, v=np.zeros_like(coordinates.v)))
        self.conservation.close_step(self.motion.energy,
                                     self.conservation.groups(self.stepper.touching))

    def measures(self) -> dict[str, float]:
        """What the accounts say so far: names end in their units."""
        conservation = self.conservation
        return {
            'energy_excess_J': float((self.motion.energy - conservation.start
                                      - conservation.worked).sum()),
            'energy_projected_J': float(conservation.budget.taken),
            'stopped_total': conservation.budget.stops,
            'work_of_pushes_J': float(conservation.worked.sum()) - self.work_of_grabs,
            'work_of_grabs_J': self.work_of_grabs}

    def _update_state(self, state: State) -> None:
        """Take note of where all is."""
        self.state = state
        self.motion = self.mechanics.motion(state)

    def _correct(self, coordinates: GeneralizedState) -> None:
        self.stepper.place(coordinates)
        self._update_state(self.stepper.state)

    def _keep_momentum(self, before: Motion, result: StepResult, loads: Wrenches,
                       state: State) -> None:
        """Project dolls that touched nothing outside themselves onto their due momentum.

        What loads that turn with a bone give in a flight, nobody knows better than the flight.
        """
        touched = self.conservation.touched(result.touched) if result.touched else None
        if touched is not None and touched.all():
            return
        if not result.substep and any(load.local for load in loads):
            return
        impulse = moment = 0.0
        if loads:
            impulse, moment = self._impulse(loads, result.duration, state)
        self.state, self.motion, turn = self.conservation.keep_momentum(
            self.state, before, self.motion, result.duration, impulse, moment, touched)
        self.stepper.shift(self.state, turn)

    def _impulse(self, loads: Wrenches, duration: float,
                 before: State) -> tuple[np.ndarray, np.ndarray | None]:
        """Impulse (d, 3) N s and moment (d, 3) N m s of loads; no moment where a force has one."""
        impulse, moment = np.zeros((2, len(self._scene.dolls), 3))
        for load in loads:
            doll = self.mechanics.doll_of[load.bone]
            force, torque = mean_load(load, before, self.state)
            impulse[doll] += force * duration
            moment[doll] += torque * duration
        return impulse, None if any(load.force.any() for load in loads) else moment

    def _keep_energy(self, start: GeneralizedState, touched: set[tuple[int, int]]) -> None:
        """Take out energy from nothing; what was in the air keeps its momentum for sure.

        Dolls that may have ``touched`` share their budget: a bounce is over within a step.
        """
        conservation = self.conservation
        groups = conservation.groups(touched)
        surplus = conservation.surplus(self.motion, groups)
        if (surplus > 0).any():
            stepper = self.stepper
            # What is tolerated goes with the kinetic energy: once more, with what is left of it.
            for _ in range(2):
                self._correct(conservation.without_surplus(
                    start, stepper.coordinates, self.motion, surplus, bool(touched)))
                surplus = conservation.surplus(self.motion, groups)
                if (surplus <= 0).all():
                    break
            burst = conservation.burst(self.motion, groups)
            if burst.any():
                self._correct(conservation.stopped(start, stepper.coordinates, burst))
        conservation.close_step(self.motion.energy, groups)

    def _enter_work(self, loads: Wrenches, before: State, result: StepResult) -> None:
        done = np.zeros(len(self._scene.dolls))
        for load in loads:
            joules = work(load, before, self.state, result)
            done[self.mechanics.doll_of[load.bone]] += joules
            if isinstance(load, Pull):
                self.work_of_grabs += joules
        self.conservation.add_work(done)

"""What a bad state is, and the way back from one."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.scene import Scene
from ..model.state import State
from .simulation import Simulation

BOUND = 1e9
"""Length of all numbers of a state together (m, m/s, rad/s) that is still one: beyond it, float64
tells positions no finer than 0.1 um. A fall without ground gets there in four hours."""

SPEED = 1.0
"""m/s: motion that counts as energy at hand, as gravity may give none."""


@dataclass(frozen=True)
class BadState:
    """What a simulation came to, and was taken back from."""

    reason: str
    time: int
    """ns of simulated time."""
    state: State


class Guard:
    """Takes a simulation on by ticks, and back where one ends in a state that cannot be: one whose
    numbers are not finite or out of bounds, or that has energy which nothing put in.

    How much of it is too much the engine says, as a share of the energy at hand: that of the
    motion but for what is too much, and what dolls gain that fall by a third of their size and move
    at SPEED.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._least = _energy_at_hand(simulation.scene)
        self._begin()

    def advance(self) -> BadState | None:
        """Go on by one tick; the bad state that it led to, then all is as it was before."""
        simulation = self._simulation
        if simulation.starts != self._starts:
            self._begin()
        before = simulation.state
        try:
            reason = self._judge(simulation.advance(), before)
        # What runs away may fail within the tick.
        except (ArithmeticError, LookupError, ValueError) as error:
            reason = f'{type(error).__name__}: {error}'
        if reason:
            bad = BadState(reason, simulation.time, simulation.state)
            simulation.go_back(self._good)
            return bad
        if simulation.state is not before:
            self._good = simulation.checkpoint()
        return None

    def _begin(self) -> None:
        """Take what is for good."""
        simulation = self._simulation
        self._starts = simulation.starts
        self._good = simulation.checkpoint()
        self._excess = simulation.energy_excess

    def _judge(self, state: State, before: State) -> str:
        """What is bad about a state, else nothing."""
        swings = self._simulation.swings
        for name, numbers in (('the state', state.rows),
                              ('a swing', None if swings is None else swings.positions)):
            # not <=: NaN is no number
            if numbers is not None and not sum_of_squares(numbers) <= BOUND ** 2:
                finite = np.isfinite(numbers).all()
                return f'{name} is ' + (f'farther than {BOUND:g}' if finite else 'not finite')
        if state is before:
            return ''
        simulation, excess = self._simulation, self._simulation.energy_excess
        gained, share = excess - self._excess, simulation.energy_error
        # What moves is asked for only where it matters.
        if not gained <= share * self._least and not gained <= share * (
                self._least + simulation.kinetic_energy - gained):
            return f'energy rose by {gained:.4g} J that nothing put in'
        self._excess = excess
        return ''


def sum_of_squares(numbers: np.ndarray) -> float:
    """Of all numbers; not by BLAS, whose threads spin on for 0.1 s after each sum of a crowd's."""
    flat = numbers.ravel()
    return float(np.einsum('i,i', flat, flat))


def _energy_at_hand(scene: Scene) -> float:
    """Energy, J, that a scene's dolls have at hand when they stand still."""
    gravity = np.linalg.norm(scene.gravity)
    return sum(placement.doll.mass * (gravity * placement.doll.extent / 3 + SPEED ** 2 / 2)
               for placement in scene.dolls)

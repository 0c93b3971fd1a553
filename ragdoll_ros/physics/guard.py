"""Guard detects diverged states and restores the last good one."""
from dataclasses import dataclass

import numpy as np

from ..model.scene import Scene
from ..model.state import State
from .simulation import Simulation

BOUND = 1e9
"""Largest 2-norm of all numbers of a state (m, m/s, rad/s): there, float64 resolves positions to
0.1 um. A free fall reaches it after four hours."""

SPEED = 1.0
"""m/s: speed in the energy scale of a doll, which without gravity has no other term."""


@dataclass(frozen=True)
class BadState:
    """A diverged state that was discarded."""

    reason: str
    time: int
    """Simulated time, ns."""
    state: State


class Guard:
    """Advances a simulation, and undoes ticks that end in a diverged state.

    A state has diverged if the norm of its numbers, or of the swings' positions, is not finite or
    exceeds BOUND, or if the energy of a cluster rose in the tick, beyond all work, by more than
    Engine.energy_error times its energy scale: kinetic energy before the gain, plus m (g extent / 3
    + SPEED^2 / 2) of each of its dolls.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._accept()

    def advance(self) -> BadState | None:
        """Advance by one tick; if its state has diverged, go back and return that state."""
        simulation = self._simulation
        if simulation.reset_count != self._reset_count or simulation.scene is not self._scene:
            self._accept()
        before = simulation.state
        try:
            reason = self._fault(simulation.advance(), before)
        # A diverging simulation may raise within the tick.
        except (ArithmeticError, LookupError, ValueError) as error:
            reason = f'{type(error).__name__}: {error}'
        if reason:
            bad = BadState(reason, simulation.time, simulation.state)
            simulation.go_back(self._good)
            return bad
        if simulation.state is not before:
            self._good = simulation.checkpoint()
        return None

    def _accept(self) -> None:
        """Take the current state as good."""
        simulation = self._simulation
        self._reset_count, self._scene = simulation.reset_count, simulation.scene
        self._energy_scales = _energy_scales(simulation.scene)
        self._good = simulation.checkpoint()
        self._excesses = simulation.energy_excesses

    def _fault(self, state: State, before: State) -> str:
        """Why a state has diverged; empty if it has not."""
        swings = self._simulation.swings
        if state is before and swings is None:
            return ''
        for name, numbers in (('the state', state.rows),
                              ('a swing', None if swings is None else swings.positions)):
            # 'not <=' is true for NaN as well
            if numbers is not None and not sum_of_squares(numbers) <= BOUND ** 2:
                finite = np.isfinite(numbers).all()
                return f'{name} is ' + (f'farther than {BOUND:g}' if finite else 'not finite')
        if state is before:
            return ''
        simulation, clusters = self._simulation, self._simulation.cluster_of_doll
        excesses, share = simulation.energy_excesses, simulation.energy_error
        gains = np.bincount(clusters, excesses - self._excesses)
        scales = np.bincount(clusters, self._energy_scales)
        # The kinetic energy is computed only where it matters.
        if not (gains <= share * scales).all():
            scales += np.bincount(clusters, simulation.kinetic_energies) - gains
            rises = gains[~(gains <= share * scales)]
            if len(rises):
                return f'energy rose by {rises.max():.4g} J without work of a load'
        self._excesses = excesses
        return ''


def sum_of_squares(numbers: np.ndarray) -> float:
    """Sum of squares, without BLAS, whose threads spin for 0.1 s after each long sum."""
    flat = numbers.ravel()
    return float(np.einsum('i,i', flat, flat))


def _energy_scales(scene: Scene) -> np.ndarray:
    """Energy scale of each of a scene's dolls (d,) at rest, J."""
    gravity = np.linalg.norm(scene.gravity)
    return np.array([placement.doll.mass * (gravity * placement.doll.extent / 3 + SPEED ** 2 / 2)
                     for placement in scene.dolls])

"""Impacts, and the uncertainty of their figures that is due to the length of the steps.

A scene runs at the given accuracy, and beside it with steps of half the length. Where errors are of
order p, the error of a figure is 2^p / (2^p - 1) times its difference between both runs. A safety
factor makes an uncertainty of this error, as in the grid convergence index of two grids (Roache
1994, J Fluids Eng 116:405). A figure may be the same in both runs by chance: its difference counts
as no less than what follows from the difference of the bones' motions as the tick begins.
"""
from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from ..model.biomechanical_limits import BiomechanicalLimits
from ..model.scene import SECOND, Scene
from ..model.state import State
from .accuracy import EXACT, TOUCHING, Accuracy, resolve_accuracy
from .sensors.impacts import Impact
from .simulation import Simulation

ORDER = 1
"""Of the errors: steps are of order 2 while contacts persist, but the instant at which one begins
to slip, or parts, is known to a step."""

SAFETY = 3.0
"""Roache's factor for two grids."""

FACTOR = SAFETY * 2 ** ORDER / (2 ** ORDER - 1)
"""Uncertainty of a figure over its difference from that of the finer run."""

LEVER = 0.1
"""m: distance at which a turn of a bone moves what it meets, half the breadth of a trunk; and over
which the effective mass changes by itself."""

APART = 1e-3
"""m: the runs have come apart when a bone is farther than this from where the finer run has it, by
distance and LEVER times the angle."""

WINDOW = 0.01
"""s between an impact and its partner in the finer run, at most; at equal times their speeds differ
by a factor of e at most."""

ROUNDING = 1e-6
"""Share of a figure below which no uncertainty is."""

FLIGHT_ORDER = 8
"""Of the integrator without contact, whose step follows from its tolerance."""

LONGEST = 3600.0
"""s"""

Act = Callable[[Simulation], object]


@dataclass(frozen=True)
class ImpactUncertainty:
    """Uncertainties of the figures of an impact, in their units, the time's in s. NaN: unknown. The
    impact has no partner, its speed is not known to be above 0, so that it may not happen, or the
    impact itself lacks the figure.
    """

    time: float = math.nan
    speed: float = math.nan
    effective_mass: float = math.nan
    impulse: float = math.nan
    peak_force: float = math.nan
    duration: float = math.nan
    ratio: float = math.nan


@dataclass(frozen=True)
class UncertainImpact:
    """An impact and its partner in the finer run."""

    impact: Impact
    """At the scene's accuracy."""
    finer: Impact | None
    """The same impact with steps of half the length; None: there is none, or the runs have come
    apart."""
    uncertainty: ImpactUncertainty


@dataclass(frozen=True)
class UncertainImpacts:
    """All impacts of a run, by time."""

    impacts: tuple[UncertainImpact, ...]
    apart: float
    """s: when the runs have come apart, by APART; infinite if they have not. A fall is chaotic:
    from then on the other run is another fall, and nothing has an uncertainty."""
    dropped: int
    """Impacts that are missing, as Simulation.dropped_impacts."""


def impacts_with_uncertainty(
        scene: Scene, duration: float, limits: BiomechanicalLimits, act: Act | None = None,
        accuracy: str | Accuracy = 'normal') -> UncertainImpacts:
    """Simulate a scene twice, with steps of two lengths, and compare the impacts, with engine
    rigid.

    Args:
        scene: what to simulate.
        duration: s, from the scene's tick to 3600, rounded to ticks.
        limits: as of Simulation.record_impacts().
        act: called with each of both simulations before each of its ticks, to push, hold or drive;
            what it does must follow from the simulation that it gets.
        accuracy: as of Simulation.

    Returns:
        The impacts of the run at ``accuracy``, each with its uncertainties.

    Raises:
        OutOfRange: duration is out of its range, or accuracy is none.

    Example:
        >>> found = impacts_with_uncertainty(load_scene('man_faints'), 0.6, load_limits())
        >>> hit = found.impacts[0]
        >>> hit.uncertainty.speed < hit.impact.speed
        True
    """
    errors.check_range('duration', duration, scene.step, LONGEST)
    accuracy = resolve_accuracy(accuracy)
    hits: list[Impact] = []
    finer: list[Impact] = []
    deviations: list[tuple[float, float]] = []
    apart = math.inf
    with (Simulation(scene, accuracy=accuracy, engine='rigid') as coarse,
          Simulation(scene, accuracy=halved(accuracy, scene.step), engine='rigid') as fine):
        for simulation in (coarse, fine):
            simulation.record_impacts(limits)
        for _ in range(round(duration / scene.step)):
            begin, deviation = coarse.time / SECOND, Deviation.between(coarse.state, fine.state)
            hits += _impacts_of_tick(coarse, act)
            if apart == math.inf:
                finer += _impacts_of_tick(fine, act)
                if Deviation.between(coarse.state, fine.state).places.max() > APART:
                    apart = begin
                else:
                    deviations += [deviation.of(scene, hit) for hit in coarse.impacts]
        dropped = coarse.dropped_impacts
    partners = partners_of(hits[:len(deviations)], finer)
    known = [UncertainImpact(hit, partner,
                             uncertainty_of(hit, partner, accuracy.touching, *deviation))
             for hit, partner, deviation in zip(hits, partners, deviations, strict=False)]
    return UncertainImpacts(
        (*known, *(UncertainImpact(hit, None, ImpactUncertainty()) for hit in hits[len(known):])),
        apart, dropped)


def halved(accuracy: Accuracy, tick: float) -> Accuracy:
    """An accuracy with twice as many steps in contact in a tick, s, a quarter of the solve_error,
    and the flight_error of steps half as long, but not below that of EXACT.
    """
    count = math.ceil(tick / accuracy.step - 1e-9)
    return dataclasses.replace(
        accuracy, step=tick / (2 * count), solve_error=accuracy.solve_error / 4,
        flight_error=min(accuracy.flight_error, max(
            accuracy.flight_error / 2 ** FLIGHT_ORDER, EXACT.flight_error)))


def partners_of(impacts: Sequence[Impact], others: Sequence[Impact]) -> list[Impact | None]:
    """Partner of each impact: the most similar one of ``others`` with the same bone and the same
    other side, if neither has a more similar one. Similarity is by the difference in time, over
    WINDOW, and in the logarithm of the speed, so that small impacts that follow another at once are
    told from it. None where the norm of both is above 1.
    """
    places: dict[tuple[str, str, str], tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
    for side, found in enumerate((impacts, others)):
        for index, hit in enumerate(found):
            places[hit.doll, hit.bone, hit.against][side].append(index)
    partners: list[Impact | None] = [None] * len(impacts)
    for own, theirs in places.values():
        if not own or not theirs:
            continue
        unlike = np.hypot(
            np.subtract.outer(_times(impacts, own), _times(others, theirs)) / WINDOW,
            np.log(np.divide.outer(_speeds(impacts, own), _speeds(others, theirs))))
        for row, index in enumerate(own):
            column = int(unlike[row].argmin())
            if unlike[:, column].argmin() == row and unlike[row, column] <= 1:
                partners[index] = others[theirs[column]]
    return partners


def uncertainty_of(hit: Impact, finer: Impact | None, touching: float = TOUCHING,
                   place: float = 0.0, velocity: float = 0.0) -> ImpactUncertainty:
    """Uncertainties of the figures of an impact, from its partner in the finer run; unknown without
    one, and where the speed is not known to be above 0.

    ``place``, m, and ``velocity``, m/s: differences of the motions of both runs where it meets.
    Differences of the figures count as no less than what follows from these two. ``touching``, m:
    distance by which the impact is found early, at most.
    """
    if finer is None:
        return ImpactUncertainty()
    turned, faster = place / LEVER, velocity / hit.speed
    shares = {'speed': faster, 'effective_mass': turned, 'impulse': faster + turned,
              'peak_force': faster + turned / 2, 'ratio': faster + turned / 2,
              'duration': turned / 2}
    found = ImpactUncertainty(
        time=FACTOR * max(abs(hit.time - finer.time) / SECOND, place / hit.speed)
        + touching / hit.speed,
        **{name: FACTOR * max(abs(getattr(hit, name) - getattr(finer, name)),
                              share * getattr(hit, name)) + ROUNDING * getattr(hit, name)
           for name, share in shares.items()})
    return found if found.speed < hit.speed else ImpactUncertainty()


@dataclass(frozen=True)
class Deviation:
    """How far the motions of n bones in two runs of a scene are from each other."""

    places: np.ndarray
    """(n,) m: distance, and LEVER times the angle."""
    velocities: np.ndarray
    """(n,) m/s: the same of velocities."""

    @classmethod
    def between(cls, a: State, b: State) -> Deviation:
        """Deviation between two states."""
        return cls(
            np.linalg.norm(a.positions - b.positions, axis=1)
            + LEVER * rotation.angle_between(a.orientations, b.orientations),
            np.linalg.norm(a.linear_velocities - b.linear_velocities, axis=1)
            + LEVER * np.linalg.norm(a.angular_velocities - b.angular_velocities, axis=1))

    def of(self, scene: Scene, hit: Impact) -> tuple[float, float]:
        """Deviation, m and m/s, of an impact: the larger one of its one or two bones."""
        bones = [scene.bone_index(name) for name in (hit.bone, hit.against)
                 if name in scene.bone_names]
        return float(self.places[bones].max()), float(self.velocities[bones].max())


def _impacts_of_tick(simulation: Simulation, act: Act | None) -> tuple[Impact, ...]:
    """Act on a simulation, and advance it by a tick."""
    if act is not None:
        act(simulation)
    simulation.advance()
    return simulation.impacts


def _times(impacts: Sequence[Impact], chosen: list[int]) -> np.ndarray:
    return np.array([impacts[index].time for index in chosen]) / SECOND


def _speeds(impacts: Sequence[Impact], chosen: list[int]) -> np.ndarray:
    return np.array([impacts[index].speed for index in chosen])

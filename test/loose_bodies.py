"""Scenes of loose bodies (dolls of one bone), and what is known of their motion without an engine.

Free balls without friction are integrated from one impact to the next: between impacts they fall
side by side, so impacts are where |dx + dv t| is the sum of radii, and of the relative velocity
along the line of centres -e times is left.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ragdoll_ros import Bone, Box, Ground, Placement, Ragdoll, Scene, Sphere
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.shapes import Part

G = 9.8
RADIUS = 0.1
"""m, of all balls."""

WEIGHTLESS = (0.0, 0.0, 0.0)


def ball(name='ball', mass=1.0, radius=RADIUS):
    """A ball, its frame at its centre."""
    return Ragdoll(name, (Bone(name, Sphere(radius), mass, (0, 0, 0)),))


def box(size, mass, name='box'):
    """A box of ``size`` (3,) m, its frame at its centre."""
    return Ragdoll(name, (Bone(name, Box(tuple(size)), mass, (0, 0, 0)),))


@dataclass(frozen=True)
class Balls:
    """Balls of RADIUS: ``positions`` and ``velocities`` (n, 3), ``masses`` (n,)."""

    positions: np.ndarray
    velocities: np.ndarray
    masses: np.ndarray

    def scene(self, material, gravity=WEIGHTLESS, ground=None, others=()):
        """Their scene, with ``others`` placed after them."""
        return Scene('balls', (*(
            Placement(ball(mass=float(mass)), f'ball_{k}', tuple(x), velocity=tuple(v))
            for k, (x, v, mass) in enumerate(zip(self.positions, self.velocities, self.masses,
                                                 strict=True))), *others),
            ground, material, gravity=gravity)

    def kinetic(self, velocities):
        """Kinetic energy, J, at ``velocities`` (n, 3); balls without friction do not spin."""
        return float(self.masses @ (np.asarray(velocities) ** 2).sum(axis=1)) / 2


def line_of_balls(gaps, masses, speed):
    """Balls along x at rest, each ``gaps`` (n - 1,) m after the one before; the first moves."""
    count = len(masses)
    x = np.concatenate([[0.0], np.cumsum(2 * RADIUS + np.asarray(gaps, float))])
    positions, velocities = np.zeros((count, 3)), np.zeros((count, 3))
    positions[:, 0], velocities[0, 0] = x, speed
    return Balls(positions, velocities, np.asarray(masses, float))


@dataclass(frozen=True)
class Impacts:
    """What event_driven() found: final ``velocities`` (n, 3), and of each impact its ``times``, s,
    pair of balls and approach speed, m/s.
    """

    velocities: np.ndarray
    times: tuple[float, ...]
    pairs: tuple[tuple[int, int], ...]
    speeds: tuple[float, ...]


def event_driven(balls, restitution, duration):
    """Velocities of free balls without friction after ``duration`` s of successive impacts."""
    x, v, now = balls.positions.copy(), balls.velocities.copy(), 0.0
    first, second = np.triu_indices(len(x), 1)
    times, pairs, speeds = [], [], []
    while True:
        apart, relative = x[second] - x[first], v[second] - v[first]
        closing = -(apart * relative).sum(axis=1)
        a = (relative ** 2).sum(axis=1)
        c = (apart ** 2).sum(axis=1) - (2 * RADIUS) ** 2
        inside = closing ** 2 - a * c
        with np.errstate(invalid='ignore', divide='ignore'):
            waits = np.where((closing > 0) & (inside > 0), c / (closing + np.sqrt(inside)), np.inf)
        k = int(np.argmin(waits))
        wait = max(0.0, float(waits[k]))
        if now + wait > duration:
            return Impacts(v, tuple(times), tuple(pairs), tuple(speeds))
        now, x = now + wait, x + v * wait
        i, j = int(first[k]), int(second[k])
        normal = (x[j] - x[i]) / np.linalg.norm(x[j] - x[i])
        speed = float((v[i] - v[j]) @ normal)
        impulse = (1 + restitution) * speed / (1 / balls.masses[i] + 1 / balls.masses[j])
        v[i] -= impulse / balls.masses[i] * normal
        v[j] += impulse / balls.masses[j] * normal
        times.append(now), pairs.append((i, j)), speeds.append(speed)


def moreau_row(count, restitution):
    """Velocities (n,) of equal balls that touch in a row, when the first comes in at 1 m/s.

    Where all contacts are closed at the impact, Moreau's law solves them as one system: relative
    velocities become -e times those before, here e and 0, .... Momentum gives the rest.
    """
    rest = (1 + restitution) / count
    return np.concatenate([[rest - restitution], np.full(count - 1, rest)])


def container(side, thickness=0.2, mass=1000.0):
    """A cubic box with room for ``side`` m, of six walls: one rigid body, which floats."""
    wide, off = side + 2 * thickness, (side + thickness) / 2
    walls = []
    for axis in range(3):
        for sign in (-1, 1):
            size, place = [wide] * 3, [0.0] * 3
            size[axis], place[axis] = thickness, sign * off
            walls.append(Part(Box(tuple(size)), tuple(place)))
    return Ragdoll('container', (Bone('container', Compound(tuple(walls)), mass, (0, 0, 0)),))


def converging_balls(count, seed=1):
    """Balls around the origin, all on their way to it, at random speeds about 2 m/s."""
    rng = np.random.default_rng([33, seed, count])
    positions = []
    while len(positions) < count:
        place = rng.normal(size=3)
        place *= rng.uniform(0.5, 0.7 + 0.05 * count ** (1 / 2)) / np.linalg.norm(place)
        if all(np.linalg.norm(place - other) > 2.2 * RADIUS for other in positions):
            positions.append(place)
    positions = np.array(positions)
    inwards = -positions / np.linalg.norm(positions, axis=1)[:, None]
    return Balls(positions, inwards * rng.uniform(1.5, 2.5, (count, 1)),
                 rng.uniform(0.5, 2.0, count))


def contained_balls(count, spacing=0.26, seed=2):
    """Balls on a cubic grid about the origin with random velocities of 1 m/s; the grid's side."""
    rng = np.random.default_rng([33, seed, count])
    wide = math.ceil(count ** (1 / 3))
    grid = np.stack(np.meshgrid(*[np.arange(wide)] * 3, indexing='ij'), -1).reshape(-1, 3)
    positions = (grid[:count] - (wide - 1) / 2) * spacing
    return Balls(positions, rng.normal(size=(count, 3)) / math.sqrt(3),
                 np.ones(count)), wide * spacing


def dominoes(count, material, rate, size=(0.04, 0.2, 0.3), pitch=0.1):
    """Boxes that stand in a row along x; the first one turns at ``rate`` rad/s about its lower
    front edge.
    """
    thick, _, high = size
    piece = box(size, 1.0, 'domino')
    placements = [Placement(piece, f'domino_{k}', (k * pitch, 0, high / 2)) for k in range(count)]
    placements[0] = Placement(piece, 'domino_0', (0, 0, high / 2), spin=(0, rate, 0),
                              velocity=(rate * high / 2, 0, rate * thick / 2))
    return Scene('dominoes', tuple(placements), Ground(), material, gravity=(0, 0, -G))


def passing_times(times, angles, rates, threshold):
    """When each of ``angles`` (t, n) first exceeds a threshold, (n,) s; NaN: never. Between samples
    the cubic that has their angles and ``rates``.
    """
    found = np.full(angles.shape[1], np.nan)
    for k, own in enumerate(angles.T):
        j = int(np.argmax(own > threshold))
        if j == 0:
            continue
        wide = times[j] - times[j - 1]
        s = np.linspace(0, 1, 1001)
        cubic = (own[j - 1] * (1 + 2 * s) * (1 - s) ** 2 + own[j] * s ** 2 * (3 - 2 * s)
                 + wide * (rates[j - 1, k] * s * (1 - s) ** 2 - rates[j, k] * s ** 2 * (1 - s)))
        found[k] = times[j - 1] + wide * s[np.argmax(cubic > threshold)]
    return found


def stack(count, material, side=0.2, mass=2.0):
    """Cubes on top of each other."""
    piece = box((side,) * 3, mass)
    return Scene('stack', tuple(
        Placement(piece, f'box_{k}', (0, 0, side * (k + 0.5))) for k in range(count)),
        Ground(), material, gravity=(0, 0, -G))


def brick_wall(columns, courses, material, size=(0.4, 0.2, 0.2), mass=2.0):
    """Bricks in courses, each course half a brick on from the one below, with half bricks at its
    ends: a whole one would be supported up to just below its center of mass.
    """
    whole = box(size, mass, 'brick')
    half = box((size[0] / 2, *size[1:]), mass / 2, 'half')
    placements = []
    for row in range(courses):
        high = size[2] * (row + 0.5)
        ends = (0.25, columns - 0.25) if row % 2 else ()
        placements += [
            Placement(whole, f'brick_{row}_{k}', (size[0] * (k + (row % 2 + 1) / 2), 0, high))
            for k in range(columns - row % 2)]
        placements += [Placement(half, f'half_{row}_{k}', (size[0] * at, 0, high))
                       for k, at in enumerate(ends)]
    return Scene('wall', tuple(placements), Ground(), material, gravity=(0, 0, -G))

"""Random bumps, reproducible: a robot runs into a person; and what is bad.

`python test/random_bumps.py --bumps 1000` tells of so many, with `--figures` also how many figures
of the blows are within their uncertainty of those with a sixteenth of the step.
"""
from __future__ import annotations

import argparse
import dataclasses
import functools
import math
import sys
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np
from random_worlds import deepest_in_bodies

from ragdoll_ros import (
    Bone,
    Box,
    Compound,
    Cylinder,
    Follow,
    Ground,
    Part,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    StaticBody,
    impacts_with_uncertainty,
    load_limits,
    person,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.anthropometry import PERCENTILES, SEXES
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.scene import SECOND, Material, height
from ragdoll_ros.people.person import standing
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.impact_uncertainty import partners_of
from ragdoll_ros.physics.sensors.impacts import Impact

SITUATIONS = ('standing', 'sitting', 'lying', 'wall')
SPEEDS = 0.2, 3.0
"""m/s, of the robot."""

SECONDS = 0.7
TICK = 0.01
"""s, of a bump, and of a tick."""

EXCESS = 1e-3
"""Largest share of the energy at work that may come from nothing."""

DEEPEST = 5e-3
"""m, that anything may be in anything else."""

EVERY = 5
"""Ticks from one look at depths to the next, beside those that the engine knows."""

FINEST = 16
"""Steps in one of the accuracy, of the run that figures are compared with."""

COVERED = 0.9
"""Share of the figures that are to be within their uncertainty."""

FIGURES = ('time', 'speed', 'effective_mass', 'impulse', 'peak_force')

CLEARANCE = 1e-3
"""m between person and ground, seat and wall, at the start."""

SITS = {'l_p_hip': -88, 'r_p_hip': -88, 'l_knee': 85, 'r_knee': 85,
        'l_p_shoulder': -25, 'r_p_shoulder': -25, 'l_elbow': -50, 'r_elbow': -50}
"""Angles, degrees, of who sits."""

WHEELS = 0.02
"""Friction of a robot of limited force, which stands on the ground."""


@dataclasses.dataclass(frozen=True)
class Bump:
    """A person, and a robot on its way."""

    scene: Scene
    situation: str
    twist: tuple[float, ...]
    """(6,) of the robot: m/s, rad/s."""
    is_held: bool
    """Whether the person's joints are held by springs, as of who stands."""

    def act(self, simulation: Simulation) -> None:
        """Drive the robot, before each tick."""
        doll = self.scene.dolls[0]
        if self.is_held and not simulation.holds:
            for name, spring in standing(doll.doll).items():
                simulation.hold(self.scene.qualified(doll, name), *spring)
        simulation.drive_body('robot', twist=self.twist)


def bump(number: int) -> Bump:
    """Random bump ``number``. The robot comes along x."""
    rng = np.random.default_rng([36, 4, number])
    situation = SITUATIONS[number % len(SITUATIONS)]
    faces = rotation.from_axis_angle((0.0, 0.0, 1.0), float(
        rng.integers(2) * math.pi if situation == 'wall' else rng.uniform(-math.pi, math.pi)))
    who = _person(rng, situation, faces)
    held = situation != 'lying' and bool(rng.integers(2))
    is_exact = situation != 'wall'
    bodies: tuple[StaticBody, ...] = ()
    loose: tuple[Placement, ...] = ()
    boxes = [_bounds(bone.shape, who.bone_pose(bone)) for bone in who.doll.bones]
    if situation == 'sitting':
        # Between an exact robot and a seat that never moves, shins would be squeezed.
        is_exact = bool(rng.integers(2))
        seat, pose = _seat(who, faces)
        boxes.append(_bounds(seat, pose))
        where = tuple(pose.position), tuple(pose.orientation)
        if is_exact:
            loose = (Placement(Ragdoll('seat', (Bone('seat', seat, 8.0, (0, 0, 0)),)), 'seat',
                               *where),)
        else:
            bodies = (StaticBody('seat', seat, *where),)
    if situation == 'wall':
        away = max(high[0] for _, high in boxes) + 0.1 + CLEARANCE
        bodies = (StaticBody('wall', Box((0.2, 6.0, 3.0)), (float(away), 0.0, 1.5)),)
    speed = float(rng.uniform(*SPEEDS))
    robot, size = _robot(rng)
    follow = Follow() if is_exact else Follow(*rng.uniform((100, 30), (1000, 200)).tolist())
    hit = boxes[rng.integers(len(who.doll.bones))]
    aim = float(rng.uniform(hit[0][1], hit[1][1]))
    ahead = min(low[0] for low, high in boxes if low[1] < aim + size[1] / 2 and (
        high[1] > aim - size[1] / 2 and low[2] < size[2]))
    start = (float(ahead - size[0] / 2 - speed * rng.uniform(0.02, 0.2)), aim,
             0.005 if is_exact else CLEARANCE)
    spin = float(rng.uniform(-1, 1)) if rng.random() < 0.3 else 0.0
    scene = Scene(f'bump_{number}', (
        who, Placement(robot, 'robot', start, follow=follow,
                       velocity=(0.0 if is_exact else speed, 0.0, 0.0)), *loose),
        Ground(), Material(float(rng.uniform(0.2, 0.9)), 0.0, float(rng.choice((0.0, 0.2)))),
        bodies=bodies)
    return Bump(scene, situation, (speed, 0, 0, 0, 0, spin), held)


def _person(rng, situation, faces):
    """Who is CLEARANCE above the ground."""
    sex = SEXES[rng.integers(2)]
    doll = person(*PERCENTILES[sex][(5, 50, 95)[rng.integers(3)]], sex)
    if situation == 'lying':
        over = rotation.from_axis_angle((0.0, 1.0, 0.0), float(rng.choice((-1, 1)) * math.pi / 2))
        faces = rotation.multiply(faces, over)
    angles = {name: math.radians(value) for name, value in SITS.items()}
    who = Placement(doll, 'person', orientation=tuple(faces),
                    angles=angles if situation == 'sitting' else {})
    return dataclasses.replace(who, position=(0.0, 0.0, CLEARANCE - _lowest(who, '')))


def _lowest(who, part):
    """Height, m, of the lowest point of bones with ``part`` in their names."""
    return min(height(bone, *who.bone_pose(bone), Ground()) for bone in who.doll.bones
               if part in bone.name)


def _seat(who, faces):
    """A box below pelvis and thighs of who sits, and its pose."""
    top = min(_lowest(who, 'pelvis'), _lowest(who, 'thigh')) - CLEARANCE
    x, y, _ = who.bone_pose(who.doll.root).position + rotation.rotate(faces, (0.07, 0.0, 0.0))
    return Box((0.42, 0.46, top)), Pose(np.array((x, y, top / 2)), np.array(faces))


def _bounds(shape, pose):
    """Least and largest coordinates (3,) m, of a shape at a pose."""
    points = pose.apply(shape.mesh()[0])
    return points.min(axis=0), points.max(axis=0)


def _robot(rng):
    """A robot, its frame at the middle of its lower side, and its length, width and height, m."""
    kind, high = rng.integers(3), float(rng.uniform(0.2, 1.2))
    if kind == 0:
        wide, deep = rng.uniform(0.3, 0.7, 2).tolist()
        parts = [Part(Box((deep, wide, high)), (0, 0, high / 2))]
    elif kind == 1:
        deep = wide = float(rng.uniform(0.3, 0.6))
        parts = [Part(Cylinder(wide / 2, high), (0, 0, high / 2))]
    else:  # a base, and a mast with an arm
        deep, wide, high = 0.7, 0.5, high + 0.3
        parts = [Part(Box((deep, wide, 0.25)), (0, 0, 0.125)),
                 Part(Cylinder(0.06, high - 0.25), (0, 0, high / 2 + 0.125)),
                 Part(Box((0.3, 0.08, 0.08)), (0.2, 0, high - 0.1))]
    whole, mass = Compound(tuple(parts)), float(rng.uniform(20, 80))
    centre = Pose(np.array(whole.centroid))
    shape = whole.in_frame(centre)
    return Ragdoll('robot', (Bone(
        'robot', shape, mass, tuple(map(float, whole.centroid)), friction=WHEELS,
        moments=tuple(np.diag(shape.inertia_matrix(mass)).tolist())),)), (deep, wide, high)


def deepest(scene: Scene, state) -> tuple[float, str]:
    """Largest depth, m, of a point of a bone in a body, the ground or another doll; and where."""
    found = deepest_in_bodies(scene, state)
    solids = [[(bone.name, bone.shape, position, turn) for bone, position, turn in zip(
        scene.bones[own], state.positions[own], state.orientations[own], strict=True)]
        for own in scene.bone_slices]
    for name, shape, place, turn in solids[0]:
        points = place + rotation.rotate(turn, _points(shape))
        for other, solid, at, turned in (one for doll in solids[1:] for one in doll):
            reach = sum(math.hypot(*each.half_extents) for each in (shape, solid))
            if np.linalg.norm(at - place) > reach:
                continue
            theirs = at + rotation.rotate(turned, _points(solid))
            for one, where, axes, others in ((solid, at, turned, points),
                                             (shape, place, turn, theirs)):
                local = rotation.rotate(rotation.inverse(axes), others - where)
                depth = float(-one.signed_distance(local).min())
                found = max(found, (depth, f'{name} in {other}'))
    return found


@functools.lru_cache(maxsize=100)
def _points(shape):
    """Points (p, 3) m, of a shape's surface: corners, and the middles of its triangles."""
    corners, triangles = shape.mesh()
    return np.concatenate([corners, corners[triangles].mean(axis=1)])


@dataclasses.dataclass(frozen=True)
class Found:
    """What a bump shows."""

    excess: float
    """Energy from nothing over that at work, infinite if a state was not finite."""
    depth: float
    """m: deepest that anything was in anything else."""
    where: str
    overlaps: bool
    """Whether something begins in something else: such a bump is none."""
    speed: float
    """m/s: of the fastest blow by the robot; 0: it did not reach the person."""

    @property
    def is_bad(self) -> bool:
        """Whether energy came from nothing, or something was passed."""
        return not self.overlaps and not (self.excess <= EXCESS and self.depth <= DEEPEST)


def run(number: int, accuracy: str = 'normal') -> Found:
    """Bump ``number``."""
    made = bump(number)
    scene, who = made.scene, made.scene.dolls[0]
    deep: tuple[float, str] = 0.0, ''
    lowest = most = rise = speed = 0.0
    with Simulation(scene, accuracy=accuracy, engine='rigid') as simulation:
        overlaps = bool(simulation.initial_overlaps)
        simulation.record_impacts(load_limits())
        high = who.position[2] + rotation.rotate(who.orientation, who.mass_centre)[2]
        energy = who.doll.mass * 9.8 * high + simulation.kinetic_energy
        for tick in range(round(SECONDS / TICK)):
            made.act(simulation)
            state = simulation.advance()
            if not np.isfinite(state.rows).all():
                return Found(math.inf, deep[0], deep[1], overlaps, speed)
            # What is lost is lost: a rise is energy from nothing.
            excess, most = simulation.energy_excess, max(most, simulation.work[0])
            lowest, rise = min(lowest, excess), max(rise, excess - lowest)
            speed = max([speed, *(hit.speed for hit in blows(simulation.impacts))])
            at = f'at {simulation.time / 1e9:.2f} s'
            deep = max(deep, (float(max(simulation.contacts.depths, default=0.0)),
                              f'a contact {at}'))
            if tick % EVERY == 0:
                depth, where = deepest(scene, state)
                deep = max(deep, (depth, f'{where} {at}'))
    return Found(rise / (energy + most), *deep, overlaps, speed)


def blows(impacts: Sequence[Impact]) -> list[Impact]:
    """Those of the robot against the person, that the limits give a force: of those that are within
    a pulse of the contact law, which are one blow, the one with the largest force.
    """
    met = [hit for hit in impacts if (hit.doll, hit.against) == ('person', 'robot/robot')
           and hit.region]
    return [hit for hit in met if not any(
        other.bone == hit.bone and other.peak_force > hit.peak_force
        and abs(other.time - hit.time) < SECOND * max(hit.duration, other.duration)
        for other in met)]


def covered(number: int) -> Counter:
    """How many ``blows`` of a bump there are before both runs come apart, and how many later, how
    many of the former are ``stated`` to have an uncertainty, and of how many of these each figure
    is within it.
    """
    made, limits, fine = bump(number), load_limits(), []
    found = impacts_with_uncertainty(made.scene, SECONDS, limits, made.act)
    steps = math.ceil(TICK / NORMAL.step)
    finer = dataclasses.replace(NORMAL, step=TICK / (FINEST * steps), flight_error=1e-13,
                                solve_error=1e-6)
    with Simulation(made.scene, accuracy=finer, engine='rigid') as simulation:
        simulation.record_impacts(limits)
        while simulation.time / 1e9 < min(found.apart + 2 * TICK, SECONDS):
            made.act(simulation)
            simulation.advance()
            fine += simulation.impacts
    told = [one for one in found.impacts if one.impact.time / 1e9 < found.apart]
    count: Counter = Counter()
    all_blows = blows([one.impact for one in found.impacts])
    count['late'] = sum(hit.time / 1e9 >= found.apart for hit in all_blows)
    for one, true in zip(told, partners_of([one.impact for one in told], fine), strict=True):
        if one.impact not in all_blows:
            continue
        count['blows'] += 1
        if not math.isnan(one.uncertainty.speed):
            count['stated'] += 1
            count.update(name for name in FIGURES if true and is_within(one, true, name))
    return count


def is_within(one, true, name: str) -> bool:
    """Whether a figure of an impact is within its uncertainty of the ``true`` one."""
    scale = 1e9 if name == 'time' else 1.0
    return abs(getattr(one.impact, name) - getattr(true, name)) <= scale * getattr(
        one.uncertainty, name)


def main() -> int:
    """Run the command; 1 if a bump is bad, or fewer figures than COVERED are within."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--bumps', type=int, default=1000, help='number of bumps')
    parser.add_argument('--first', type=int, default=0, help='number of the first one')
    parser.add_argument('--accuracy', default='normal', choices=('draft', 'normal', 'exact'))
    parser.add_argument('--figures', action='store_true', help='check uncertainties instead')
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.bumps)
    return figures(numbers) if options.figures else energies(numbers, options.accuracy)


def energies(numbers: range, accuracy: str) -> int:
    """Print what bumps show; 1 if one is bad."""
    kinds: Counter = Counter()
    good: list[Found] = []
    began = time.monotonic()
    for number in numbers:
        found = run(number, accuracy)
        if found.is_bad:
            print(number, SITUATIONS[number % len(SITUATIONS)], found, flush=True)
        kinds['bad' if found.is_bad else 'overlapping' if found.overlaps else 'good'] += 1
        good += [found] if not found.is_bad and not found.overlaps else []
        _progress(number - numbers.start + 1, len(numbers), began)
    hits = [found.speed for found in good if found.speed > 0]
    print(f'{kinds["bad"]} bad; {kinds["good"]} good, at most '
          f'{1e3 * max(found.depth for found in good):.3f} mm deep, '
          f'{max(found.excess for found in good):.1e} of the energy from nothing; '
          f'{kinds["overlapping"]} began in something; the robot hit in {len(hits)}, at '
          f'{min(hits):.2f} to {max(hits):.2f} m/s')
    return kinds['bad'] > 0


def figures(numbers: range) -> int:
    """Print which share of the figures is within their uncertainty; 1 if it is below COVERED."""
    count: Counter = Counter()
    began = time.monotonic()
    for number in numbers:
        count += covered(number)
        _progress(number - numbers.start + 1, len(numbers), began)
    shares = {name: count[name] / count['stated'] for name in FIGURES}
    print(f'{count["blows"] + count["late"]} blows by the robot, {count["late"]} of them after the '
          f'runs came apart, {count["stated"]} with an uncertainty; within it '
          + ', '.join(f'{name} {share:.1%}' for name, share in shares.items()))
    return sum(shares.values()) < COVERED * len(shares)


def _progress(done: int, of: int, began: float) -> None:
    """Rewrite a line of the terminal."""
    if sys.stderr.isatty() or done % 20 == 0:
        print(f'{done} of {of}, {time.monotonic() - began:.0f} s', file=sys.stderr, flush=True,
              end='\r' if sys.stderr.isatty() else '\n')


if __name__ == '__main__':
    sys.exit(main())

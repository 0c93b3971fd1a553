"""Random worlds, reproducible: the default doll falls over bodies of all kinds; and what is bad.

`python test/random_worlds.py --starts 10008` tells of so many. `--scene stairs` throws the first
doll of a shipped scene instead, at up to 1 m/s and 1 rad/s along each axis more, for 20 s or until
it sleeps.
"""
from __future__ import annotations

import argparse
import dataclasses
import math
import sys
import time

import numpy as np
from pair_cost import thrown

from ragdoll_ros import (
    Box,
    Capsule,
    Cylinder,
    Ground,
    HeightField,
    Hull,
    Mesh,
    Placement,
    Plane,
    Scene,
    Simulation,
    Sphere,
    StaticBody,
    load_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import Material

SECONDS, AT_REST_BY = 3.0, 20.0
SPREAD = 1.2
"""m: bodies are within so much of the doll, along x and y."""

EXCESS = 1e-5
"""Largest energy from nothing over that of a fall by 1 m, as of the 10 008 starts."""

DEEPEST = 1e-3
"""m, on the way and at the end, as on the ground."""

FARTHEST = math.radians(0.2)
"""rad that a joint may be past a limit, as in the report's 10 008 starts."""

EVERY = 10
"""Ticks from one look at depths and limits to the next."""

MATERIALS = [Material(friction, 0.0, restitution) for friction in (0.0, 0.3, 0.8, math.inf)
             for restitution in (0.0, 0.3, 0.7)]


def world(number: int) -> Scene:
    """Random world ``number``."""
    rng = np.random.default_rng([36, number])
    floor = [_ground, _slope, _hills][rng.integers(3)]
    ground, bodies = floor(rng)
    makers = [_box, _box, _sphere, _cylinder, _capsule, _stone, _shell]
    bodies += [_anywhere(rng, f'body_{k}', makers[rng.integers(len(makers))](rng))
               for k in range(rng.integers(3, 16))]
    if rng.random() < 0.4:
        bodies += [_wall(rng, k) for k in range(rng.integers(1, 3))]
    doll = load_scene('drop').dolls[0].doll
    top = 1.6 + (0.8 if ground is None else 0.0)
    placement = Placement(
        doll, position=(0.0, 0.0, top + float(rng.uniform(0.0, 1.0))),
        orientation=tuple(rotation.normalized(rng.normal(size=4))),
        velocity=tuple(rng.normal(size=3)), spin=tuple(3 * rng.normal(size=3)))
    return Scene(f'world_{number}', (placement,), ground, MATERIALS[rng.integers(len(MATERIALS))],
                 bodies=tuple(bodies))


def _ground(rng):
    return Ground(), []


def _slope(rng):
    """Two planes: a gutter, or a roof where they turn away from each other."""
    angles = rng.uniform(-0.4, 0.4, 2)
    return None, [StaticBody(f'floor_{k}', Plane(), (0.0, 0.0, -0.3), tuple(
        rotation.from_axis_angle((0.0, 1.0, 0.0) if k else (1.0, 0.0, 0.0), angle)))
        for k, angle in enumerate(angles)]


def _hills(rng):
    heights = rng.uniform(-0.25, 0.25, (11, 13))
    return None, [StaticBody('hills', HeightField(heights, (24.0, 20.0)), friction=0.5)]


def _box(rng):
    return Box(tuple(rng.uniform(0.05, 0.6, 3)))


def _sphere(rng):
    return Sphere(rng.uniform(0.05, 0.3))


def _cylinder(rng):
    return Cylinder(*rng.uniform(0.05, 0.3, 2))


def _capsule(rng):
    return Capsule(*rng.uniform(0.05, 0.3, 2))


def _stone(rng):
    """A hull of random points: their tetrahedron, which needs no library."""
    points = rng.normal(size=(4, 3))
    points *= 0.3 / np.abs(points).max()
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    if np.dot(points[3] - points[0], np.cross(points[1] - points[0], points[2] - points[0])) > 0:
        faces = faces[:, ::-1]
    return Hull(points, faces)


def _shell(rng):
    """An open strip of triangles, bent at random."""
    x = np.linspace(-0.4, 0.4, 5)
    heights = rng.uniform(-0.12, 0.12, 5)
    vertices = np.array([(a, b, h) for a, h in zip(x, heights, strict=True) for b in (-0.3, 0.3)])
    faces = [f for k in range(0, 8, 2) for f in ((k, k + 2, k + 3), (k, k + 3, k + 1))]
    return Mesh(vertices, faces)


def _anywhere(rng, name, shape):
    position = (*rng.uniform(-SPREAD, SPREAD, 2), rng.uniform(0.0, 0.7))
    return StaticBody(name, shape, tuple(map(float, position)),
                      tuple(rotation.normalized(rng.normal(size=4))))


def _wall(rng, k):
    """A plane that stands 1.4 m from the doll and leans a little."""
    heading = rng.uniform(0, 2 * math.pi)
    away = np.array((math.cos(heading), math.sin(heading), 0.0))
    normal = rotation.normalized(-away + (0, 0, rng.uniform(-0.2, 0.4)))
    turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), normal)
    return StaticBody(f'wall_{k}', Plane(), tuple(map(float, 3.0 * away)), tuple(turn))


@dataclasses.dataclass(frozen=True)
class Figures:
    """What a fall in a world shows."""

    excess: float
    """Energy from nothing over that of a fall by 1 m, infinite if a state was not finite."""
    depth: float
    """m: deepest that a bone was in a body or in the ground."""
    where: str
    """In what, and when."""
    end_depth: float
    """m: the same at the end."""
    overshoot: float
    """rad: farthest that a joint was past a limit."""
    overlaps: bool
    """Whether the doll begins in something: such a world is none."""
    speed: float
    """m/s of the fastest bone at the end, 0 if all sleeps."""
    cost: float
    """s of CPU time."""

    @property
    def is_bad(self) -> bool:
        """Whether energy came from nothing, or something was passed, or a limit."""
        return not self.overlaps and not (self.excess <= EXCESS
                                          and max(self.depth, self.end_depth) <= DEEPEST
                                          and self.overshoot <= FARTHEST)


def fall(scene: Scene, accuracy: str = 'normal', seconds: float = SECONDS) -> Figures:
    """The fall in a world."""
    deepest, where, overshoot = 0.0, '', 0.0
    begin = time.process_time()
    with Simulation(scene, accuracy=accuracy, engine='rigid') as simulation:
        overlaps = bool(simulation.initial_overlaps)
        for tick in range(round(seconds / scene.step)):
            if simulation.asleep and seconds > SECONDS:
                break
            state = simulation.advance()
            if not np.isfinite(state.rows).all():
                return Figures(math.inf, deepest, where, math.inf, math.inf, overlaps, math.inf, 0)
            if tick % EVERY == 0:
                depth, body = deepest_in_bodies(scene, state)
                if depth > deepest:
                    deepest, where = depth, f'{body} at {tick / 100:.2f} s'
                overshoot = max(overshoot, simulation.measures()['limit_overshoot_rad'])
        excess = simulation.measures()['energy_excess_J']
        speed = 0.0 if simulation.asleep else float(
            np.linalg.norm(state.rows[:, 7:10], axis=1).max())
    own = scene.dolls[0].doll.mass * 9.8
    return Figures(excess / own, deepest, where, deepest_in_bodies(scene, state)[0],
                   overshoot, overlaps, speed, time.process_time() - begin)


def deepest_in_bodies(scene: Scene, state) -> tuple[float, str]:
    """Largest depth, m, of a point of a bone's surface in a body, or of a body's in a bone."""
    deepest, where = 0.0, ''
    parts = [(part, position + rotation.rotate(turn, np.array(part.position)),
              rotation.multiply(turn, np.array(part.orientation)))
             for bone, position, turn in zip(scene.bones, state.positions, state.orientations,
                                             strict=True) for part in bone.shape.parts]
    points = np.concatenate([place + rotation.rotate(turn, part.shape.mesh()[0])
                             for part, place, turn in parts])
    for body in scene.bodies:
        depth = float(-distance(body, points).min())
        if not isinstance(body.shape, Plane):
            corners = body.pose.apply(body.shape.mesh()[0])
            # Vertices within a bone; an open surface is on no side of it.
            for part, place, turn in parts:
                local = rotation.rotate(rotation.inverse(turn), corners - place)
                depth = max(depth, float(-part.shape.signed_distance(local).min()))
        if depth > deepest:
            deepest, where = depth, body.name
    if scene.ground is not None:
        depth = float(scene.ground.offset - (points @ np.array(scene.ground.normal)).min())
        deepest, where = max((deepest, where), (depth, 'ground'))
    return deepest, where


def distance(body: StaticBody, points: np.ndarray) -> np.ndarray:
    """Signed distance (p,) m, of points (p, 3), or of those inside a bound of it."""
    local = body.pose.apply_inverse(points)
    if isinstance(body.shape, Plane):
        return local[:, 2]
    if isinstance(body.shape, HeightField):
        return _above(body.shape, local)
    if isinstance(body.shape, Hull):
        triangles = body.shape.triangles
        return (np.einsum('pi,ti->pt', local, triangles.normals) - np.einsum(
            'ti,ti->t', triangles.corners[:, 0], triangles.normals)).max(axis=1)
    if isinstance(body.shape, Mesh):
        return np.full(len(points), np.inf)
    return body.shape.signed_distance(local)


def _above(field: HeightField, points: np.ndarray) -> np.ndarray:
    """Heights (p,) m of points over the triangles of a height field; beside it infinite."""
    rows, columns = field.heights.shape
    x = (points[:, 0] / field.size[0] + 0.5) * (columns - 1)
    y = (points[:, 1] / field.size[1] + 0.5) * (rows - 1)
    i, j = (np.clip(np.floor(value).astype(int), 0, most - 2)
            for value, most in ((x, columns), (y, rows)))
    u, v, h = x - i, y - j, field.heights
    a, b, c, d = h[j, i], h[j, i + 1], h[j + 1, i + 1], h[j + 1, i]
    low = np.where(u >= v, a + u * (b - a) + v * (c - b), a + v * (d - a) + u * (c - d))
    beside = (np.abs(points[:, :2]) > np.array(field.size) / 2).any(axis=1)
    return np.where(beside, np.inf, points[:, 2] - low)


def main() -> int:
    """Run the command; 1 if a fall is bad."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--starts', type=int, default=1000, metavar='N',
                        help='number of worlds (1000)')
    parser.add_argument('--first', type=int, default=0, help='number of the first one')
    parser.add_argument('--accuracy', default='normal', choices=('draft', 'normal', 'exact'))
    parser.add_argument('--scene', help='a shipped scene in place of random worlds: stairs')
    options = parser.parse_args()
    good = overlapping = awake = 0
    deepest, overshoot, excess, bad, longest = 0.0, 0.0, -math.inf, 0, 0.0
    for number in range(options.first, options.first + options.starts):
        if options.scene:
            found = fall(thrown(load_scene(options.scene), number), options.accuracy, AT_REST_BY)
        else:
            found = fall(world(number), options.accuracy)
        longest = max(longest, found.cost)
        if options.scene and found.speed:
            awake += 1
            print(f'{number} is awake: {1e3 * found.speed:.2g} mm/s')
        if found.is_bad:
            bad += 1
            print(number, found)
        elif found.overlaps:
            overlapping += 1
        else:
            good += 1
            deepest = max(deepest, found.depth, found.end_depth)
            overshoot = max(overshoot, found.overshoot)
            excess = max(excess, found.excess)
    print(f'{bad} bad; {good} good, at most {1e3 * deepest:.3f} mm deep, '
          f'{math.degrees(overshoot):.3f} degrees past a limit, {excess:.1e} of the energy from '
          f'nothing; {overlapping} began in a body; '
          + (f'{awake} awake at the end; ' if options.scene else '')
          + f'at most {longest:.1f} s of CPU time')
    return bad > 0


if __name__ == '__main__':
    sys.exit(main())

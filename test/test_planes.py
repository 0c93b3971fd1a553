"""Planes as static bodies: half spaces that are what the ground is."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from test_static_bodies import ACCURACIES, G, inclined, loose, scene, states

from ragdoll_ros import (
    Box,
    Capsule,
    Cylinder,
    Ground,
    HeightField,
    Plane,
    RagdollError,
    Simulation,
    Sphere,
    StaticBody,
    load_scene,
    save_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.physics.accuracy import resolve_accuracy

pytest.importorskip('numba')

SHAPES = [(Sphere(0.1), {}), (Box((0.2, 0.2, 0.2)), {}), (Box((0.3, 0.2, 0.1)), {}),
          (Capsule(0.1, 0.3), {'orientation': (1, 0, 0, 1)}),
          (Cylinder(0.1, 0.2), {}), (Cylinder(0.1, 0.2), {'orientation': (1, 0, 0, 1)})]


def plane(name='plane', **pose):
    return StaticBody(name, Plane(), **pose)


def facing(name, normal, position=(0.0, 0.0, 0.0)):
    """A plane with this normal."""
    turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), normal / np.linalg.norm(normal))
    return plane(name, position=position, orientation=tuple(turn))


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('shape, turn', SHAPES)
@pytest.mark.parametrize('angle, restitution, spin', [(0.0, 0.5, (0.3, 0.2, 0.1)),
                                                      (0.3, 0.0, (0.0, 0.0, 2.0))])
def test_a_plane_is_a_ground(shape, turn, angle, restitution, spin, accuracy):
    """What falls, bounces, slides and turns is where it is on the ground, within 1e-6 m: contact
    points and laws are the same, times of impact are solved to SLOP.
    """
    start = loose(shape, position=(0, 0, 0.3 if restitution else 0.16), velocity=(1, 0, 0),
                  spin=spin, **turn)
    placement, body, ground = inclined(start, plane(), angle)
    on_plane, told = states(scene(placement, [body], restitution=restitution), 1.0, accuracy)
    on_ground, _ = states(scene(placement, ground=ground, restitution=restitution), 1.0, accuracy)
    np.testing.assert_allclose(on_plane[:, 0, :3], on_ground[:, 0, :3], atol=1e-6)
    assert told['energy_excess_J'] < 1e-5


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('shape, turn', [SHAPES[0], SHAPES[1], SHAPES[3]])
def test_a_slope_is_a_level_ground_under_turned_gravity(shape, turn, accuracy):
    angle = 0.4
    start = loose(shape, position=(0, 0, 0.1), velocity=(1, 0.2, 0), **turn)
    placement, body, _ = inclined(start, plane(), angle)
    turn = rotation.from_axis_angle((0.0, 1.0, 0.0), angle)
    placement = dataclasses.replace(placement, velocity=tuple(rotation.rotate(
        turn, np.array(start.velocity))))
    on_slope, _ = states(scene(placement, [body], restitution=0.0), 1.0, accuracy)
    level = dataclasses.replace(
        scene(start, ground=Ground(), restitution=0.0),
        gravity=(G * math.sin(angle), 0.0, -G * math.cos(angle)))
    on_level, _ = states(level, 1.0, accuracy)
    np.testing.assert_allclose(rotation.rotate(turn, on_level[:, 0, :3]), on_slope[:, 0, :3],
                               atol=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_ball_falls_on_a_plane_when_and_where_newton_says(accuracy):
    """It falls 1 m onto a slope of 30 degrees without friction: its velocity is mirrored."""
    normal = np.array((0.5, 0.0, math.sqrt(0.75)))
    centre = 0.1 * normal
    ball = loose(Sphere(0.1), position=(centre[0], 0.0, centre[2] + 1.0))
    rows, _ = states(scene(ball, [facing('slope', normal)], friction=0.0, restitution=1.0), 0.6,
                     accuracy)
    fall = math.sqrt(2 / G)
    velocity = np.array((0.0, 0.0, -G * fall))
    velocity -= 2 * normal * (normal @ velocity)
    rest = 0.6 - fall
    np.testing.assert_allclose(rows[-1, 0, 7:10], velocity - (0, 0, G * rest), atol=1e-8)
    ends = centre + velocity * rest - (0, 0, G / 2 * rest ** 2)
    np.testing.assert_allclose(rows[-1, 0, :3], ends, atol=1e-8)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_ball_in_a_v_rests_on_both_planes(accuracy):
    """Its centre is r / sin(half the opening angle) above the line where they meet, but for what
    closes by less than 0.02 m/s in a step and so may stay in a wall, and for the gap that touches.
    """
    half = math.radians(50)
    walls = [facing(f'wall_{side}', (-side * math.cos(half), 0.0, math.sin(half)))
             for side in (-1, 1)]
    ball = loose(Sphere(0.1), position=(0.2, 0.0, 0.7))
    rows, told = states(scene(ball, walls, friction=0.5, restitution=0.3), 8.0, accuracy)
    setting = resolve_accuracy(accuracy)
    deep = 0.02 * setting.step + setting.touching
    assert rows[-1, 0, 0] == pytest.approx(0.0, abs=deep / (2 * math.cos(half)))
    assert rows[-1, 0, 2] == pytest.approx(0.1 / math.sin(half), abs=deep / math.sin(half) / 2)
    assert told['energy_excess_J'] < 1e-5
    # Every state has it on the sides of both that are not solid.
    for wall in walls:
        assert (rows[:, 0, :3] @ np.array(wall.normal)).min() > 0.1 - 1e-4


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_doll_in_a_corner_of_planes_lies_still_and_gains_nothing(accuracy):
    drop = load_scene('drop')
    doll = dataclasses.replace(drop.dolls[0], position=(0.0, 0.0, 0.9), velocity=(2.0, 1.0, -1.0),
                               spin=(1.0, 3.0, 0.5))
    corner = [facing('floor', (0, 0, 1)), facing('wall', (-1, 0, 0), (0.8, 0, 0)),
              facing('side', (0, -1, 0.2), (0, 0.8, 0))]
    made = dataclasses.replace(drop, ground=None, dolls=(doll,), bodies=tuple(corner))
    with Simulation(made, accuracy=accuracy) as simulation:
        for _ in range(400):
            state = simulation.advance()
        told, contacts = simulation.measures(), simulation.contacts
    assert np.isfinite(state.rows).all()
    assert told['energy_excess_J'] < 0.01 * 9.8 * drop.dolls[0].doll.mass
    assert np.abs(state.linear_velocities).max() < 0.05
    for body in corner:
        depth = [bone.shape.support(rotation.rotate(
            rotation.inverse(turn), -np.array(body.normal)))
            - (place - body.position) @ np.array(body.normal)
            for bone, place, turn in zip(made.bones, state.positions, state.orientations,
                                         strict=True)]
        assert max(depth) < 1e-3, body.name
    assert 0 in contacts.bodies


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_have_planes(engine):
    """What slides down 20 degrees with friction .2 has covered g (sin - mu cos) t^2 / 2, within the
    few percent that their soft contacts are off; and lies on the plane.
    """
    pytest.importorskip({'bullet': 'pybullet'}.get(engine, engine))
    angle = math.radians(20)
    start = loose(Box((0.2, 0.2, 0.2)), position=(0, 0, 0.1))
    placement, body, _ = inclined(start, plane(), angle)
    body = dataclasses.replace(body, friction=0.2)
    rows, _ = states(scene(placement, [body], friction=0.2, restitution=0.0), 1.0, engine=engine)
    way = rows[-1, 0, :3] - placement.position
    wanted = G * (math.sin(angle) - 0.2 * math.cos(angle)) / 2
    assert np.linalg.norm(way) == pytest.approx(wanted, rel=0.05)
    assert rows[-1, 0, :3] @ np.array(body.normal) == pytest.approx(0.1, abs=2e-3)


def test_what_a_plane_is_far_from_has_the_same_bits():
    drop = load_scene('drop')
    far = dataclasses.replace(drop, bodies=(plane(position=(0, 0, -50)),))
    ends = []
    for one in (drop, far):
        with Simulation(one) as simulation:
            for _ in range(80):
                state = simulation.advance()
            ends.append(state.rows.copy())
    np.testing.assert_array_equal(*ends)


def test_a_plane_is_read_and_written(tmp_path):
    path = tmp_path / 'slope.yaml'
    path.write_text("""
dolls: [{doll: doll, position: [0, 0, 0.5]}]
bodies:
  - name: slope
    shape: {plane: {}}
    position: [0, 0, 0.1]
    orientation: [0, 0.1, 0, 1]
    friction: 0.3
""")
    made = load_scene(str(path))
    slope, = made.bodies
    assert slope.shape == Plane() and slope.friction == 0.3
    assert slope.normal == pytest.approx((0.2 / 1.01, 0.0, 0.99 / 1.01))
    save_scene(made, tmp_path / 'again.yaml')
    again = load_scene(str(tmp_path / 'again.yaml'))
    assert again.bodies == made.bodies


@pytest.mark.parametrize('entry, told', [
    ('{plane: {size: [1, 2]}}', 'size'), ('{plane: {}}, mass: 3', 'mass'),
    ('{plane: {}}, follow: exact', 'follow')])
def test_what_a_plane_has_not_is_refused(tmp_path, entry, told):
    path = tmp_path / 'bad.yaml'
    path.write_text(f'dolls: [{{doll: doll}}]\nbodies:\n  - {{name: it, shape: {entry}}}\n')
    with pytest.raises(RagdollError, match=told):
        load_scene(str(path))


def test_volumes_around_planes_and_surfaces_are_found():
    """By simulation_interfaces: a box or sphere above a slope overlaps it or does not."""
    pytest.importorskip('rclpy')
    from ragdoll_ros.ros.simulation_interfaces.bounds import Kind, Volume, bounding_box
    floor, slope = plane(), facing('slope', (0.6, 0.0, 0.8))
    hill = StaticBody('hill', HeightField([[0, 0.5], [0, 0.5]], (2, 2)), position=(0, 0, 1))
    low, high = bounding_box([(hill.shape, hill.pose)])
    assert (*low, *high) == pytest.approx((-1, -1, 1, 1, 1, 1.5))
    assert bounding_box([(floor.shape, floor.pose)])[1].tolist() == [np.inf, np.inf, 0.0]
    for kind, points, found in (
            (Kind.BOX, ((-1, -1, 0.1), (1, 1, 2)), (False, True, True)),
            (Kind.BOX, ((-1, -1, -0.1), (1, 1, 0.9)), (True, True, False)),
            (Kind.SPHERE, ((0, 0, 0.5), (0.45, 0, 0)), (False, True, False)),
            (Kind.SPHERE, ((1, 0, 2), (0.9, 0, 0)), (False, False, True))):
        volume = Volume.of(kind, points)
        assert tuple(volume.overlaps(body.shape, body.pose)
                     for body in (floor, slope, hill)) == found, (kind, points)

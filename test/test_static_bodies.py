"""Static bodies: contacts with them are those with the ground, and follow closed forms."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ragdoll_ros import (
    Bone,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Ground,
    Part,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
    StaticBody,
    load_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import Material

pytest.importorskip('numba')

ACCURACIES = ('draft', 'normal', 'exact')
FLOOR = StaticBody('floor', Box((40.0, 40.0, 1.0)), position=(0.0, 0.0, -0.5))
G = 9.8


def loose(shape, **start):
    """A placement of one bone of 1 kg."""
    return Placement(Ragdoll('body', (Bone('body', shape, 1.0, (0, 0, 0)),)), **start)


def scene(placement, bodies=(), ground=None, **material):
    material = Material(**{'friction': 0.5, 'restitution': 0.5} | material)
    return Scene('world', (placement,), ground, material, bodies=tuple(bodies))


def states(scene, seconds, accuracy='normal', engine='auto'):
    """States (t, n, 13) after each tick, and the measures at the end."""
    with Simulation(scene, accuracy=accuracy, engine=engine) as simulation:
        rows = np.array([simulation.advance().rows.copy()
                         for _ in range(round(seconds / scene.step))])
        return rows, simulation.measures()


def inclined(placement, body, angle):
    """Both turned by ``angle`` about the world's y axis."""
    turn = rotation.from_axis_angle((0.0, 1.0, 0.0), angle)

    def turned(one):
        return dataclasses.replace(
            one, position=tuple(rotation.rotate(turn, np.array(one.position))),
            orientation=tuple(rotation.multiply(turn, np.array(one.orientation))))
    return turned(placement), turned(body), Ground(tuple(rotation.rotate(turn, np.array(
        (0.0, 0.0, 1.0)))))


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('shape, start', [
    (Sphere(0.1), {'position': (0, 0, 0.5)}),
    (Sphere(0.1), {'position': (0, 0, 0.1), 'velocity': (1, 0, 0)}),
    (Box((0.2, 0.2, 0.2)), {'position': (0, 0, 0.1), 'velocity': (1, 0, 0)}),
    (Capsule(0.1, 0.3), {'position': (0, 0, 0.1), 'velocity': (1, 0, 0),
                         'orientation': (1, 0, 0, 1)})])
@pytest.mark.parametrize('angle, restitution', [(0.0, 0.5), (0.6, 0.0)])
def test_a_box_as_a_floor_is_a_ground(shape, start, angle, restitution, accuracy):
    """What bounces, rolls and slides ends within 1e-8 m of where it does on a plane: gaps are
    solved to SLOP (on a slope the last of ever smaller bounces are told apart by rounding).
    """
    placement, floor, ground = inclined(loose(shape, **start), FLOOR, angle)
    law = {'restitution': restitution}
    on_floor, _ = states(scene(placement, [floor], **law), 1.0, accuracy)
    on_ground, _ = states(scene(placement, ground=ground, **law), 1.0, accuracy)
    np.testing.assert_allclose(on_floor[:, 0, :3], on_ground[:, 0, :3], atol=1e-8)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('angle', [0.0, 0.6])
@pytest.mark.parametrize('shape, tolerance', [(Sphere(0.1), 1e-6), (Box((0.2, 0.2, 0.2)), 1e-5)])
def test_tiles_of_equal_height_are_one_floor(shape, tolerance, angle, accuracy):
    """What rolls or slides at 3 m/s over ten of their edges does not feel them. A box is within the
    bound of its step, since more points than on a plane share its weight.
    """
    start = loose(shape, position=(0, 0.05, 0.1), velocity=(3, 0, 0))
    turned = [inclined(start, StaticBody(f'tile_{k}', Box((0.3, 4.0, 1.0)),
                                         position=(0.3 * k - 0.6, 0.0, -0.5)), angle)
              for k in range(40)]
    placement, _, ground = turned[0]
    on_tiles, _ = states(scene(placement, [tile for _, tile, _ in turned], restitution=0.0), 1.0,
                         accuracy)
    on_ground, _ = states(scene(placement, ground=ground, restitution=0.0), 1.0, accuracy)
    np.testing.assert_allclose(on_tiles[:, 0, :3], on_ground[:, 0, :3], atol=tolerance)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('rise, crossed', [(0.0, True), (0.02, False)])
def test_a_kerb_on_a_floor_of_tiles_is_an_obstacle(rise, crossed, accuracy):
    """A box that slides passes the edge of a tile of equal height, and none that stands up."""
    start = loose(Box((0.2, 0.2, 0.2)), position=(0, 0, 0.1), velocity=(3, 0, 0))
    tiles = [StaticBody(f'tile_{k}', Box((0.4, 1.0, 1.0)),
                        position=(0.4 * k, 0.0, -0.5 + rise * (k == 1))) for k in range(3)]
    rows, _ = states(scene(start, tiles, restitution=0.0), 0.2, accuracy)
    assert (rows[-1, 0, 0] > 0.3) == crossed


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_the_corner_of_two_tiles_stops_what_comes_from_their_side(accuracy):
    """A ball that meets the end of their common edge, level with it, is on neither of them."""
    start = loose(Sphere(0.1), position=(0.2, -1.0, 0.0), velocity=(0, 5, 0))
    tiles = [StaticBody(f'tile_{k}', Box((0.4, 1.0, 1.0)), position=(0.4 * k, 0.0, -0.5))
             for k in range(2)]
    placed = scene(start, tiles, restitution=0.0)
    rows, _ = states(dataclasses.replace(placed, gravity=(0.0, 0.0, 0.0)), 0.3, accuracy)
    assert rows[:, 0, 1].max() < -0.6 + 1e-6


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_ball_leaves_a_sphere_where_newton_says(accuracy):
    """Without friction it leaves at cos(angle) = 2/3 of the top, if it starts there at rest; with
    u = v0^2 / g R at (2 + u) / 3.
    """
    radius, own, speed = 1.0, 0.1, 0.5
    distance = radius + own
    placement = loose(Sphere(own), position=(0, 0, distance), velocity=(speed, 0, 0))
    rows, measures = states(scene(placement, [StaticBody('dome', Sphere(radius))], friction=0.0,
                                  restitution=0.0), 1.2, accuracy)
    place = rows[:, 0, :3]
    touches = np.linalg.norm(place, axis=1) < distance + 1e-6
    cosine = (2 + speed ** 2 / (G * distance)) / 3
    # v^2 = g R cos; the velocity then decides where it passes the height of the centre.
    leave = rows[~touches][0, 0]
    assert np.nonzero(~touches)[0][0] > 20
    energy = 0.5 * leave[7:10] @ leave[7:10] + G * leave[2]
    assert energy == pytest.approx(0.5 * speed ** 2 + G * distance, rel=1e-3)
    last = place[touches][-1]
    assert last[2] / distance == pytest.approx(cosine, abs=0.06), 'within the tick of 10 ms'
    assert measures['energy_excess_J'] < 1e-6


def test_restitution_and_friction_are_those_of_the_pair():
    """Geometric means, as between bones: e = sqrt(.81 .25), mu = sqrt(.4 .1)."""
    floor = dataclasses.replace(FLOOR, restitution=0.25, friction=0.1)
    rows, _ = states(scene(loose(Sphere(0.1), position=(0, 0, 1.1)), [floor], restitution=0.81),
                     0.55)
    assert rows[50:, 0, 9].max() == pytest.approx(
        0.45 * math.sqrt(2 * G) - G * (0.51 - math.sqrt(2 / G)), rel=1e-6)
    sliding, _ = states(scene(loose(Box((0.2, 0.2, 0.2)), position=(0, 0, 0.1),
                                    velocity=(2, 0, 0)), [floor], friction=0.4), 0.5)
    assert sliding[-1, 0, 7] == pytest.approx(2 - 0.2 * G * 0.5, rel=1e-4)


@pytest.mark.parametrize('shape', [Sphere(0.03), Box((0.06, 0.04, 0.05)), Capsule(0.02, 0.06),
                                   Cylinder(0.03, 0.05)])
@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_nothing_passes_a_thin_board_at_20_m_s(shape, accuracy):
    board = StaticBody('board', Box((3.0, 3.0, 0.01)))
    for seed in range(5):
        rng = np.random.default_rng(seed)
        start = {'position': (*rng.uniform(-0.5, 0.5, 2), 1.0),
                 'velocity': (*rng.normal(size=2), -20.0), 'spin': tuple(30 * rng.normal(size=3))}
        rows, measures = states(scene(loose(shape, **start), [board]), 0.3, accuracy)
        assert rows[:, 0, 2].min() > 0.005
        assert measures['energy_excess_J'] < 1e-5 * 200


def test_a_board_lies_on_a_cylinder_until_it_is_tilted_too_far():
    """A board of half thickness h on a cylinder of radius R, with friction: stable if R > h."""
    for radius, stays in ((0.3, True), (0.05, False)):
        board = loose(Box((1.0, 0.4, 0.2)), position=(0, 0, radius + 0.1 + 1e-9),
                      spin=(0, 1e-2, 0))
        log = StaticBody('log', Cylinder(radius, 1.0), orientation=(1, 0, 0, 1))
        rows, _ = states(scene(board, [log], friction=10.0, restitution=0.0), 3.0)
        tilt = np.abs(rotation.matrix(rows[:, 0, 3:7])[:, 2, 2])
        assert (tilt.min() > math.cos(0.05)) == stays


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_ball_between_two_walls_loses_e_squared_at_each(accuracy):
    walls = [StaticBody(f'wall_{side}', Box((0.2, 2.0, 2.0)), position=(side * 1.0, 0.0, 0.0))
             for side in (-1, 1)]
    placement = loose(Sphere(0.1), velocity=(3.0, 0.0, 0.0))
    free = dataclasses.replace(scene(placement, walls, restitution=0.8), gravity=(0, 0, 0))
    rows, _ = states(free, 2.0, accuracy)
    # 0.8 m to the first wall, 1.6 m from one to the next.
    time, speed, side = 0.8 / 3, 3.0, 1.0
    while time + 1.6 / (0.8 * speed) < 2.0:
        speed *= 0.8
        side = -side
        time += 1.6 / speed
    speed, side = speed * 0.8, -side
    # Impacts miss their velocity by IMPACT_COMPLIANCE, 1e-10 of it, two of 3 m/s each.
    assert rows[-1, 0, 7] == pytest.approx(side * speed, abs=1e-8)
    assert rows[-1, 0, 0] == pytest.approx(-side * 0.8 + side * speed * (2.0 - time), abs=1e-8)


def test_a_rocking_box_is_not_hit_again_and_again_by_one_touch():
    """A corner that penetrates by what flight allows was a new impact at once, 200 times a tick."""
    for seed in range(6):
        spin = tuple(3 * np.random.default_rng(seed).normal(size=3))
        start = loose(Box((0.2, 0.3, 0.1)), position=(0, 0, 0.3), velocity=(1, 0, -2), spin=spin)
        weak = dataclasses.replace(scene(start, [FLOOR]), gravity=(0, 0, -1e-4))
        _, measures = states(weak, 0.6)
        assert measures['impacts'] < 12


@pytest.mark.parametrize('count', [1, 2, 3, 5, 8, 12])
@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_dolls_over_rubble_gain_no_energy_and_do_not_sink(count, accuracy):
    rng = np.random.default_rng(count)
    stones = [StaticBody(f'stone_{k}', Box(tuple(rng.uniform(0.1, 0.5, 3))),
                         position=(*rng.uniform(-2, 4, 2), 0.1),
                         orientation=tuple(rng.normal(size=4))) for k in range(150)]
    drop = load_scene('drop')
    placements = [dataclasses.replace(drop.dolls[0], name=f'doll_{k}',
                                      position=(1.6 * (k % 4) - 1, 1.6 * (k // 4) - 1, 0.5),
                                      spin=tuple(rng.normal(size=3))) for k in range(count)]
    made = dataclasses.replace(drop, dolls=tuple(placements), bodies=tuple(stones))
    with Simulation(made, accuracy=accuracy) as simulation:
        for _ in range(60):
            state = simulation.advance()
            assert np.isfinite(state.rows).all()
            scale = 50 * 9.8 * count
            assert simulation.measures()['energy_excess_J'] < 1e-5 * scale
            assert simulation.contacts.depths.max(initial=0.0) < 5e-3
        assert simulation.measures()['impacts']


def test_a_doll_on_stairs_has_the_same_bits_alone_and_beside_others():
    stairs = load_scene('stairs')
    far = dataclasses.replace(stairs.dolls[0], name='far', position=(-30.0, 0.0, 0.5))
    alone, _ = states(stairs, 1.5)
    both, _ = states(dataclasses.replace(stairs, dolls=(*stairs.dolls, far)), 1.5)
    assert np.array_equal(alone, both[:, :alone.shape[1]])


def test_a_run_on_stairs_repeats_to_the_bit_after_a_reset():
    with Simulation(load_scene('stairs'), accuracy='draft') as simulation:
        runs = []
        for _ in range(2):
            runs.append(np.array([simulation.advance().rows.copy() for _ in range(150)]))
            simulation.reset()
    assert np.array_equal(*runs)


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_have_the_bodies_too(engine):
    pytest.importorskip(engine.replace('bullet', 'pybullet'))
    table = StaticBody('table', Compound((
        Part(Box((1.0, 1.0, 0.1))), Part(Cylinder(0.05, 0.7), position=(0.0, 0.0, -0.4)))),
        position=(0.0, 0.0, 0.75))
    rows, _ = states(scene(loose(Box((0.2, 0.2, 0.2)), position=(0, 0, 0.95)), [table], Ground(),
                           restitution=0.0), 2.0, engine=engine)
    assert rows[-1, 0, 2] == pytest.approx(0.9, abs=2e-3), 'it lies on the table'


def test_far_bodies_cost_no_pairs():
    """Of 10 000 stones those that a doll may touch are in its cluster."""
    rng = np.random.default_rng(1)
    places = rng.uniform(-100, 100, (10_000, 2))
    places = places[np.abs(places).max(axis=1) > 3]
    stones = tuple(StaticBody(f'stone_{k}', Box((0.2, 0.2, 0.2)), position=(x, y, 0.1))
                   for k, (x, y) in enumerate(places))
    drop = load_scene('drop')
    with Simulation(dataclasses.replace(drop, bodies=stones)) as simulation, \
            Simulation(drop) as without:
        for _ in range(100):
            state, expected = simulation.advance(), without.advance()
        assert np.array_equal(state.rows, expected.rows)


def test_a_scene_with_bodies_is_written_and_read(tmp_path):
    from ragdoll_ros import save_scene
    stairs = load_scene('stairs')
    assert [body.name for body in stairs.bodies[:3]] == ['landing', 'stair_1', 'stair_2']
    assert stairs.bodies[10].position == pytest.approx((0.145 + 9 * 0.29, 0, 1.615 - 9 * 0.17))
    save_scene(stairs, tmp_path / 'copy.yaml')
    assert load_scene(str(tmp_path / 'copy.yaml')) == stairs


@pytest.mark.parametrize('entry, told', [
    ('{name: a, shape: {box: {size: [0, 1, 1]}}}', 'bodies[0].shape.box.size[0]'),
    ('{name: doll, shape: {sphere: {radius: 1}}}', 'bodies[0].name'),
    ('{name: a}', 'exactly one of shape, shapes'),
    ('{name: a, shape: {sphere: {radius: 1}}, orientation: [0, 0, 0, 0]}',
     'bodies[0].orientation'),
    ('{name: a, shape: {sphere: {radius: 1}}, repeat: {count: 100000}}, '
     '{name: b, shape: {sphere: {radius: 1}}}', 'at most 100000 bodies')])
def test_what_is_wrong_with_a_body_is_named(tmp_path, entry, told):
    file = tmp_path / 'scene.yaml'
    file.write_text(f'dolls: [{{doll: doll}}]\nbodies: [{entry}]\n')
    with pytest.raises(ValueError) as error:
        load_scene(str(file))
    assert told in str(error.value)


@pytest.mark.parametrize(('dolls', 'bodies', 'place'), [
    ('{doll: doll, repeat: {count: 3}}, {doll: doll, name: a}, {doll: doll, name: a}', '',
     'dolls[2].name'),
    ('{doll: doll, repeat: {count: 3}}', '{name: a, shape: {box: {size: [1, 1, 1]}}, repeat: '
     '{count: 4}}, {name: b, shape: {sphere: {radius: 1}}}, {name: a_3, shape: {sphere: {radius: '
     '1}}}', 'bodies[2].name'),
    ('{doll: doll, repeat: {count: 3}}', '{name: a, mass: 1, shape: {sphere: {radius: 1}}, repeat: '
     '{count: 2}}, {name: doll_2, mass: 1, shape: {sphere: {radius: 1}}}', 'bodies[1].name')])
def test_a_name_in_use_is_told_at_its_entry(tmp_path, dolls, bodies, place):
    file = tmp_path / 'scene.yaml'
    file.write_text(f'dolls: [{dolls}]\nbodies: [{bodies}]\n')
    with pytest.raises(ValueError, match='a unique name') as error:
        load_scene(str(file))
    assert f'{place}:' in str(error.value)

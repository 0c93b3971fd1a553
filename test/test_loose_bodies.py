"""Bodies of a scene that have a mass: dolls of one bone that rest, slide and fall over."""
from __future__ import annotations

import math

import numpy as np
import pytest

from ragdoll_ros import Simulation, load_scene, save_scene
from ragdoll_ros.model import rotation

pytest.importorskip('numba')

G = 9.8
TABLE = '{name: table, shape: {box: {size: [4, 4, 0.1]}}, position: [0, 0, 0.7], friction: 0.9}'
BOX = 'shape: {box: {size: [0.2, 0.3, 0.1]}}, mass: 2, position: [0, 0, 0.8]'
FAR = '{doll: doll, position: [30, 0, 1]}'


def scene(tmp_path, *bodies, doll=FAR, material='{restitution: 0}'):
    file = tmp_path / 'scene.yaml'
    file.write_text(f'ground: {{}}\nmaterial: {material}\ndolls: [{doll}]\n'
                    f'bodies: [{", ".join(bodies)}]\n')
    return load_scene(str(file))


def test_a_loose_body_is_a_doll_of_one_bone(tmp_path):
    made = scene(tmp_path, TABLE, '{name: box, friction: 0.4, color: [1, 0, 0, 1], '
                 f'velocity: [1, 0, 0], spin: [0, 0, 2], {BOX}, '
                 'repeat: {count: 2, shift: [1, 0, 0]}}')
    assert [body.name for body in made.bodies] == ['table']
    assert made.bone_names[-2:] == ('box_1/box', 'box_2/box')
    first, second = made.dolls[1:]
    bone, = first.doll.bones
    assert (bone.mass, bone.friction, bone.color) == (2.0, 0.4, (1, 0, 0, 1))
    assert bone.inertia == pytest.approx(2 / 12 * np.array((0.1, 0.05, 0.13)))
    assert (first.velocity, first.spin, second.position) == ((1, 0, 0), (0, 0, 2), (1, 0, 0.8))
    assert first.doll is second.doll
    save_scene(made, tmp_path / 'copy.yaml')
    assert load_scene(str(tmp_path / 'copy.yaml')) == made


def test_the_origin_of_a_loose_body_may_be_anywhere(tmp_path):
    """A chair by its seat: its centre of mass is that of seat and back, by their volumes."""
    made = scene(tmp_path, '{name: chair, mass: 5, position: [0, 3, 0.45], shapes: ['
                 '{box: {size: [0.4, 0.4, 0.04]}}, '
                 '{box: {size: [0.04, 0.4, 0.5]}, position: [-0.18, 0, 0.27]}]}')
    with Simulation(made) as simulation:
        state = simulation.state
    share = 0.5 / 0.9
    assert state.positions[-1] == pytest.approx((-0.18 * share, 3, 0.45 + 0.27 * share))


def test_a_loose_box_rests_on_a_table_and_sleeps(tmp_path):
    """Its centre half its height above the table's top, 0.75 m; it falls 0.05 m before."""
    made = scene(tmp_path, TABLE, '{name: box, ' + BOX.replace('0.8]', '0.85]') + '}', doll=FAR)
    with Simulation(made) as simulation:
        state = simulation.run(150)[-1, -1]
        assert simulation.kinetic_energies[-1] == 0
        found = simulation.contacts
    # Contacts are solved to 10 um.
    assert state[:3] == pytest.approx((0, 0, 0.8), abs=1e-5)
    own = found.a == len(made.bones) - 1
    assert set(found.bodies[own]) == {0}
    assert found.wrenches[own, 2].sum() == pytest.approx(2 * G, rel=1e-4)


def test_a_loose_box_slides_as_coulomb_says(tmp_path):
    """With mu = sqrt(.4 .9) = .6 it stops after v^2 / 2 mu g, and meanwhile slows by mu g."""
    made = scene(tmp_path, TABLE, f'{{name: box, friction: 0.4, velocity: [3, 0, 0], {BOX}}}')
    with Simulation(made) as simulation:
        rows = simulation.run(80)[:, -1]
    assert rows[19, 7] == pytest.approx(3 - 0.6 * G * 0.2, rel=1e-6)
    # Contact steps are of order 2; the box stops within one.
    assert rows[-1, 0] == pytest.approx(3 ** 2 / (2 * 0.6 * G), rel=1e-4)
    assert rows[-1, 7] == pytest.approx(0, abs=1e-6)


def test_a_doll_knocks_a_loose_box_over_and_momentum_stays(tmp_path):
    """On a ground without friction nothing else acts along x and y. Once the doll lies on it as
    well, its momentum is that of a scheme of order 2.
    """
    made = scene(tmp_path, '{name: box, shape: {box: {size: [0.2, 0.5, 1]}}, mass: 8, '
                 'position: [0.5, 0, 0.5]}', doll='{doll: doll, position: [0, 0, 0.02], '
                 'velocity: [5, 0, 0]}', material='{friction: 0, restitution: 0}')
    masses = np.array([bone.mass for bone in made.bones])
    with Simulation(made) as simulation:
        rows = simulation.run(100)
    momenta, start = np.einsum('b,tbx->tx', masses, rows[:, :, 7:9]), 5 * masses[:-1].sum()
    assert momenta[:30] == pytest.approx(np.tile((start, 0), (30, 1)), abs=1e-6)
    assert momenta == pytest.approx(np.tile((start, 0), (100, 1)), abs=1e-3 * start)
    assert rows[29, -1, 7] > 1
    tilt = np.arccos(rotation.matrix(rows[:, -1, 3:7])[:, 2, 2])
    assert tilt[29] > math.radians(45) and tilt[-1] == pytest.approx(math.pi / 2, abs=1e-4)


@pytest.mark.parametrize('entry, told', [
    ('{name: a, shape: {sphere: {radius: 1}}, mass: -1}', 'bodies[0].mass: NotPositive: -1'),
    ('{name: a, shape: {sphere: {radius: 1}}, velocity: [1, 0, 0]}',
     'bodies[0].velocity: WrongForm: [1, 0, 0]; expected a mass as well'),
    ('{name: a, shape: {sphere: {radius: 0}}, mass: 1}', 'bodies[0].shape.sphere.radius'),
    ('{name: world, shape: {sphere: {radius: 1}}, mass: 1}', 'bodies[0].name: DuplicateName'),
    ('{name: a, shape: {sphere: {radius: 1}}, mass: 1, orientation: [0, 0, 0, 0]}',
     'bodies[0].orientation: NotUnit'),
    ('{name: a, shape: {sphere: {radius: 1}}, mass: 1, repeat: {count: 1000}}',
     'bodies: OutOfRange: 1001; expected at most 1000 dolls and loose bodies')])
def test_what_is_wrong_with_a_loose_body_is_named(tmp_path, entry, told):
    with pytest.raises(ValueError) as error:
        scene(tmp_path, entry)
    assert told in str(error.value)


def test_the_bench_of_the_scene_table_is_knocked_over():
    """It lies on its side, 0.3 m wide, and on a limb, as at steps of 0.1 ms too."""
    with Simulation(load_scene('table')) as simulation:
        row = simulation.run(200)[-1, -1]
    assert abs(rotation.matrix(row[3:7])[2, 0]) > 0.99
    assert 0.15 - 1e-4 < row[2] < 0.2

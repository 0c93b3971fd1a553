"""A mat on the ground: its stiffness is in series with the tissue in the contact law of impacts."""
import dataclasses
import math

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp
from test_contact_pulse import ball

from ragdoll_ros import load_limits, load_scene, save_scene
from ragdoll_ros.falls.recipe import build_recipe, load_recipe
from ragdoll_ros.falls.simulate import simulate
from ragdoll_ros.falls.start import start_of
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.files.scene import build_scene
from ragdoll_ros.model.errors import NotPositive
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.model.static_body import StaticBody
from ragdoll_ros.physics.sensors.contact_pulse import PulseLaw
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.settings_panel import sloping

MASS, TISSUE, MAT, SPEED = 5.0, 25e3, 60e3, 2.0
"""kg; N/m, of the pelvis by the limits, and of a mat; m/s."""


def faint():
    """Data of the recipe's file."""
    return yaml.safe_load((config_folder() / 'recipes' / 'faint.yaml').read_text())


def ball_on(ground=None, bodies=(), speed=SPEED):
    """A ball of the pelvis' tissue that is about to land."""
    return Scene('ball', (Placement(ball(), position=(0, 0, 0.1001), velocity=(0, 0, -speed)),),
                 ground, Material(0.5, 0.0, 0.0), step=1e-3, bodies=bodies)


def landing(scene, ticks=3):
    """The first impact, its pulse's duration by the law, and the states."""
    limits, hits, rows = load_limits(), [], []
    with Simulation(scene, accuracy='exact', engine='rigid') as simulation:
        simulation.record_impacts(limits)
        for _ in range(ticks):
            rows.append(simulation.advance().rows)
            hits += simulation.impacts
    return hits[0], PulseLaw(scene, limits).duration(hits[0]), np.array(rows)


def two_springs(mass, speed, tissue, mat, plate=1e-6):
    """Peak force on a mass, N, and the time it is pressed, s: it lands on the tissue's spring, on a
    ``plate``, kg, on the mat's, integrated by scipy. A damper calms the plate, critically.
    """
    damper = 2 * math.sqrt((tissue + mat) * plate)

    def rates(_, y):
        (x, u), (v, w) = y[:2], y[2:]
        force = tissue * (u - x)
        return [v, w, force / mass, (-mat * u - damper * w - force) / plate]

    def parts(_, y):
        return y[1] - y[0]
    parts.terminal, parts.direction = True, -1
    course = solve_ivp(rates, (0, 1), [-1e-9, 0, -speed, 0], 'Radau', events=parts, rtol=1e-8,
                       atol=1e-10, max_step=1e-4)
    return tissue * (course.y[1] - course.y[0]).max(), course.t_events[0][0]


@pytest.mark.parametrize('mat', [5e3, MAT, 1e6])
def test_a_mass_on_two_springs_in_series(mat):
    hit, pulse, _ = landing(ball_on(Ground(stiffness=mat)))
    series = 1 / (1 / TISSUE + 1 / mat)
    assert hit.peak_force == pytest.approx(hit.speed * math.sqrt(MASS * series), rel=1e-9)
    assert hit.duration == pytest.approx(math.pi * math.sqrt(MASS / series), rel=1e-9)
    assert pulse == pytest.approx(hit.duration / 2, rel=1e-6), 'e = 0'
    peak, duration = two_springs(MASS, hit.speed, TISSUE, mat)
    assert hit.peak_force == pytest.approx(peak, rel=0.005)
    assert hit.duration == pytest.approx(duration, rel=0.005)


def test_motions_do_not_depend_on_it_and_a_rigid_ground_has_the_same_bits():
    (plain, pulse, rows), (hard, same, _), (soft, longer, others) = (
        landing(ball_on(ground), 60) for ground in (
            Ground(), Ground(stiffness=math.inf), Ground(stiffness=MAT)))
    assert (rows == others).all()
    assert (plain, pulse) == (hard, same)
    assert longer > pulse
    assert soft == dataclasses.replace(plain, stiffness=soft.stiffness)


def test_a_body_may_have_its_own():
    cushion = StaticBody('cushion', Box((1, 1, 0.2)), (0, 0, -0.1), stiffness=MAT)
    hit, pulse, _ = landing(ball_on(bodies=(cushion,)))
    other, as_long, _ = landing(ball_on(Ground(stiffness=MAT)))
    assert hit.against == 'cushion'
    assert (hit.stiffness, pulse) == pytest.approx((other.stiffness, as_long))


def test_the_head_injury_criterion_is_less_on_a_mat():
    hard, soft = (landing(dataclasses.replace(ball_on(ground), dolls=(Placement(
        ball('head', 4.4), position=(0, 0, 0.1001), velocity=(0, 0, -SPEED)),)))[0]
        for ground in (Ground(), Ground(stiffness=MAT)))
    # HIC of a half-sine goes with peak^2.5 duration, so with k^3/4.
    assert soft.head_injury(1.0) / hard.head_injury(1.0) == pytest.approx(
        (soft.stiffness / hard.stiffness) ** 0.75)


@pytest.mark.parametrize('part', [Ground, lambda **keys: StaticBody('mat', Box((1, 1, 1)), **keys)])
@pytest.mark.parametrize('stiffness', [0, -1.0, math.nan])
def test_what_is_no_stiffness(part, stiffness):
    with pytest.raises(NotPositive, match='stiffness'):
        part(stiffness=stiffness)


def test_files_keep_it(tmp_path):
    scene = ball_on(Ground((0, 0.6, 0.8), 0.1, MAT),
                    (StaticBody('mat', Box((1, 1, 0.2)), stiffness=20e3),))
    save_scene(scene, tmp_path / 'mats.yaml')
    read = load_scene(tmp_path / 'mats.yaml')
    assert (read.ground, read.bodies) == (scene.ground, scene.bodies)
    assert sloping(scene.ground, scene, 10.0).stiffness == MAT
    loose = {'name': 'ball', 'shape': {'sphere': {'radius': 0.1}}, 'mass': 1, 'stiffness': 1e4}
    _, found = build_scene({'dolls': [{'doll': 'doll'}], 'bodies': [loose]},
                           tmp_path / 'loose.yaml')
    assert [error.path for error in found] == ['bodies[0].stiffness']


def test_the_same_falls_on_a_mat(tmp_path):
    """Fall 2 of faint, whose pelvis lands first: the same motion, softer blows."""
    data = faint()
    plain, _ = build_recipe(data, tmp_path / 'faint.yaml')
    soft, found = build_recipe({**data, 'ground': {**data['ground'], 'stiffness': MAT}},
                               tmp_path / 'faint.yaml')
    assert not found
    hard, mat = (simulate(recipe, start_of(recipe, 2)) for recipe in (plain, soft))
    assert plain.digest != soft.digest
    assert hard.drawn == mat.drawn
    assert (hard.states == mat.states).all()
    first = np.flatnonzero((mat.pulses != hard.pulses).any(axis=1))[0]
    assert mat.pulses[first, 1] > hard.pulses[first, 1]
    blows = [(fall.worst_impacts.by_region['pelvis'].peak_force) for fall in (hard, mat)]
    assert blows[1] == pytest.approx(blows[0] * math.sqrt(MAT / (MAT + TISSUE)))


def test_a_stiffness_of_a_recipe_is_a_number_above_zero(tmp_path):
    data = faint()
    data['ground']['stiffness'] = 0
    _, found = build_recipe(data, tmp_path / 'faint.yaml')
    assert [error.path for error in found] == ['ground.stiffness']
    assert load_recipe('faint').stiffness == math.inf

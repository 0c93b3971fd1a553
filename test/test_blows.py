"""Impacts in figures against closed forms, an integrated spring, and MuJoCo's mass matrix."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import yaml
from loose_bodies import WEIGHTLESS, ball, box

from ragdoll_ros import (
    Bone,
    Box,
    Follow,
    Ground,
    Joint,
    Placement,
    Push,
    Ragdoll,
    Scene,
    Simulation,
    StaticBody,
    load_doll,
    load_scene,
)
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.files.limits import load_limits
from ragdoll_ros.model import rotation
from ragdoll_ros.model.biomechanical_limits import BiomechanicalLimits, BodyRegion
from ragdoll_ros.model.errors import WrongForm
from ragdoll_ros.model.scene import Material
from ragdoll_ros.physics.sensors.head_injury import (
    HIC15,
    half_sine_head_injury,
    head_injury_criterion,
)

pytest.importorskip('numba')

STIFFNESS, LIMIT = 40e3, 300.0
HARD = BiomechanicalLimits('of this test', {
    'hit': BodyRegion(150, LIMIT, STIFFNESS, ('ball', 'weight', 'bar'), head=True)})
DEAD = Material(restitution=0)


def first_impacts(scene, limits=HARD, ticks=300):
    """Impacts of the first tick that has any."""
    with Simulation(scene) as simulation:
        simulation.record_impacts(limits)
        for _ in range(ticks):
            simulation.advance()
            if simulation.impacts:
                return simulation.impacts
    raise AssertionError('nothing met')


def spring_pulse(masses, speed, stiffness=STIFFNESS, steps=20000):
    """Peak force, duration and pulse (t,) N of two masses (the second may be infinite) that meet
    with a spring between them, by leapfrog from touch to parting.
    """
    inverse = sum(1 / mass for mass in masses)
    h = 4 / math.sqrt(stiffness * inverse) / steps
    depth, rate, forces = 0.0, speed + 0.0, [0.0]
    while True:
        rate -= h / 2 * stiffness * depth * inverse
        depth += h * rate
        rate -= h / 2 * stiffness * depth * inverse
        if depth <= 0:
            return max(forces), len(forces) * h, np.array([*forces, 0.0]), 1 / h
        forces.append(stiffness * depth)


def plate(held):
    """A plate whose top is z = 0: static, or loose with 5 kg."""
    if held:
        return (), (StaticBody('plate', Box((0.5, 0.5, 0.02)), (0, 0, -0.01)),)
    return (Placement(box((0.5, 0.5, 0.02), 5.0, 'plate'), 'plate', (0, 0, -0.01)),), ()


@pytest.mark.parametrize('restitution', [0.0, 0.6])
@pytest.mark.parametrize('held', [True, False])
def test_a_ball_on_a_plate(held, restitution):
    """2 kg at 3 m/s: impulse (1 + e) mu v, at the time that the gap takes."""
    dolls, bodies = plate(held)
    scene = Scene('plate', (Placement(ball(mass=2.0), 'thrown', (0, 0, 0.25), velocity=(0, 0, -3)),
                            *dolls), None, Material(restitution=restitution), gravity=WEIGHTLESS,
                  bodies=bodies)
    masses = (2.0, math.inf) if held else (2.0, 5.0)
    mu = 1 / sum(1 / mass for mass in masses)
    found = first_impacts(scene)
    hit = found[0]
    assert (len(found), hit.doll, hit.region) == (1 if held else 2, 'thrown', 'hit')
    assert hit.bone == 'ball' if held else hit.bone == 'thrown/ball'
    assert hit.against == 'plate' if held else hit.against == 'plate/plate'
    assert hit.time == pytest.approx(1e9 * 0.15 / 3, abs=1e3)  # of 1e-6 m, see TOUCHING
    assert hit.point == pytest.approx((0, 0, 0), abs=1e-6)
    assert hit.normal == pytest.approx((0, 0, 1), abs=1e-9)
    assert (hit.speed, hit.effective_mass) == pytest.approx((3, mu), rel=1e-8)
    assert hit.impulse == pytest.approx((1 + restitution) * mu * 3, rel=1e-6)
    assert hit.approach_energy == pytest.approx(mu * 9 / 2, rel=1e-8)
    assert hit.lost_energy == pytest.approx((1 - restitution ** 2) * mu * 9 / 2, rel=1e-6)
    peak, duration, forces, rate = spring_pulse(masses, 3.0)
    assert (hit.peak_force, hit.duration, hit.ratio) == pytest.approx(
        (peak, duration, peak / LIMIT), rel=1e-3)
    assert hit.peak_acceleration == pytest.approx(peak / 2.0, rel=1e-3)
    assert hit.head_injury(HIC15) == pytest.approx(
        head_injury_criterion(forces / 2.0, rate), rel=1e-3)
    if not held:
        other = found[1]
        assert (other.bone, other.against, other.region) == ('plate/plate', 'thrown/ball', '')
        assert other.normal == pytest.approx((0, 0, -1), abs=1e-9)
        assert other.impulse == hit.impulse and math.isnan(other.peak_force)


def test_a_pendulum_against_a_wall():
    """A rod on a pivot of 1e6 kg that swings at 2 rad/s: mu is its inertia over the square of the
    lever arm, m (l^2 / 3) / r^2 with what the weight at its end adds.
    """
    length, mass, rate = 0.6, 1.5, 2.0
    pivot = Bone('pivot', Box((0.02, 0.02, 0.02)), 1e6, (0, 0, 0))
    rod = Bone('bar', Box((0.02, 0.02, length)), mass, (0, 0, -length / 2 - 0.02))
    doll = Ragdoll('pendulum', (pivot, rod),
                   (Joint('pivot', 'bar', 'hinge', (0, 0, -0.02), ((0.0, 1.0, 0.0),),
                          ((-3.0, 3.0),)),))
    arm = 0.5
    wall = StaticBody('wall', Box((0.1, 0.1, 0.02)), (-0.16, 0, -0.02 - arm))
    scene = Scene('pendulum', (Placement(doll, 'doll', rates={'bar': rate}),), None, DEAD,
                  gravity=WEIGHTLESS, bodies=(wall,))
    hit, *_ = first_impacts(scene)
    r = -hit.point[2] - 0.02
    x = hit.point[0]
    assert hit.against == 'wall'
    inertia = mass * (length ** 2 / 3 + (0.02 ** 2) / 12)
    # of the normal's line from the pivot
    lever = abs(hit.normal[0] * r + hit.normal[2] * x)
    mu = inertia / lever ** 2
    assert hit.effective_mass == pytest.approx(mu, rel=1e-4)  # the pivot gives way by 1e-6
    assert hit.speed == pytest.approx(rate * lever, rel=1e-4)
    assert hit.impulse == pytest.approx(mu * rate * lever, rel=0.01)
    peak, duration, *_ = spring_pulse((mu, math.inf), rate * lever)
    assert (hit.peak_force, hit.duration) == pytest.approx((peak, duration), rel=1e-3)


def test_two_bars_end_to_end():
    """Whole faces meet: one impact each, at their middle, with springs in series."""
    masses = 2.0, 3.0
    bars = [Placement(box((0.6, 0.05, 0.05), mass, 'bar'), f'bar_{k}', (0.65 * k, 0, 0),
                      velocity=(2.0 * (1 - k), 0, 0)) for k, mass in enumerate(masses)]
    found = first_impacts(Scene('bars', tuple(bars), None, DEAD, gravity=WEIGHTLESS))
    mu = 1 / sum(1 / mass for mass in masses)
    peak, duration, *_ = spring_pulse(masses, 2.0, STIFFNESS / 2)
    assert [hit.bone for hit in found] == ['bar_0/bar', 'bar_1/bar']
    for hit, mass in zip(found, masses, strict=True):
        assert hit.effective_mass == pytest.approx(mu, rel=1e-6)
        assert hit.impulse == pytest.approx(mu * 2.0, rel=1e-6)
        assert (hit.peak_force, hit.duration) == pytest.approx((peak, duration), rel=1e-3)
        assert hit.peak_acceleration == pytest.approx(peak / mass, rel=1e-3)
        assert hit.point == pytest.approx((0.35, 0, 0), abs=0.06)


def tangle(seed, wall):
    """A person with random angles who drifts without gravity towards a second one, or a wall."""
    rng, man = np.random.default_rng([36, seed]), load_doll('man')
    angles = {name: float(rng.uniform(*np.clip(limits, -0.9, 0.9)))
              for joint in man.joints if len(joint.angle_limits)
              for name, limits in zip(joint.angle_names, joint.angle_limits, strict=True)}
    turn = rotation.from_axis_angle(rng.normal(size=3), rng.uniform(0, 3))
    feet = rotation.rotate(turn, np.array((0.0, 0.0, -1.0)))
    placed = [Placement(man, 'one', tuple(feet), tuple(turn), velocity=(2, 0.1, 0), angles=angles)]
    bodies = (StaticBody('wall', Box((0.2, 9, 9)), (2.5, 0, 0)),) if wall else ()
    if not wall:
        placed.append(Placement(load_doll('woman'), 'two', (2.5, 0, -1)))
    return Scene('tangle', tuple(placed), None, DEAD, gravity=WEIGHTLESS, bodies=bodies)


@pytest.mark.parametrize('wall', [True, False])
@pytest.mark.parametrize('seed', range(3))
def test_effective_masses_are_those_of_mujocos_mass_matrix(seed, wall):
    """J M^-1 J^T at the pose of the start: until they meet, people only drift."""
    mujoco = pytest.importorskip('mujoco')
    scene = tangle(seed, wall)
    found = first_impacts(scene)
    hit = found[0]
    with Simulation(scene, engine='mujoco') as simulation:
        model, data = simulation._engine._model, simulation._engine._data
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        # MuJoCo 4 reads the sparse matrix from the data
        mujoco.mj_fullM(model, *((mass, data.qM) if hasattr(data, 'qM') else (data, mass)))
        rows = np.zeros((3, model.nv))
        pair = found[:1 if wall else 2]
        for impact, sign in zip(pair, (1, -1), strict=False):
            drift = hit.time * 1e-9 * np.array(scene.dolls[0].velocity) * (sign > 0)
            part = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, part, None, np.array(hit.point) - drift,
                          model.body(impact.bone).id)
            rows += sign * part
        row = np.array(hit.normal) @ rows
        for impact in pair:
            center = np.zeros((3, model.nv))
            mujoco.mj_jacBodyCom(model, data, center, None, model.body(impact.bone).id)
            assert impact.mobility == pytest.approx(
                np.linalg.norm(center @ np.linalg.solve(mass, row)), rel=1e-5)
    assert hit.effective_mass == pytest.approx(1 / (row @ np.linalg.solve(mass, row)), rel=1e-6)


REGIONS = yaml.safe_load((config_folder() / 'limits/iso_ts_15066.yaml').read_text())['regions']


@pytest.mark.parametrize('held', [True, False])
@pytest.mark.parametrize('region', REGIONS)
def test_the_speed_at_the_limit_is_the_standards(region, held):
    """It is F / sqrt(mu k): bumps by a robot of 20 kg of a region that is held, by 1e9 kg, or free
    with its effective mass. At that speed the ratio is 1.
    """
    given = REGIONS[region]
    bone, mass = given['bones'][0], 1e9 if held else given['effective_mass']
    mu = 1 / (1 / mass + 1 / 20)
    expected = given['transient_force'] / math.sqrt(mu * given['stiffness'])

    def bump(speed):
        body = box((0.2,) * 3, mass, bone)
        scene = Scene('bump', (
            Placement(body, 'person'), Placement(ball('robot', 20.0), 'robot', (0.21, 0, 0),
                                                 velocity=(-speed, 0, 0))),
            None, DEAD, gravity=WEIGHTLESS)
        hit, *_ = first_impacts(scene, load_limits())
        assert (hit.region, hit.doll, hit.against) == (region, 'person', 'robot/robot')
        return hit.ratio

    found = 1 / bump(1.0)
    assert found == pytest.approx(expected, rel=0.05)
    assert bump(found) == pytest.approx(1, rel=1e-6)


@pytest.mark.parametrize('name', ['man_faints', 'table'])
def test_recording_changes_no_bit(name):
    """While and after impacts are recorded; `table` has several dolls."""
    scene, ends = load_scene(name), []
    for recorded in (False, True):
        with Simulation(scene) as simulation:
            count = 0
            if recorded:
                simulation.record_impacts(load_limits())
            for _ in range(130):
                simulation.advance()
                count += len(simulation.impacts) if recorded else 0
            simulation.record_impacts(None)
            ends.append(simulation.run(20).tobytes())
            assert not recorded or count > 10
    assert ends[0] == ends[1]


@pytest.mark.parametrize('count', [5, 80])
def test_impacts_of_many_have_their_own_times(count):
    """Balls in a row that fall from different heights, near enough to be one cluster; 80 bodies
    locate their impacts in islands only.
    """
    heights = 0.02 + 0.5 * np.random.default_rng(7).permutation(count) / count
    scene = Scene('row', tuple(
        Placement(ball(mass=1.0), f'ball_{k}', (0.205 * k, 0, 0.1 + height))
        for k, height in enumerate(heights)), Ground(), Material(restitution=0, friction=0))
    found = {}
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        for _ in range(40):
            simulation.advance()
            for hit in simulation.impacts:
                assert simulation.time - 10_000_000 <= hit.time <= simulation.time
                found.setdefault(hit.bone, []).append(hit)
        assert simulation.dropped_impacts == 0
    assert len(found) == count
    for k, height in enumerate(heights):
        hit, *more = found[f'ball_{k}/ball']
        assert not more
        assert hit.speed == pytest.approx(math.sqrt(2 * 9.8 * height), rel=1e-3)
        assert hit.impulse == pytest.approx(hit.speed, rel=1e-6)
        assert hit.time * 1e-9 == pytest.approx(math.sqrt(2 * height / 9.8), abs=1e-5)


def test_a_driven_body_bumps_with_infinite_mass():
    """At 1.5 m/s into a ball of 3 kg: mu is 3 kg. While it goes on pushing, there are no more."""
    robot = dataclasses.replace(Placement(box((0.2,) * 3, 1.0, 'robot'), 'robot', (-0.3, 0, 0)),
                                follow=Follow())
    scene = Scene('bump', (robot, Placement(ball(mass=3.0), 'person')), None, DEAD,
                  gravity=WEIGHTLESS)
    found = []
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        for _ in range(30):
            simulation.drive_body('robot', twist=(1.5, 0, 0, 0, 0, 0))
            simulation.advance()
            found += [hit for hit in simulation.impacts if hit.doll == 'person']
    hit, = found
    assert hit.against == 'robot/robot'
    assert (hit.speed, hit.effective_mass, hit.impulse) == pytest.approx((1.5, 3, 4.5), rel=1e-6)
    assert hit.peak_acceleration == pytest.approx(1.5 * math.sqrt(STIFFNESS / 3), rel=1e-6)


@pytest.mark.parametrize('restitution', [0.0, 0.5])
def test_the_energy_that_an_impact_takes_is_missing_in_the_simulation(restitution):
    """A bar that is hit beside its middle, and turns; without friction nothing else takes any."""
    bar = Placement(box((0.1, 0.1, 0.8), 2.0, 'bar'), 'bar', (0.3, 0, 0.25))
    thrown = Placement(ball(mass=1.0), 'ball', velocity=(2.0, 0, 0))
    scene = Scene('beside', (thrown, bar), None, Material(0.0, 0.0, restitution),
                  gravity=WEIGHTLESS)
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        lost = []
        for _ in range(30):
            simulation.advance()
            lost += [hit.lost_energy for hit in simulation.impacts if hit.doll == 'ball']
        missing = 1.0 * 2.0 ** 2 / 2 - simulation.kinetic_energy
    assert len(lost) == 1 and lost[0] == pytest.approx(missing, rel=1e-6) and missing > 0.1


def test_what_rests_slides_or_is_pressed_has_no_impacts():
    """A box that slides under a load, which lies from the start."""
    scene = Scene('slide', (Placement(box((0.2,) * 3, 2.0, 'bar'), 'bar', (0, 0, 0.1),
                                      velocity=(2, 0, 0)),), Ground(),
                  Material(restitution=0, friction=0.3))
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        simulation.push(Push('bar', force=(0, 0, -500), duration=0.5))
        for _ in range(50):
            simulation.advance()
            assert simulation.impacts == ()


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_say_that_they_have_none(engine):
    pytest.importorskip({'bullet': 'pybullet'}.get(engine, engine))
    with Simulation(load_scene('drop'), engine=engine) as simulation:
        with pytest.raises(WrongForm, match='rigid, which finds times of impact'):
            simulation.record_impacts(load_limits())
        with pytest.raises(WrongForm, match='record_impacts'):
            _ = simulation.impacts


def test_impacts_are_recorded_on_after_a_reset_and_after_going_back():
    scene = Scene('drop', (Placement(ball(mass=1.0), 'ball', (0, 0, 0.2)),), Ground(), DEAD)
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        before, counts = simulation.checkpoint(), []
        for back in (lambda: None, simulation.reset, lambda: simulation.go_back(before)):
            back()
            found = []
            assert simulation.impacts == ()
            for _ in range(20):
                simulation.advance()
                found += simulation.impacts
                if found:
                    break
            counts.append([hit.time for hit in found])
        assert len(counts[0]) == 1 and counts[0] == counts[1] == counts[2]


def test_impacts_are_recorded_on_where_dolls_come_and_go():
    """A second ball comes, and its impact has its own name; then the first one goes."""
    scene = Scene('drop', (Placement(ball(mass=1.0), 'first', (0, 0, 0.2)),), Ground(), DEAD)
    with Simulation(scene) as simulation:
        simulation.record_impacts(HARD)
        simulation.advance()
        simulation.add(Placement(ball(mass=2.0), 'second', (0.25, 0, 0.2)))
        found = []
        for tick in range(30):
            if tick == 20:
                simulation.remove('first')
                simulation.set_state('second', position=(0, 0, 0.2))
            simulation.advance()
            found += [(hit.doll, hit.bone, round(hit.effective_mass, 6))
                      for hit in simulation.impacts]
    assert found == [('first', 'first/ball', 1.0), ('second', 'second/ball', 2.0)]


def test_the_criterion_of_a_blow_on_a_head():
    """That of the pulse by the law, whose closed form is tested in test_head_injury.py."""
    scene = Scene('drop', (Placement(ball('head', 4.4), 'ball', (0, 0, 0.6)),), Ground(), DEAD)
    hit, = first_impacts(scene, load_limits())
    peak = math.sqrt(2 * 9.8 * 0.5) * math.sqrt(150e3 / 4.4)
    assert hit.head_injury(HIC15) == pytest.approx(
        half_sine_head_injury(peak, math.pi * math.sqrt(4.4 / 150e3)), rel=1e-6)



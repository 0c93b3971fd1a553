"""Hands that hold bones: against closed forms, and pulled about as hard as they can."""
from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from conserved import conserved, matrices

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.actions.grab import (
    FREQUENCY,
    MAX_ACCELERATION,
    MAX_FORCE,
    MAX_HANDS,
)
from ragdoll_ros.physics.engine.doll_totals import DollSums
from ragdoll_ros.physics.engine.substepped.explicit_springs import mobility
from ragdoll_ros.physics.simulation import Simulation

DROP, FLIGHT = load_scene('drop'), load_scene('flight')
BONES = DROP.bone_names
DIRECTIONS = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
PLAIN = dataclasses.replace(NORMAL, energy=False)
"""Nothing is corrected: what is measured is the stepping and the work alone."""


def single(shape, mass=10.0, gravity=(0, 0, 0), velocity=(0, 0, 0), spin=(0, 0, 0)):
    doll = Ragdoll('single', (Bone('body', shape, mass, (0, 0, 0)),), ())
    return Scene('single', (Placement(doll, velocity=velocity, spin=spin),), gravity=gravity)


def held_point(simulation, hand=0):
    """Where the point is that a hand holds."""
    grab = simulation.grabs[hand]
    bone = simulation.scene.bone_index(grab.bone)
    state = simulation.state
    return state.positions[bone] + matrices(state.orientations)[bone] @ grab.point


def corner(bone):
    """A point near a bone's corner, where it gives way most."""
    return tuple(0.9 * side for side in DROP.bones[DROP.bone_index(bone)].shape.half_extents)


@pytest.mark.parametrize('gravity', [(0, 0, -9.8), (3, 0, -1.6)])
def test_a_ball_that_hangs_sags_by_its_weight_over_the_stiffness(gravity):
    scene = single(Sphere(0.1), 3.0, gravity)
    with Simulation(scene) as simulation:
        simulation.grab('hand', 'body')
        for _ in range(100):
            state = simulation.advance()
    # m g / k with k = m w^2; e^-30 of the way is left after a second.
    assert state.positions[0] == pytest.approx(np.array(gravity) / FREQUENCY ** 2, rel=1e-6)


def test_a_doll_that_hangs_sags_as_little():
    with Simulation(DROP, accuracy='draft') as simulation:
        simulation.grab('hand', 'head', (0, 0, 0.1))
        simulation.drag('hand', simulation.grabs[0].target + np.array((0, 0, 0.5)), 0.3)
        for _ in range(700):
            simulation.advance()
        lacks = np.array(simulation.grabs[0].target) - held_point(simulation)
    # It still swings a little after 7 s: 4 %.
    assert lacks == pytest.approx((0, 0, 9.8 / FREQUENCY ** 2), abs=0.04 * 9.8 / FREQUENCY ** 2)


@pytest.mark.parametrize('step, error', [(0.01, 0.08), (5e-4, 0.016)])
def test_a_mass_on_the_spring_is_critically_damped(step, error):
    """The mass is at v t e^-wt if it starts at v; backward Euler is off by some w h / 2."""
    speed = 0.5
    with Simulation(single(Sphere(0.1), velocity=(speed, 0, 0)), step=step) as simulation:
        simulation.grab('hand', 'body')
        for tick in range(1, round(0.3 / step)):
            time = tick * step
            way = simulation.advance().positions[0, 0]
            wanted = speed * time * math.exp(-FREQUENCY * time)
            assert way == pytest.approx(wanted, abs=error * speed / FREQUENCY / math.e)


@pytest.mark.parametrize('bone', BONES)
def test_a_bone_follows_within_a_fifth_of_a_second(bone):
    with Simulation(FLIGHT) as simulation:
        simulation.grab('hand', bone)
        way = np.array((0.06, -0.04, 0.07))
        simulation.drag('hand', simulation.grabs[0].target + way)
        for _ in range(20):
            simulation.advance()
        lacks = np.array(simulation.grabs[0].target) - held_point(simulation)
    assert np.linalg.norm(lacks) < 0.1 * np.linalg.norm(way)


def test_a_hand_pulls_no_harder_than_it_may():
    """From afar it pulls with all its force: momentum is force times time."""
    with Simulation(FLIGHT) as simulation:
        simulation.grab('hand', 'torso')
        simulation.drag('hand', simulation.grabs[0].target + np.array((300, 0, 0)), 0.0)
        for _ in range(20):
            state = simulation.advance()
    momentum = conserved(FLIGHT, state).momentum
    # The bone gives way askew, and the pull is askew by some 2 degrees to make up for it.
    assert momentum == pytest.approx((MAX_FORCE * 0.2, 0, 0), abs=0.05 * MAX_FORCE * 0.2)
    assert 0.995 < np.linalg.norm(momentum) / (MAX_FORCE * 0.2) <= 1 + 1e-9


def test_a_light_doll_is_pulled_gently():
    with Simulation(single(Sphere(0.01), mass=0.02)) as simulation:
        simulation.grab('hand', 'body')
        simulation.drag('hand', (5, 0, 0), 0.0)
        for _ in range(10):
            state = simulation.advance()
    assert state.linear_velocities[0, 0] == pytest.approx(MAX_ACCELERATION * 0.1, rel=1e-6)


def test_mobility_is_that_of_a_rigid_body():
    """W = 1 / m - [r] I^-1 [r] for a free body, turned as it is."""
    scene = single(Box((0.1, 0.2, 0.4)), spin=(1, -2, 3))
    with Simulation(scene) as simulation:
        for _ in range(7):
            state = simulation.advance()
        point = np.array((0.05, -0.1, 0.2))
        got = mobility(DollSums(scene), state, 0, point)
    arm = matrices(state.orientations)[0] @ point
    skew, inertia = np.cross(np.eye(3), arm), conserved(scene, state).inertia
    assert got == pytest.approx(np.eye(3) / 10 - skew @ np.linalg.inv(inertia) @ skew, abs=1e-6)


@pytest.mark.parametrize('engine', ['auto', 'bullet'])
@pytest.mark.parametrize('point', [(0, 0, 0), (0, 0.06, 0.08)])
def test_the_work_is_what_the_energy_grows_by(engine, point):
    """A ball has no gyroscopic torque: without the guard, the engine's step keeps its energy."""
    scene = single(Sphere(0.1))
    with Simulation(scene, accuracy=PLAIN, engine=engine) as simulation:
        simulation.grab('hand', 'body', point)
        start = np.array(simulation.grabs[0].target)
        for tick in range(100):
            if tick < 60:
                way = (0.05 * tick, 0.3 * math.sin(tick / 5), 0.2 * math.cos(tick / 7))
                simulation.drag('hand', start + np.array(way))
            if tick == 60:
                simulation.let_go('hand')
            simulation.advance()
            work = simulation.measures()['work_of_grabs_J']
            # 5e-5 of the 300 J that go in and out.
            energy = conserved(scene, simulation.state).energy
            assert energy == pytest.approx(work, abs=0.015)
        assert work > 100
        assert simulation.measures()['work_of_pushes_J'] == 0


def thrown(simulation, bone, direction, seconds=(0.1, 0.25, 0.2)):
    """Let fall, drag at 10 m/s from a corner, let go; tell all that must not be.

    Gives the most by which a limit was passed, rad, that a bone sank, m, and the energy from
    nothing, as a share of the energy at the start and of all work done.
    """
    step, scene = simulation.step, simulation.scene
    fall, drag, fly = (round(part / step) for part in seconds)
    start = conserved(scene, simulation.state).energy
    worst = {'limit': 0.0, 'sunk': 0.0, 'excess': -math.inf, 'gap': 0.0}
    turned_over = last = 0.0
    for tick in range(fall + drag + fly):
        if tick == fall:
            simulation.grab('hand', bone, corner(bone))
            place = np.array(simulation.grabs[0].target)
        if fall <= tick < fall + drag:
            way = 10 * step * (tick - fall + 1)
            simulation.drag('hand', place + way * np.array(direction), step)
        if tick == fall + drag:
            simulation.let_go('hand')
        state = simulation.advance()
        measures = simulation.measures()
        work = measures['work_of_grabs_J']
        turned_over, last = turned_over + abs(work - last), work
        excess = conserved(scene, state).energy - start - work
        for name, value in (('limit', measures['limit_overshoot_rad']),
                            ('sunk', measures['sinking_m']), ('gap', measures['joint_gap_m']),
                            ('excess', excess / (start + turned_over))):
            worst[name] = max(worst[name], value)
    worst['work'] = turned_over
    return worst


def check_thrown(worst, bone, direction):
    told = f'{bone} {direction}: {worst}'
    assert worst['excess'] <= 1e-3, told
    assert math.degrees(worst['limit']) <= 5, told
    # The ground holds against 2000 N; exact: 2 mm, draft: 6 mm are put up with in one step.
    assert worst['sunk'] <= 0.02, told
    assert worst['gap'] <= 1e-6, told
    assert worst['work'] > 300, told


CASES = list(itertools.product(BONES, DIRECTIONS))
NAMES = ['draft', 'normal', 'exact']


@pytest.mark.parametrize('number', range(3))
def test_pulled_at_ten_metres_a_second_and_let_go(number):
    """Every bone at each accuracy, in another direction; the next test has them all."""
    with Simulation(DROP, accuracy=NAMES[number]) as simulation:
        for index, bone in enumerate(BONES):
            direction = DIRECTIONS[(index + 2 * number + index // 6) % 6]
            simulation.reset()
            check_thrown(thrown(simulation, bone, direction), bone, direction)


@pytest.mark.slow
@pytest.mark.parametrize('step', [1 / 30, 0.01, 0.002])
@pytest.mark.parametrize('accuracy', NAMES)
def test_pulled_at_ten_metres_a_second_and_let_go_in_every_way(accuracy, step):
    with Simulation(DROP, accuracy=accuracy, step=step) as simulation:
        for bone, direction in CASES:
            simulation.reset()
            check_thrown(thrown(simulation, bone, direction, (0.2, 0.3, 0.6)), bone, direction)


@pytest.mark.parametrize('accuracy, step', [('draft', 1 / 30), ('normal', 0.01),
                                            pytest.param('exact', 0.01, marks=pytest.mark.slow),
                                            pytest.param('draft', 0.002, marks=pytest.mark.slow)])
def test_jumps_of_the_pointer_by_metres_leave_it_stable(accuracy, step):
    rng = np.random.default_rng(1)
    with Simulation(DROP, accuracy=accuracy, step=step) as simulation:
        start = conserved(DROP, simulation.state).energy
        simulation.grab('hand', 'left_forearm', (0, 0.1, 0))
        turned_over = last = 0.0
        for tick in range(round(1.5 / step)):
            if tick % max(1, round(0.05 / step)) == 0:
                simulation.drag('hand', rng.normal(size=3) * 3 + (0, 0, 1))
            state = simulation.advance()
            measures = simulation.measures()
            work = measures['work_of_grabs_J']
            turned_over, last = turned_over + abs(work - last), work
            excess = conserved(DROP, state).energy - start - work
            assert excess <= 1e-3 * (start + turned_over)
            assert math.degrees(measures['limit_overshoot_rad']) <= 5
        simulation.drag('hand', (0, 0, 2.2), 0.5)
        for _ in range(round(6 / step)):
            simulation.advance()
        # It still swings, at up to 2 times its weight, which is 22 mm.
        assert np.linalg.norm(held_point(simulation) - (0, 0, 2.2)) < 0.04


def test_what_is_thrown_keeps_its_momentum():
    with Simulation(FLIGHT) as simulation:
        simulation.grab('hand', 'right_shin', corner('right_shin'))
        for tick in range(20):
            simulation.drag('hand', (0.1 * tick, 0, 0.5 + 0.05 * tick), 0.01)
            simulation.advance()
        before = simulation.state
        simulation.let_go('hand')
        assert simulation.state is before
        motion = conserved(FLIGHT, before)
        assert np.linalg.norm(motion.momentum) > 50
        for _ in range(50):
            after = conserved(FLIGHT, simulation.advance())
            assert after.momentum == pytest.approx(motion.momentum, abs=1e-6)
            # What the stepping takes from the turn in contacts between bones, the guard gives
            # back; what it cannot know it leaves: 1e-3.
            assert after.angular_momentum == pytest.approx(
                motion.angular_momentum, abs=1e-3 * np.linalg.norm(motion.angular_momentum))


def swung(hands):
    """How far a point swings in which so many hands hold a doll that hangs, m."""
    with Simulation(DROP) as simulation:
        for number in range(hands):
            simulation.grab(f'hand {number}', 'left_forearm', (0, 0.1, 0))
        places = []
        for _ in range(40):
            simulation.advance()
            places.append(held_point(simulation))
    return np.ptp(places, axis=0)


def test_many_hands_at_one_point_do_not_quarrel():
    """They hold it as one that is stronger."""
    assert np.linalg.norm(swung(MAX_HANDS)) <= np.linalg.norm(swung(1))


def test_more_hands_than_there_may_be_are_refused():
    with Simulation(DROP) as simulation:
        for number in range(MAX_HANDS):
            simulation.grab(f'hand {number}', 'torso')
        with pytest.raises(errors.OutOfRange, match='hands'):
            simulation.grab('one more', 'head')
        simulation.grab('hand 3', 'head')
        assert len(simulation.grabs) == MAX_HANDS


def test_a_doll_that_sleeps_wakes_and_is_lifted():
    with Simulation(DROP, accuracy='draft') as simulation:
        while not simulation.asleep:
            simulation.advance()
        height = simulation.state.positions[0, 2]
        simulation.grab('hand', 'torso')
        simulation.drag('hand', simulation.grabs[0].target + np.array((0, 0, 0.5)), 0.5)
        for _ in range(120):
            simulation.advance()
        assert not simulation.asleep
        assert simulation.state.positions[0, 2] > height + 0.45


def pulled_states(simulation):
    """Bytes of all states of a run in which two hands come and go."""
    run = []
    for tick in range(100):
        if tick == 5:
            simulation.grab('left', 'left_forearm', (0.0, 0.1, 0.0))
        if tick == 30:
            simulation.grab('right', 'right_shin', target=(0.5, 0.0, 1.0))
        if tick % 5 == 0:
            simulation.drag('left', (0.5 * math.sin(tick / 20), 0.6, 1.3))
        if tick == 80:
            simulation.let_go('left')
        state = simulation.advance()
        run.append(b''.join(np.ascontiguousarray(part).tobytes()
                            for part in vars(state).values()))
    return run


def test_the_same_grabs_give_the_same_bits_and_a_reset_lets_go():
    with Simulation(DROP) as simulation:
        first = pulled_states(simulation)
        assert [grab.hand for grab in simulation.grabs] == ['right']
        simulation.reset()
        assert simulation.grabs == ()
        assert pulled_states(simulation) == first
    with Simulation(DROP) as simulation:
        assert pulled_states(simulation) == first


def test_a_hand_that_let_go_long_ago_leaves_no_trace_in_a_run():
    """Grabbed and let go before a tick, nothing was pulled."""
    with Simulation(DROP) as one, Simulation(DROP) as other:
        other.grab('hand', 'head')
        other.let_go('hand')
        for _ in range(50):
            assert np.array_equal(one.advance().positions, other.advance().positions)


def test_hands_have_names_and_say_what_they_hold():
    with Simulation(DROP) as simulation:
        simulation.grab('a', 'head', (0, 0, 0.1))
        simulation.grab('b', 'torso', target=(0, 0, 2))
        simulation.grab('a', 'left_shin', (0, 0, -0.1))
        b, a = simulation.grabs
        assert (a.bone, a.point, b.bone, b.target) == (
            'left_shin', (0, 0, -0.1), 'torso', (0, 0, 2))
        shin = simulation.state.positions[BONES.index('left_shin')]
        assert a.target == pytest.approx(shin - (0, 0, 0.1), abs=1e-12)
        simulation.drag('a', (1, 2, 3))
        simulation.drag('nobody', (1, 2, 3))
        simulation.let_go('nobody')
        simulation.let_go('b')
        assert [grab.target for grab in simulation.grabs] == [(1, 2, 3)]


@pytest.mark.parametrize('error, name, arguments', [
    (errors.UnknownBone, 'grab', ('hand', 'tail')),
    (errors.NotFinite, 'grab', ('hand', 'head', (math.nan, 0, 0))),
    (errors.NotFinite, 'grab', ('hand', 'head', (0, 0, 0), (0, math.inf, 0))),
    (errors.OutOfRange, 'grab', ('hand', 'head', (0, 0, 5))),
    (errors.OutOfRange, 'grab', ('hand', 'head', (0, 0))),
    (errors.OutOfRange, 'grab', ('hand', 'head', (0, 0, 0), (1e300, 0, 0))),
    (errors.NotFinite, 'drag', ('held', (0, math.nan, 0))),
    (errors.OutOfRange, 'drag', ('held', (0, 0, -1e9))),
    (errors.OutOfRange, 'drag', ('held', (0, 0, 1), -1)),
    (errors.OutOfRange, 'drag', ('held', (0, 0, 1), math.nan))])
def test_rubbish_is_refused_and_moves_nothing(error, name, arguments):
    with Simulation(DROP) as simulation:
        simulation.grab('held', 'torso')
        before = simulation.grabs
        with pytest.raises(error):
            getattr(simulation, name)(*arguments)
        assert simulation.grabs == before

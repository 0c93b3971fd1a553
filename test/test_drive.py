"""Drives: a bone is pushed towards a velocity, whatever the gain, the step and the engine."""
from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from conserved import conserved

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.drive import MAX_FORCE, MAX_SPEED, MAX_TORQUE, Drive
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.accuracy import resolve_accuracy
from ragdoll_ros.physics.simulation import Simulation

DROP, FLIGHT = load_scene('drop'), load_scene('flight')
BALL = Scene('ball', (Placement(Ragdoll('ball', (Bone('ball', Sphere(0.1), 2.0,
                                                       (0.0, 0.0, 0.0)),))),),
             ground=None, gravity=(0.0, 0.0, 0.0))
INERTIA = 0.4 * 2.0 * 0.1 ** 2
ENGINES = ('rigid', 'bullet', 'mujoco')


def gone(simulation, seconds):
    """The state after so many s."""
    for _ in range(round(seconds / simulation.step)):
        state = simulation.advance()
    return state


def lying(simulation):
    """The state of a doll that has fallen down and sleeps."""
    while not simulation.asleep:
        state = simulation.advance()
        assert simulation.time < 20e9
    return state


def turned(before, after):
    """Degrees by which the first bone has turned."""
    turn = after.rotation_matrices[0] @ before.rotation_matrices[0].T
    return math.degrees(math.acos(min(1.0, (np.trace(turn) - 1) / 2)))


@pytest.mark.parametrize('engine', ENGINES)
def test_a_ball_comes_to_the_velocity_as_a_damper_takes_it(engine):
    """V = u (1 - exp(-c t / m)), and work m v^2 / 2 + I w^2 / 2, by rates of 5 and 4 /s."""
    drive = Drive('ball', (1.0, -2.0, 0.5), (0.0, 3.0, -1.0), force_per_speed=10.0,
                  torque_per_speed=4 * INERTIA, duration=1.0)
    with Simulation(BALL, engine=engine) as simulation:
        simulation.push(drive)
        state = gone(simulation, 0.3)
        work = simulation.measures()['work_of_pushes_J']
    speed = np.array(drive.velocity) * -math.expm1(-5 * 0.3)
    spin = np.array(drive.angular_velocity) * -math.expm1(-4 * 0.3)
    # The peers take the force once in 2.5 ms: an error of h c / m.
    near = 1e-4 if engine == 'rigid' else 0.02
    assert state.linear_velocities[0] == pytest.approx(speed, rel=near)
    assert state.angular_velocities[0] == pytest.approx(spin, rel=near)
    done = 2.0 / 2 * speed @ speed + INERTIA / 2 * spin @ spin
    assert work == pytest.approx(done, rel=2 * near)


def test_force_and_torque_are_limited():
    """10 N on 2 kg: 5 m/s^2, and 0.01 N m on I: 1.25 rad/s^2, however much is missing."""
    with Simulation(BALL) as simulation:
        simulation.push(Drive('ball', (100.0, 0.0, 0.0), (0.0, 0.0, 100.0), most_force=10.0,
                              most_torque=0.01))
        state = gone(simulation, 0.1)
    assert state.linear_velocities[0] == pytest.approx((0.5, 0, 0), abs=1e-9)
    assert state.angular_velocities[0] == pytest.approx((0, 0, 0.01 / INERTIA * 0.1), abs=1e-9)


@pytest.mark.parametrize('gain', [1e2, 1e3, 1e4, 1e5])
@pytest.mark.parametrize('engine', ENGINES)
def test_no_gain_shakes_a_ball(engine, gain):
    """What is missing falls from tick to tick, and never changes its sign: rates up to 5e4 /s."""
    with Simulation(BALL, engine=engine, accuracy='draft') as simulation:
        simulation.push(Drive('ball', (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), force_per_speed=gain,
                              torque_per_speed=gain / 100, most_force=1e6, most_torque=1e6))
        states = [simulation.advance() for _ in range(30)]
    for speeds in ([state.linear_velocities[0, 0] for state in states],
                   [state.angular_velocities[0, 2] for state in states]):
        assert min(np.diff(speeds, prepend=0.0)) > -1e-12
        assert 0.999 < speeds[-1] < 1 + 1e-12


@pytest.mark.parametrize('gain', [1e4, 1e5])
@pytest.mark.parametrize('accuracy', ['draft', 'normal'])
def test_no_gain_shakes_a_doll(gain, accuracy):
    """A limb that meets its limit takes a tenth of the speed at the most, and a hundredth more than
    was asked for is never there.
    """
    with Simulation(FLIGHT, accuracy=accuracy) as simulation:
        simulation.push(Drive('torso', (0.0, 0.3, 0.0), (0.0, 0.0, 0.3), force_per_speed=gain,
                              torque_per_speed=gain / 10, duration=1.0))
        states = [simulation.advance() for _ in range(60)]
    for speeds in ([state.linear_velocities[0, 1] for state in states],
                   [state.angular_velocities[0, 2] for state in states]):
        assert max(speeds) < 1.01 * 0.3
        assert min(np.diff(speeds, prepend=0.0)) > -0.1 * 0.3
        assert speeds[-1] > 0.9 * 0.3


def test_the_motion_converges_as_the_step_shrinks():
    """By order 2 in the air: half the step, a quarter of the error; 3 leaves room for the next."""
    def ends(step):
        accuracy = dataclasses.replace(resolve_accuracy('normal'), step=step)
        with Simulation(FLIGHT, accuracy=accuracy) as simulation:
            simulation.push(Drive('torso', (0.2, 0.3, 0.1), (0.0, 0.5, 1.0), force_per_speed=500.0,
                                  torque_per_speed=5.0))
            return gone(simulation, 0.3).positions

    ways = [ends(0.01 / 2 ** level) for level in range(1, 6)]
    steps = [np.abs(one - other).max() for one, other in itertools.pairwise(ways)]
    assert steps[-1] < 1e-5
    assert all(one / other > 3 for one, other in itertools.pairwise(steps))


@pytest.mark.parametrize('engine', ENGINES)
def test_in_flight_the_root_comes_to_a_metre_a_second_and_a_radian(engine):
    for targets in ({'velocity': (0.0, 1.0, 0.0)}, {'angular_velocity': (0.0, 0.0, 1.0)}):
        with Simulation(FLIGHT, engine=engine) as simulation:
            simulation.push(Drive('torso', **targets))
            state = gone(simulation, 0.3)
        rows = state.linear_velocities if 'velocity' in targets else state.angular_velocities
        assert rows[0] == pytest.approx(*targets.values(), abs=0.1)


@pytest.mark.parametrize('velocity', [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_lying_doll_is_moved(velocity):
    with Simulation(DROP) as simulation:
        before = lying(simulation)
        simulation.push(Drive('torso', velocity))
        after = gone(simulation, 2.0)
        measures = simulation.measures()
    way = conserved(DROP, after).centre - conserved(DROP, before).centre
    assert 0.1 < way @ velocity < 3
    assert measures['work_of_pushes_J'] > 0
    # What falls, strikes and slides may lose energy, but make none.
    assert measures['energy_excess_J'] < 0


@pytest.mark.parametrize(('friction', 'sign'), [(0.8, 1), (0.8, -1), (math.inf, 1), (math.inf, -1)])
def test_lying_dolls_are_turned(friction, sign):
    """All, as they lie after six falls; where nothing slips some poses cannot be turned, see below,
    and some of the others roll over.
    """
    ways = []
    for spin in np.random.default_rng(1).normal(size=(6, 3)).tolist():
        scene = dataclasses.replace(
            DROP, material=dataclasses.replace(DROP.material, friction=friction),
            dolls=(dataclasses.replace(DROP.dolls[0], spin=tuple(spin)),))
        with Simulation(scene) as simulation:
            before = lying(simulation)
            simulation.push(Drive('torso', angular_velocity=(0.0, 0.0, sign)))
            after = gone(simulation, 2.0)
        if turned(before, after) > 5:
            # Most of it about the vertical: the axis that lies flattest has turned that way.
            flattest = np.argmin(np.abs(before.rotation_matrices[0][2]))
            heading = np.cross(before.rotation_matrices[0], after.rotation_matrices[0], axis=0)[2]
            ways.append(sign * heading[flattest])
    turned_so = sum(way > math.sin(math.radians(5)) for way in ways)
    assert turned_so >= (6 if friction < math.inf else 2)
    assert min(ways) > 0, 'none the other way'


def test_what_lies_on_a_face_and_does_not_slip_is_not_turned():
    """Two points that stick bear any torque about the vertical, all of the drive's 600 N m."""
    for friction, turns in ((math.inf, False), (0.8, True)):
        box = Bone('box', Box((0.6, 0.4, 0.2)), 20.0, (0.0, 0.0, 0.0), friction=friction)
        scene = above_ground(Ragdoll('box', (box,)), 0.0)
        with Simulation(scene) as simulation:
            before = lying(simulation)
            simulation.push(Drive('box', angular_velocity=(0.0, 0.0, 1.0)))
            angle = turned(before, gone(simulation, 0.5))
        assert (angle > 5) if turns else (angle < 1e-6)


def test_what_moves_as_it_shall_is_left_alone():
    scene = dataclasses.replace(FLIGHT, dolls=(
        dataclasses.replace(FLIGHT.dolls[0], velocity=(0.0, 1.0, 0.0)),))
    with Simulation(scene) as driven, Simulation(scene) as free:
        driven.push(Drive('torso', (0.0, 1.0, 0.0), (0.0, 0.0, 0.0)))
        one, other = gone(driven, 0.5), gone(free, 0.5)
        assert driven.measures()['work_of_pushes_J'] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-9)


def test_what_is_not_asked_for_is_left_free():
    """A command to turn does not hold a doll in the air: it falls as one that is let alone."""
    with Simulation(DROP) as driven, Simulation(DROP) as free:
        driven.push(Drive('torso', angular_velocity=(0.0, 0.0, 1.0)))
        centres = [conserved(DROP, gone(each, 0.2)).centre for each in (driven, free)]
    # Steps in place of a flight: of order 2.
    assert centres[0] == pytest.approx(centres[1], abs=1e-4)


def test_the_guides_gentle_command_keeps_the_doll_near():
    """Docs/ros.md, as it stands at the start, in the fall and where it lies: 3 m at the most."""
    for wait in (0.0, 0.3, 1.5, 5.0):
        with Simulation(DROP) as simulation:
            before = gone(simulation, wait) if wait else simulation.state
            simulation.push(Drive('torso', (0.0, 1.0, 1.0)))
            after = gone(simulation, 4.0)
        way = conserved(DROP, after).centre - conserved(DROP, before).centre
        assert 0.3 < way[1] < 3 and abs(way[0]) < 1


def test_the_same_drive_gives_the_same_bits_and_reset_ends_it():
    with Simulation(DROP) as simulation:
        ways = []
        for _ in range(2):
            simulation.push(Drive('torso', (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 'cmd_vel')
            ways.append(gone(simulation, 0.5).rows.tobytes())
            simulation.reset()
        assert ways[0] == ways[1]
        assert simulation.pushes == ()


def test_a_drive_shows_the_push_that_it_is_at_rest():
    push = Drive('torso', (0.0, 0.1, 0.0), (0.0, 0.0, 5.0), force_per_speed=1000.0).at_rest
    assert push.force == pytest.approx((0, 100, 0))
    assert push.torque == pytest.approx((0, 0, MAX_TORQUE))
    assert Drive('torso', (9.0, 0.0, 0.0)).at_rest.force == pytest.approx((MAX_FORCE, 0, 0))


@pytest.mark.parametrize('changes', [
    {'velocity': (math.nan, 0, 0)}, {'angular_velocity': (0, math.inf, 0)},
    {'velocity': (2 * MAX_SPEED, 0, 0)}, {'force_per_speed': -1.0}, {'most_torque': math.nan},
    {'duration': 0}])
def test_a_drive_that_is_rubbish_cannot_be_made(changes):
    with pytest.raises(errors.ModelError, match=next(iter(changes))):
        Drive('torso', **changes)

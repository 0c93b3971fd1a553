"""Pushes: their signs and frames, impulse and work to the digit, their times and channels."""
import dataclasses
import math

import numpy as np
import pytest
from conserved import conserved

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.actions.push_queue import MAX_PUSHES
from ragdoll_ros.physics.simulation import Simulation

DROP, FLIGHT = load_scene('drop'), load_scene('flight')
ANGLES = DROP.angle_names
LIMITS = {name: pair for joint in DROP.dolls[0].doll.joints
          for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}
AXES = {name: (joint, axis) for joint in DROP.dolls[0].doll.joints
        for name, axis in zip(joint.angle_names, joint.axes, strict=True)}


@pytest.mark.parametrize('side', ['left', 'right'])
def test_a_push_on_the_shin_bends_the_knee_backwards(side):
    with Simulation(DROP) as simulation:
        knee = ANGLES.index(f'{side}_shin')
        simulation.push(Push(f'{side}_shin', force=(-150, 0, 0), duration=0.15))
        angles = []
        for _ in range(28):
            state = simulation.advance()
            angles.append(math.degrees(simulation.joint_angles[knee]))
            assert angles[-1] > -3
        shin = state.positions[DROP.bone_index(f'{side}_shin')]
        assert max(angles) > 30
        assert shin[0] < state.positions[DROP.bone_index(f'{side}_thigh')][0]


@pytest.mark.parametrize('side', ['left', 'right'])
def test_a_push_from_behind_does_not_bend_the_knee_forwards(side):
    with Simulation(DROP) as simulation:
        simulation.push(Push(f'{side}_shin', force=(150, 0, 0), duration=0.15))
        for _ in range(28):
            simulation.advance()
            assert math.degrees(simulation.joint_angles[ANGLES.index(f'{side}_shin')]) > -3


@pytest.mark.parametrize('end', [0, 1])
@pytest.mark.parametrize('angle', ANGLES)
def test_every_limit_is_reached_and_kept(angle, end):
    """A torque between child and parent turns the joint to its limit: 3 and 5 degrees."""
    joint, axis = AXES[angle]
    torque = 30.0 * (1 if end else -1) * np.array(axis)
    limit = math.degrees(LIMITS[angle][end])
    with Simulation(DROP) as simulation:
        simulation.push(Push(joint.child, torque=tuple(torque), duration=0.6))
        simulation.push(Push(joint.parent, torque=tuple(-torque), duration=0.6))
        nearest, passed = math.inf, 0.0
        for _ in range(60):
            simulation.advance()
            beyond = (math.degrees(simulation.joint_angles[ANGLES.index(angle)]) - limit)
            beyond *= 1 if end else -1
            nearest, passed = min(nearest, -beyond), max(passed, beyond)
    assert nearest < 3
    assert passed < 5


@pytest.mark.parametrize('direction', [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 1, -1)])
def test_an_impulse_is_force_times_time(direction):
    force = 2000 * rotation.normalized(direction)
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push('torso', force=tuple(force), duration=0.1))
        for _ in range(30):
            state = simulation.advance()
        momentum = conserved(FLIGHT, state).momentum
        assert momentum == pytest.approx(force * 0.1, abs=2e-4)


@pytest.mark.parametrize('bone', ['torso', 'left_forearm'])
def test_a_torque_gives_angular_momentum(bone):
    torque = np.array((3.0, -20.0, 10.0))
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push(bone, torque=tuple(torque), duration=0.1))
        for _ in range(15):
            state = simulation.advance()
        found = conserved(FLIGHT, state)
        size = np.linalg.norm(torque * 0.1)
        assert found.angular_momentum == pytest.approx(torque * 0.1, abs=1e-6 * size)
        assert found.momentum == pytest.approx((0, 0, 0), abs=1e-9)


BALL = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0.0, 0.0, 0.0)),))
PLATE = Ragdoll('plate', (Bone('plate', Box((0.5, 0.3, 0.1)), 10.0, (0.0, 0.0, 0.0)),))


def afloat(doll, **motion):
    return Scene('afloat', (Placement(doll, **motion),), ground=None, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize('tick', [0.01, 0.05, 0.2])
def test_a_torque_spins_a_ball_up(tick):
    """W = T t / I and W = I w^2 / 2, though the ball turns by more than once in a tick."""
    inertia, torque = 0.4 * 0.1 ** 2, 0.08
    with Simulation(afloat(BALL), step=tick) as simulation:
        simulation.push(Push('ball', torque=(0.0, 0.0, torque), duration=2.0))
        for _ in range(round(2 / tick)):
            state = simulation.advance()
        measures = simulation.measures()
    assert state.angular_velocities[0] == pytest.approx((0, 0, torque * 2 / inertia), abs=1e-9)
    work = (torque * 2) ** 2 / inertia / 2
    assert measures['work_of_pushes_J'] == pytest.approx(work, rel=1e-5)


@pytest.mark.parametrize('tick', [0.01, 0.1])
@pytest.mark.parametrize('local', [False, True])
def test_a_torque_on_a_tumbling_plate_works_as_much_as_its_energy_grows(tick, local):
    """The axis wanders, so that the turn in a stretch is not the sum of the turns within."""
    scene = afloat(PLATE, spin=(10.0, -14.0, 8.0))
    with Simulation(scene, step=tick) as simulation:
        start = conserved(scene, simulation.state).energy
        simulation.push(Push('plate', torque=(20.0, 10.0, 0.0), force=(30.0, 0.0, 50.0),
                             duration=0.6, local=local))
        for _ in range(round(0.6 / tick)):
            state = simulation.advance()
        gained = conserved(scene, state).energy - start
        # A stretch is a fifth of a radian: what is left is of the fourth power of that.
        assert simulation.measures()['work_of_pushes_J'] == pytest.approx(gained, rel=2e-4)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
@pytest.mark.parametrize('tick', [0.01, 0.03])
def test_a_force_along_the_axes_of_a_spinning_ball(accuracy, tick):
    """V = F / (m w) (sin wt, 1 - cos wt): the force turns with the ball."""
    rate, force, time = 20.0, 10.0, 0.03
    scene = afloat(BALL, spin=(0.0, 0.0, rate))
    with Simulation(scene, step=tick, accuracy=accuracy) as simulation:
        simulation.push(Push('ball', force=(force, 0.0, 0.0), duration=time, local=True))
        for _ in range(round(time / tick)):
            state = simulation.advance()
    angle = rate * time
    speed = force / rate * np.array((math.sin(angle), 1 - math.cos(angle), 0.0))
    assert state.linear_velocities[0] == pytest.approx(speed, abs=1e-4 * np.linalg.norm(speed))


@pytest.mark.parametrize('turn', [(0, 0, 0), (90, 0, 0), (0, 90, 0), (0, 0, 90), (30, -50, 200)])
@pytest.mark.parametrize('local', [False, True])
def test_world_and_bone_axes_in_five_orientations(turn, local):
    """One short push: the doll has hardly turned, so the axes are those of the start."""
    orientation = rotation.from_rpy(*np.radians(turn))
    scene = dataclasses.replace(FLIGHT, dolls=(
        Placement(FLIGHT.dolls[0].doll, orientation=tuple(orientation)),))
    push = Push('left_shin', force=(100, 20, -30), torque=(0.3, 0.1, -0.2), duration=1e-4,
                point=(0.01, 0.02, 0.1), local=local)
    with Simulation(scene, step=0.001) as simulation:
        bone = simulation.state.positions[scene.bone_index('left_shin')]
        centre = conserved(scene, simulation.state).centre
        simulation.push(push)
        found = conserved(scene, simulation.advance())
    force, torque, point = map(np.array, (push.force, push.torque, push.point))
    if local:
        force, torque, point = (rotation.rotate(orientation, v) for v in (force, torque, point))
    moment = torque + np.cross(bone + point - centre, force)
    # Within 0.1 ms the bone turns by some 1e-6 rad, and a force in its axes with it.
    size = np.linalg.norm(force) * 1e-4
    assert found.momentum == pytest.approx(force * 1e-4, abs=size * (1e-5 if local else 1e-9))
    # The lever arm changes by as little, so does the moment.
    assert found.angular_momentum == pytest.approx(moment * 1e-4, abs=1e-7)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_push_along_the_ground_does_its_work(accuracy):
    """20 N for 1 s on 5 kg without friction: 4 m/s, 2 m, 40 J."""
    box = Ragdoll('box', (Bone('box', Box((0.4, 0.4, 0.1)), 5.0, (0.0, 0.0, 0.0)),))
    scene = Scene('ice', (Placement(box, position=(0.0, 0.0, 0.05)),), Ground(),
                  material=Material(0.0, 0.0, 0.0))
    with Simulation(scene, accuracy=accuracy) as simulation:
        simulation.push(Push('box', force=(20.0, 0.0, 0.0), duration=1.0))
        for _ in range(100):
            state = simulation.advance()
        measures = simulation.measures()
    assert state.linear_velocities[0, 0] == pytest.approx(4.0, abs=1e-9)
    assert state.positions[0, 0] == pytest.approx(2.0, abs=1e-9)
    assert measures['work_of_pushes_J'] == pytest.approx(40.0, abs=1e-8)
    # It settles on the ground, which costs some tenths of a mJ.
    assert -2e-3 < measures['energy_excess_J'] < 1e-9


def test_a_push_ends_after_its_duration_to_the_nanosecond():
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push('torso', force=(100, 0, 0), duration=0.0123, start=0.0051))
        for _ in range(4):
            state = simulation.advance()
        momentum = conserved(FLIGHT, state).momentum
        assert momentum[0] == pytest.approx(100 * 0.0123, rel=1e-9)
        assert not simulation.pushes


def test_a_channels_next_push_takes_the_place_of_the_last():
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push('torso', force=(100, 0, 0), duration=1.0), channel='hand')
        simulation.advance()
        simulation.push(Push('torso', force=(0, 100, 0), duration=0.01), channel='hand')
        simulation.advance()
        state = simulation.advance()
        momentum = conserved(FLIGHT, state).momentum
        assert momentum == pytest.approx((1, 1, 0), abs=1e-6)


def test_pushes_on_nothing_in_the_past_or_too_many_are_refused():
    with Simulation(FLIGHT) as simulation:
        with pytest.raises(errors.UnknownBone, match='torso'):
            simulation.push(Push('tail', force=(1, 0, 0)))
        simulation.advance()
        with pytest.raises(errors.OutOfRange):
            simulation.push(Push('torso', start=0.0))
        for _ in range(MAX_PUSHES):
            simulation.push(Push('torso', duration=1))
        with pytest.raises(errors.OutOfRange, match=str(MAX_PUSHES)):
            simulation.push(Push('torso'))


@pytest.mark.parametrize('changes', [{'force': (math.nan, 0, 0)}, {'torque': (math.inf, 0, 0)},
                                     {'force': (1e300, 0, 0)}, {'duration': 0},
                                     {'duration': -1}, {'point': (0, math.nan, 0)}])
def test_a_push_that_is_rubbish_cannot_be_made(changes):
    with pytest.raises(errors.ModelError):
        Push('torso', **changes)

"""Held joints: a pendulum on a spring, as its equation has it; let go, it is as if never held."""
import dataclasses
import math

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.people import standing
from ragdoll_ros.physics.simulation import Simulation

SIZE, MASS = (0.1, 0.1, 0.4), 2.0
STIFFNESS, DAMPING, START = 8.0, 0.05, 0.3


def twin(kind='hinge'):
    """Two equal rods in line, free in space, on one joint at their common end."""
    rods = [Bone(name, Box(SIZE), MASS, (0, 0, z)) for name, z in (('low', -0.2), ('high', 0.2))]
    axes, limits = {'hinge': (((0, 1, 0),), ()), 'universal': (((0, 1, 0), (1, 0, 0)), ()),
                    'ball': (((0, 0, 1),), ((-1.4, 1.4), (-1.4, 1.4)))}[kind]
    joint = Joint('low', 'high', kind, (0, 0, 0), axes, limits)
    return Scene('twin', (Placement(Ragdoll('twin', tuple(rods), (joint,))),), gravity=(0, 0, 0))


def bent(simulation, angle):
    """Set the first angle, at rest."""
    start = simulation.coordinates
    q = start.q.copy()
    q[7] = angle
    simulation.place(GeneralizedState(q, start.v))


@pytest.mark.parametrize('kind', ['hinge', 'universal', 'ball'])
def test_a_held_pair_swings_as_its_equation_says(kind):
    """J a'' = -k a - c a' with J = I / 2: each rod turns by half the angle, and as nothing pushes,
    the centres keep their place across the rods: T = 2 (I/2) (a'/2)^2, to second order in a.
    """
    with Simulation(twin(kind), accuracy='exact') as simulation:
        amplitude = 0.01
        bent(simulation, amplitude)
        simulation.hold(simulation.scene.angle_names[0], STIFFNESS, DAMPING, target=0.0)
        inertia = MASS * (SIZE[0] ** 2 + SIZE[2] ** 2) / 12 / 2
        decay = DAMPING / (2 * inertia)
        pulse = math.sqrt(STIFFNESS / inertia - decay ** 2)
        for _ in range(50):
            state = simulation.advance()
            t = simulation.time / 1e9
            expected = amplitude * math.exp(-decay * t) * (
                math.cos(pulse * t) + decay / pulse * math.sin(pulse * t))
            # Steps of 1 ms and order 2: (pulse h)^2 / 12 = 5e-5 of the phase, here up to 12 rad.
            assert simulation.joint_angles[0] == pytest.approx(expected, abs=1e-3 * amplitude)
            assert (MASS * state.linear_velocities).sum(axis=0) == pytest.approx([0] * 3, abs=1e-12)
            assert abs(simulation.energy_excess) < 1e-9


def test_a_held_person_stands_and_falls_once_let_go():
    scene = load_scene('woman_faints')
    head = scene.bone_index('head')
    with Simulation(scene, accuracy='draft') as simulation:
        start = simulation.state.positions[head, 2]
        for angle, (stiffness, damping) in standing(scene.dolls[0].doll).items():
            simulation.hold(angle, stiffness, damping)
        assert [hold.angle for hold in simulation.holds] == list(scene.angle_names)
        while simulation.time < 1e9:
            simulation.advance()
        assert simulation.state.positions[head, 2] > 0.98 * start
        simulation.go_limp()
        assert simulation.holds == ()
        while simulation.time < 3e9:
            simulation.advance()
        assert simulation.state.positions[head, 2] < 0.3 * start


def test_once_let_go_a_joint_is_as_if_never_held():
    with Simulation(twin()) as held, Simulation(twin()) as free:
        bent(held, START)
        held.hold('high', STIFFNESS)
        for _ in range(10):
            held.advance()
        held.go_limp(['high'])
        free.place(held.coordinates)
        for _ in range(20):
            difference = held.advance().rows - free.advance().rows
            # Both fly from the same place: to the flights' own error.
            assert np.abs(difference).max() < 1e-9


def test_a_target_is_what_it_is_now_unless_told():
    with Simulation(twin()) as simulation:
        bent(simulation, START)
        simulation.hold('high', STIFFNESS, 1.0)
        for _ in range(50):
            simulation.advance()
        assert simulation.joint_angles[0] == pytest.approx(START, abs=1e-9)
        simulation.hold('high', STIFFNESS, 1.0, target=-0.2)
        for _ in range(200):
            simulation.advance()
        assert simulation.joint_angles[0] == pytest.approx(-0.2, abs=1e-4)
        assert simulation.reset() is not None and simulation.holds == ()


def test_what_can_not_be_held_is_refused():
    free = twin('ball')
    joint = dataclasses.replace(free.dolls[0].doll.joints[0], limits=(None, None))
    ball = dataclasses.replace(free.dolls[0].doll, joints=(joint,))
    free = dataclasses.replace(free, dolls=(Placement(ball),))
    with Simulation(twin()) as simulation:
        with pytest.raises(errors.UnknownJoint, match="'knee'; expected one of high"):
            simulation.hold('knee', 1.0)
        with pytest.raises(errors.UnknownJoint):
            simulation.go_limp(['knee'])
        for numbers in ((-1.0,), (math.nan,), (1.0, math.inf), (1.0, 0.0, math.nan)):
            with pytest.raises(errors.ModelError):
                simulation.hold('high', *numbers)
        assert simulation.holds == ()
    with Simulation(free) as simulation, pytest.raises(errors.WrongAxes):
        simulation.hold('high_x', 1.0)
    with Simulation(twin(), engine='bullet') as simulation, pytest.raises(
            errors.WrongForm, match='rigid'):
        simulation.hold('high', 1.0)

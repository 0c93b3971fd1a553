"""Contact steps are longer than the nominal one where that costs no accuracy, and only there."""
import dataclasses
import math

import numpy as np
import pytest
from loose_bodies import RADIUS, ball, box

from ragdoll_ros import Bone, Box, Ground, Joint, Placement, Push, Ragdoll, Scene
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Material
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.kernels.stepping.local_error import LONGEST_STEP, QUIET
from ragdoll_ros.physics.simulation import Simulation

pytest.importorskip('numba')

RATE, TAU = 3.0, 0.2
"""rad/s and s: the rate of the hinge between the plates at the start, and its time constant."""

INERTIA = 0.3 ** 2 / 6
"""kg m^2, of a plate about the hinge."""

AWAKE = {name: dataclasses.replace(accuracy, sleep=False) for name, accuracy in ACCURACIES.items()}


def plates():
    """Two plates on a vertical hinge with damping, the lower one on smooth ground, turn against
    each other: the rate of the hinge decays as exp(-t / TAU).
    """
    bones = tuple(Bone(name, Box((0.3, 0.3, 0.1)), 1.0, (0, 0, height))
                  for name, height in (('lower', 0.05), ('upper', 0.2)))
    joint = Joint('lower', 'upper', 'hinge', (0, 0, 0.1), ((0, 0, 1),), damping=INERTIA / 2 / TAU)
    return Scene('plates', (Placement(Ragdoll('plates', bones, (joint,)), position=(0, 0, 0),
                                      spin=(0, 0, -RATE / 2), rates={'upper': RATE}),),
                 Ground(), Material(friction=0.0))


def turned(accuracy, ticks):
    """Angle of the hinge, rad, after each tick, and the steps that each took."""
    with Simulation(plates(), accuracy=accuracy) as simulation:
        angles, steps, before = [], [], 0
        for _ in range(ticks):
            simulation.advance()
            angles.append(simulation.joint_angles[0])
            steps.append(simulation.ledger()['steps'] - before)
            before += steps[-1]
        return np.array(angles), np.array(steps), simulation.step


@pytest.mark.parametrize('name', ACCURACIES)
def test_a_decaying_turn_is_the_closed_form_within_the_sum_of_the_local_errors(name):
    accuracy, ticks = AWAKE[name], 300
    angles, steps, tick = turned(accuracy, ticks)
    expected = RATE * TAU * (1 - np.exp(-np.arange(1, ticks + 1) * tick / TAU))
    # Nominal steps: the midpoint rule's h^2 / 12 times what the acceleration changes by in all, and
    # twice that for damping taken implicitly; longer ones: what each may have.
    nominal = 3 * accuracy.step ** 2 / 12 * RATE / TAU
    longer = steps.sum() * QUIET * accuracy.step ** 2 / 12
    assert np.abs(angles - expected).max() < nominal + longer
    assert steps[1] == math.ceil(tick / accuracy.step), 'fast at first: no step is longer'
    assert (steps[-20:] == 1).all(), 'slow in the end: a tick is one step'


@pytest.mark.parametrize('name', ACCURACIES)
@pytest.mark.parametrize('scene', ['drop', 'woman_faints'])
def test_a_doll_that_lies_awake_takes_one_step_a_tick(scene, name):
    """A second later it is where it was."""
    with Simulation(load_scene(scene), accuracy=AWAKE[name]) as simulation:
        for _ in range(600):
            simulation.advance()
        before, lying = simulation.ledger()['steps'], simulation.state.positions.copy()
        for _ in range(100):
            simulation.advance()
        assert simulation.ledger()['steps'] - before < 1.5 * 100
        # What still settles after 6 s moves by less than a millimetre.
        assert np.abs(simulation.state.positions - lying).max() < 1e-3
        assert simulation.kinetic_energy < 1e-4


@pytest.mark.parametrize('name', ACCURACIES)
@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12, 40])
def test_a_push_on_what_lies_in_long_steps_acts_at_once(count, name):
    """Boxes at friction 1/2 that lie for a second, each pushed a little more: x = a t^2 / 2."""
    force = 8.0 + 0.5 * np.arange(count)
    scene = Scene('boxes', tuple(
        Placement(box((0.2, 0.2, 0.05), 1.0, f'box_{k}'), f'box_{k}', (0.0, 1.0 * k, 0.025))
        for k in range(count)), Ground(), Material(friction=0.5))
    with Simulation(scene, accuracy=AWAKE[name]) as simulation:
        for _ in range(100):
            simulation.advance()
        before = simulation.state.positions[:, 0].copy()
        for k in range(count):
            simulation.push(Push(scene.bone_names[k], force=(float(force[k]), 0, 0), duration=0.3,
                                 point=(0.0, 0.0, -0.025)))
        for _ in range(30):
            simulation.advance()
        gone = simulation.state.positions[:, 0] - before
    # Coulomb friction, and no torque about the edges: the force acts in the ground's plane. Up to
    # 10 um of what settles under another pressure.
    assert gone == pytest.approx((force - 0.5 * 9.8) * 0.3 ** 2 / 2, abs=1e-5)


def test_no_step_is_longer_than_the_longest():
    scene = dataclasses.replace(plates(), step=0.05)
    with Simulation(scene, accuracy=AWAKE['draft']) as simulation:
        for _ in range(100):
            simulation.advance()
        before = simulation.ledger()['steps']
        for _ in range(10):
            simulation.advance()
        assert simulation.ledger()['steps'] - before == 10 * math.ceil(0.05 / LONGEST_STEP)


@pytest.mark.parametrize('name', ACCURACIES)
def test_what_meets_slowly_in_a_long_step_is_no_deeper_than_in_a_nominal_one(name):
    """A ball slides at 15 mm/s on smooth ground against a post, at any part of a tick."""
    for gap in np.linspace(1.3e-3, 1.45e-3, 7):
        scene = Scene('post', (
            Placement(ball(), 'ball', (0.0, 0.0, RADIUS), velocity=(0.015, 0, 0)),
            Placement(box((0.2, 0.2, 0.4), 1e4, 'post'), 'post', (RADIUS + gap + 0.1, 0.0, 0.2))),
            Ground(), Material(friction=0.0, restitution=0.0))
        with Simulation(scene, accuracy=AWAKE[name]) as simulation:
            before, x = simulation.ledger()['steps'], simulation.run(8)[-1, 0, 0]
            assert simulation.ledger()['steps'] - before < 8 * simulation.step / AWAKE[name].step
            deepest = max(x - gap, (simulation.run(6)[:, 0, 0] - gap).max())
            # As far as it moves in a nominal step, and what counts as touching.
            assert deepest < 0.015 * AWAKE[name].step + AWAKE[name].touching

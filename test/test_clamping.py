"""Forces that last, told apart from impacts."""
import math

import pytest
from loose_bodies import WEIGHTLESS, ball, box

from ragdoll_ros import Box, Ground, Placement, Push, Scene, Simulation, StaticBody
from ragdoll_ros.model.biomechanical_limits import BiomechanicalLimits, BodyRegion
from ragdoll_ros.model.scene import Material
from ragdoll_ros.physics.sensors.clamping import ClampingMonitor

pytest.importorskip('numba')

G = 9.8
LIMITS = BiomechanicalLimits('of this test', {'back': BodyRegion(50, 100, 3e4, ('lying',))})


def clamped_after(simulation, ticks, monitor, push=None):
    """What is clamped after each of so many ticks, under a push that is renewed each tick."""
    found = []
    for _ in range(ticks):
        if push:
            simulation.push(Push(**push, duration=0.01))
        simulation.advance()
        monitor.add(simulation.contacts, simulation.time)
        found.append(monitor.clamped)
    return found


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
def test_a_weight_is_a_force_once_it_has_lasted(engine):
    """A box that lies with 5 kg on it: 7 kg from the ground, 5 kg from above."""
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    scene = Scene('pile', (Placement(box((0.3, 0.3, 0.1), 2.0, 'lying'), 'low', (0, 0, 0.05)),
                           Placement(box((0.2,) * 3, 5.0, 'load'), 'high', (0, 0, 0.2))),
                  Ground(), Material(restitution=0))
    with Simulation(scene, engine=engine) as simulation:
        found = clamped_after(simulation, 80, ClampingMonitor(scene, LIMITS))
    assert not any(found[:49])
    last = {(one.bone, one.against): one for one in found[-1]}
    assert set(last) == {('low/lying', 'ground'), ('low/lying', 'high/load'),
                         ('high/load', 'low/lying')}
    ground, above = last['low/lying', 'ground'], last['low/lying', 'high/load']
    # MuJoCo's contacts are springs, which swing a little; PyBullet's tremble.
    rel = 1e-3 if engine == 'rigid' else 0.03
    assert (ground.force, above.force) == pytest.approx((7 * G, 5 * G), rel=rel)
    assert (ground.region, ground.doll, ground.ratio) == ('back', 'low', ground.force / 50)
    other = last['high/load', 'low/lying']
    assert other.region == '' and math.isnan(other.ratio) and other.force == above.force


def test_what_is_pressed_against_a_wall_has_a_force_until_it_leaves():
    scene = Scene('wall', (Placement(ball('lying', 2.0), 'person', (0, 0, 0)),), None,
                  Material(restitution=0), gravity=WEIGHTLESS,
                  bodies=(StaticBody('wall', Box((0.2, 1, 1)), (0.2, 0, 0)),))
    monitor = ClampingMonitor(scene, LIMITS)
    with Simulation(scene) as simulation:
        pressed = clamped_after(simulation, 70, monitor, {'bone': 'lying', 'force': (80, 0, 0)})
        one, = pressed[-1]
        assert (one.against, one.force, one.ratio) == (
            'wall', pytest.approx(80, rel=1e-3), pytest.approx(1.6, rel=1e-3))
        away = clamped_after(simulation, 5, monitor, {'bone': 'lying', 'force': (-80, 0, 0)})
        assert away[-1] == ()


def test_a_ball_that_bounces_is_not_clamped():
    scene = Scene('bounce', (Placement(ball('lying', 1.0), 'person', (0, 0, 0.5)),), Ground(),
                  Material(restitution=0.9))
    with Simulation(scene) as simulation:
        assert not any(clamped_after(simulation, 200, ClampingMonitor(scene, LIMITS)))

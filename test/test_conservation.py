"""Conservation: of momentum in the air, and of energy, by what is told and in a simulation."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from conserved import conserved
from oracles import PLAIN
from samples import MANY, SCENES, each_tree, layout_of, random_coordinates, random_state

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.engine.doll_totals import DollSums
from ragdoll_ros.physics.engine.protocol import AppliedWrench
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine
from ragdoll_ros.physics.engine.substepped.conservation import ConservationProjection
from ragdoll_ros.physics.engine.substepped.energy_account import EnergyAccount
from ragdoll_ros.physics.rigid_body import GroundHeights
from ragdoll_ros.physics.simulation import Simulation

BALL = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0.0, 0.0, 0.0)),))


def projection_of(scene):
    """Who keeps a scene's account."""
    return ConservationProjection(scene, layout_of(scene))


def whole(scene, coordinates):
    """State of the bones for coordinates."""
    states = [tree.state(q, v) for tree, q, v in each_tree(scene, coordinates)]
    return State(*(np.concatenate([getattr(state, field) for state in states])
                   for field in ('positions', 'orientations', 'linear_velocities',
                                 'angular_velocities')))


@pytest.mark.parametrize('touched', [(), (0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize('given', ['nothing', 'torque', 'force'])
def test_dolls_in_the_air_get_the_momentum_that_is_due(given, touched):
    """Weight, and impulse and moment of a push on the second doll, of 0.01 s, a way at their mean.

    What touched stays as it is, and so does angular momentum where a force acts.
    """
    scene, rng = MANY, np.random.default_rng(4)
    start, little = random_coordinates(scene, 1), 1e-3 * rng.normal(size=(2, 200))
    was, end = whole(scene, start), dataclasses.replace(
        start, q=layout_of(scene).normalized(start.q + little[0, :len(start.q)]),
        v=start.v + little[1, :len(start.v)])
    now, bone = whole(scene, end), scene.bone_slices[1].start + 3
    force, torque = np.zeros(3), np.zeros(3)
    if given != 'nothing':
        torque = rng.normal(size=3)
    if given == 'force':
        force = rng.normal(size=3)
    found = whole(scene, projection_of(scene).with_momentum(
        end, (was, now), .01, [AppliedWrench(bone, force, torque, rng.normal(size=3))],
        np.isin(np.arange(3), touched)))
    for doll in range(3):
        first, here, last = (conserved(scene, state, doll) for state in (was, now, found))
        momentum = first.momentum + .01 * (force * (doll == 1) + first.mass * np.array(
            scene.gravity))
        centre = first.centre + .01 * (first.momentum + momentum) / 2 / first.mass
        spin = first.angular_momentum + .01 * torque * (doll == 1)
        if given == 'force' or doll in touched:
            spin = here.angular_momentum
        if doll in touched:
            momentum, centre = here.momentum, here.centre
        assert last.momentum == pytest.approx(momentum, rel=1e-12, abs=1e-11)
        assert last.centre == pytest.approx(centre, abs=1e-12)
        assert last.angular_momentum == pytest.approx(spin, rel=1e-11, abs=1e-10)


@pytest.mark.parametrize('scene', [SCENES['doll'], SCENES['every_kind']],
                         ids=['doll', 'every_kind'])
@pytest.mark.parametrize(('joints', 'touched'), [('moving', False), ('moving', True),
                                                 ('still', False), ('still', True)])
def test_surplus_energy_is_taken_from_the_joints_first(scene, joints, touched):
    """Momentum and angular momentum stay; from joints that stand still there is nothing to take.

    Then, in the air, the rotation gives it, and its axis stays; near something, all motion does.
    """
    start = random_coordinates(scene, 3)
    if joints == 'still':
        start.v[6:] = 0.0
    projection, state = projection_of(scene), whole(scene, start)
    before, account = conserved(scene, state), EnergyAccount.opened(np.zeros(1))
    after = conserved(scene, whole(scene, projection.without_surplus(
        start, DollSums(scene).totals(state), np.array([2.0]), np.array([touched]), account)))
    assert after.energy == pytest.approx(before.energy - 2.0, abs=1e-9)
    assert account.taken == pytest.approx(2.0, abs=1e-9)
    left = 1.0
    if joints == 'still' and touched:
        left = math.sqrt(1 - 2.0 / before.kinetic)
    assert after.momentum == pytest.approx(left * before.momentum, abs=1e-9)
    if joints == 'still' and not touched:
        assert np.cross(after.angular_momentum, before.angular_momentum) == pytest.approx(
            (0, 0, 0), abs=1e-9)
    else:
        assert after.angular_momentum == pytest.approx(left * before.angular_momentum, abs=1e-9)


def test_what_is_lost_is_lost_and_work_is_added():
    """The surplus is what is above the lowest energy so far and the work since, but 0.05 %."""
    scene, state = SCENES['doll'], random_state(SCENES['doll'], 1)
    projection = projection_of(scene)
    motion, apart = DollSums(scene).totals(state), projection.groups(set())
    account = EnergyAccount.opened(motion.energy)
    begun = projection.surplus(account, motion, apart)
    assert -1e-3 * (motion.kinetic + 55 * 9.8) < begun < 0
    lower = DollSums(scene).totals(state)
    lower.energy[:] -= 100.0
    projection.close_step(account, lower, apart)
    assert projection.surplus(account, motion, apart) == pytest.approx(begun + 100.0, abs=1e-9)
    account.add_work(0, 30.0, by_hand=False)
    assert projection.surplus(account, motion, apart) == pytest.approx(begun + 70.0, abs=0.05)


def test_dolls_that_touch_share_what_is_too_much_by_their_energies():
    """A light one loses as large a share of its motion as a heavy one."""
    projection = projection_of(MANY)
    motion = DollSums(MANY).totals(random_state(MANY, 1))
    account = EnergyAccount.opened(motion.energy - (50, 0, 0))
    pair = projection.surplus(account, motion, projection.groups({(0, 2)}))
    alone = projection.surplus(account, motion, projection.groups(set()))
    assert pair[1] == pytest.approx(alone[1]) and pair[1] < 0
    assert pair[[0, 2]].sum() == pytest.approx(alone[[0, 2]].sum())
    assert pair[0] / motion.kinetic[0] == pytest.approx(pair[2] / motion.kinetic[2])


def test_a_light_ball_that_hits_the_doll_goes_on():
    """10 g at 5 m/s, thrown off or down: within a second it is on the ground, not in the air."""
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.05), 0.01, (0, 0, 0)),))
    scene = Scene('hit', (Placement(load_doll('doll')),
                          Placement(ball, position=(2, 0, 1.1), velocity=(-5, 0, 0.6))), Ground())
    with Simulation(scene, engine='bullet') as simulation:
        lowest = min(simulation.advance().positions[-1, 2] for _ in range(150))
    assert lowest < 0.06


def test_without_an_account_nothing_is_corrected():
    """PyBullet's own step falls by g t (t + h) / 2; with the account by g t^2 / 2."""
    scene = load_scene('drop')
    scene = dataclasses.replace(scene, dolls=(Placement(scene.dolls[0].doll),))
    ways = []
    for energy in (False, True):
        engine = BulletEngine(scene, dataclasses.replace(PLAIN, energy=energy))
        before = engine.state.positions[0, 2]
        for _ in range(10):
            engine.advance(.01)
        ways.append(before - engine.state.positions[0, 2])
        engine.close()
    assert ways == pytest.approx([4.9 * .1 * .11, 4.9 * .1 ** 2], abs=1e-9)


def check_weight_alone(scene, before, after, doll=0):
    """From tick to tick a doll's momentum grows by M g h, and its angular momentum stays."""
    first, last = conserved(scene, before, doll), conserved(scene, after, doll)
    due = first.mass * np.array(scene.gravity) * scene.step
    assert last.momentum - first.momentum == pytest.approx(due, abs=1e-9)
    assert last.angular_momentum == pytest.approx(first.angular_momentum, abs=1e-9)


@pytest.mark.parametrize('engine', ['auto', 'bullet'])
def test_momentum_is_kept_in_the_air_beside_the_ground(engine):
    """Spun fast, limbs lean on their limits: only gravity acts while no bone can be at the ground.

    A bone's lowest point cannot have gone down and up again if it is farther off at both ends
    than the way of its fastest point.
    """
    scene = load_scene('drop')
    doll = dataclasses.replace(scene.dolls[0], spin=(3.0, 20.0, 5.0))
    scene = dataclasses.replace(scene, dolls=(doll,))
    sizes = np.array([math.hypot(*bone.shape.half_extents) for bone in scene.bones])
    heights = GroundHeights(scene)
    with Simulation(scene, engine=engine) as simulation:
        before, checked = simulation.state, 0
        for _ in range(250):
            state = simulation.advance()
            fastest = max((np.linalg.norm(each.linear_velocities, axis=1)
                           + np.linalg.norm(each.angular_velocities, axis=1) * sizes).max()
                          for each in (before, state))
            room = sum(heights(each) for each in (before, state)).min()
            if room > 1.2 * fastest * scene.step:
                check_weight_alone(scene, before, state)
                checked += 1
            before = state
    assert checked > 30


@pytest.mark.parametrize('engine', ['auto', 'bullet'])
def test_momentum_is_kept_in_the_air_while_others_lie_on_the_ground(engine):
    scene = load_scene('drop')
    spun = dataclasses.replace(scene.dolls[0], position=(0.0, 0.0, 30.0), spin=(3.0, 20.0, 5.0))
    ball = Placement(BALL, position=(20.0, 0.0, 0.1))
    scene = dataclasses.replace(scene, dolls=(ball, spun))
    with Simulation(scene, engine=engine) as simulation:
        before = simulation.state
        for _ in range(100):
            after = simulation.advance()
            check_weight_alone(scene, before, after, 1)
            assert np.abs(conserved(scene, after, 0).momentum).max() < 1e-3
            before = after


def overlapping(count, seed, height, velocity):
    """So many loose boxes of random sizes, masses and poses, one within the other, no ground."""
    draw = np.random.default_rng(seed)
    boxes, up = [], np.array((0.0, 0.0, 1.0))
    for number in range(count):
        q = draw.normal(size=4)
        shape, mass = Box(tuple(draw.uniform(0.1, 0.25, 3))), draw.uniform(1, 8)
        box = Ragdoll(f'box_{number}', (Bone('box', shape, mass, (0.0, 0.0, 0.0)),))
        boxes.append(Placement(box, position=height * up + draw.uniform(-0.15, 0.15, 3),
                               orientation=tuple(q / np.linalg.norm(q)), velocity=velocity,
                               name=f'box_{number}'))
    return dataclasses.replace(load_scene('drop'), dolls=tuple(boxes), ground=None)


def sums(scene, state):
    """Energy, and momentum and angular momentum about the origin, of all dolls."""
    each = [conserved(scene, state, doll) for doll in range(len(scene.dolls))]
    return (sum(one.energy for one in each), sum(one.momentum for one in each),
            sum(one.angular_momentum + np.cross(one.centre, one.momentum) for one in each))


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
@pytest.mark.parametrize('count', [2, 3, 5, 8])
def test_free_bodies_that_begin_within_each_other_gain_nothing(count, accuracy):
    """At 5 m/s sideways they are moved apart as at rest: no energy comes of it, and momentum and
    angular momentum about any point stay, but for the weight.

    Rounding of sums of some 500 J, N s and N m s in 30 ticks: 1e-10 each.
    """
    scene = overlapping(count, count, 3.0, (5.0, 0.0, 0.0))
    mass = sum(placement.doll.mass for placement in scene.dolls)
    with Simulation(scene, engine='rigid', accuracy=accuracy) as simulation:
        assert simulation.initial_overlaps
        energy, momentum, turning = sums(scene, simulation.state)
        centre = sum(one.mass * one.centre for one in (
            conserved(scene, simulation.state, k) for k in range(count))) / mass
        for tick in range(1, 31):
            now, moved, turned = sums(scene, simulation.advance())
            t, weight = tick * scene.step, mass * np.array(scene.gravity)
            assert now <= energy + 1e-9
            assert moved == pytest.approx(momentum + t * weight, abs=1e-9)
            arm = centre * t + momentum / mass * t * t / 2
            assert turned == pytest.approx(turning + np.cross(arm, weight), abs=1e-8)
            energy = min(energy, now)

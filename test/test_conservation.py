"""Conservation: of momentum in the air, and of energy, by what is told and in a simulation."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from conserved import conserved
from samples import MANY, SCENES, each_tree, layout_of, random_coordinates, random_state

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Placement
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.physics import kernels
from ragdoll_ros.physics.engine.bullet import BulletEngine
from ragdoll_ros.physics.plain.conservation import ConservationProjection
from ragdoll_ros.physics.plain.mechanics import Mechanics
from ragdoll_ros.physics.plain.reach import Reach
from ragdoll_ros.physics.settings import NORMAL
from ragdoll_ros.physics.simulation import Simulation

FLIGHT = load_scene('flight')
BALL = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0.0, 0.0, 0.0)),))
WITH_A_PLATE = list(SCENES.values())[-1]


@pytest.fixture(params=['plain', 'compiled'])
def make(request):
    """Who keeps the momentum of a scene, and the sums it goes by."""
    if request.param == 'plain':
        return ConservationProjection, Mechanics
    if not kernels.ready():
        pytest.skip('nothing is compiled here')
    from ragdoll_ros.physics.conservation import CompiledMechanics, CompiledProjection
    return CompiledProjection, CompiledMechanics


def kept(make, scene, was, now, touched, *given):
    """What ``make`` gives for the state ``now``, 0.01 s after ``was``."""
    conservation, sums = make[0], make[1](scene)
    return conservation(scene, sums, layout_of(scene)).keep_momentum(
        now, sums.motion(was), sums.motion(now), .01, *given, touched=touched)


@pytest.mark.parametrize('touched', [None, (), (0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize('moment', ['none', 'zero', 'given'])
@pytest.mark.parametrize('scene', [MANY, WITH_A_PLATE], ids=['dolls', 'with_a_plate'])
def test_dolls_in_the_air_get_the_momentum_that_is_due(make, scene, moment, touched):
    """Weight, impulse and moment of 0.01 s, a way at their mean; what touched stays as it is.

    A plate is turned, by 0.01 rad at the most: so its states are next to each other. Compiled and
    by numpy it is the same to rounding.
    """
    rng = np.random.default_rng(4)
    was, little = random_state(scene, 1), 1e-3 * rng.normal(size=(4, len(scene.bones), 1))
    now = State(was.positions + little[0], rotation.normalized(was.orientations + little[1]),
                was.linear_velocities + little[2], was.angular_velocities + little[3])
    impulse, turning = rng.normal(size=(2, len(scene.dolls), 3)) * (moment != 'zero')
    given = () if moment == 'zero' else (impulse, turning if moment == 'given' else None)
    chosen = None if touched is None else np.isin(np.arange(len(scene.dolls)), touched)
    found, told, turn = kept(make, scene, was, now, chosen, *given)
    for doll in range(len(scene.dolls)):
        first, here, last = (conserved(scene, state, doll) for state in (was, now, found))
        momentum = first.momentum + impulse[doll] + .01 * first.mass * np.array(scene.gravity)
        centre = first.centre + .01 * (first.momentum + momentum) / 2 / first.mass
        spin = first.angular_momentum + turning[doll]
        if moment == 'none' or doll in (touched or ()):
            spin = here.angular_momentum
        if doll in (touched or ()):
            momentum, centre = here.momentum, here.centre
        assert last.momentum == pytest.approx(momentum, rel=1e-12, abs=1e-12)
        assert last.centre == pytest.approx(centre, abs=1e-13)
        assert last.angular_momentum == pytest.approx(spin, rel=1e-12, abs=1e-11)
        # And what is told of the motion is that of the bones.
        for name in ('energy', 'kinetic', 'centre', 'momentum', 'angular_momentum', 'inertia'):
            assert getattr(told, name)[doll] == pytest.approx(getattr(last, name), rel=1e-12,
                                                              abs=1e-11), name
    plain, _, plain_turn = kept((ConservationProjection, Mechanics), scene, was, now, chosen,
                                *given)
    for name in ('positions', 'orientations', 'linear_velocities', 'angular_velocities'):
        assert getattr(found, name) == pytest.approx(getattr(plain, name), abs=1e-12)
    # A turn by nothing is none; the plain one may tell of it.
    nothing = np.tile(rotation.IDENTITY, (len(scene.dolls), 1))
    turns = [nothing if one is None else one for one in (turn, plain_turn)]
    assert np.abs(turns[0] - turns[1]).max() < 1e-14


@pytest.mark.parametrize('scene', [SCENES['doll'], SCENES['every_kind']],
                         ids=['doll', 'every_kind'])
@pytest.mark.parametrize(('joints', 'touched'), [('moving', False), ('moving', True),
                                                 ('still', False), ('still', True)])
def test_surplus_energy_is_taken_from_the_joints_first(make, scene, joints, touched):
    """Momentum and angular momentum stay; from joints that stand still there is nothing to take.

    Then, in the air, the rotation gives it, and its axis stays; near something, all motion does.
    """
    engine, start = BulletEngine(scene, free=True), random_coordinates(scene, 3)
    if joints == 'still':
        start.v[6:] = 0.0
    conservation = make[0](scene, make[1](scene), engine.layout)

    def placed(coordinates):
        engine.place(coordinates)
        return engine.read()

    state = placed(start)
    before = conserved(scene, state)
    conservation.open(state)
    after = conserved(scene, placed(conservation.without_surplus(
        start, start, make[1](scene).motion(state), np.array([2.0]), touched)))
    engine.close()
    assert after.energy == pytest.approx(before.energy - 2.0, abs=1e-9)
    assert conservation.budget.taken == pytest.approx(2.0, abs=1e-9)
    left = 1.0
    if joints == 'still' and touched:
        left = math.sqrt(1 - 2.0 / before.kinetic)
    assert after.momentum == pytest.approx(left * before.momentum, abs=1e-9)
    if joints == 'still' and not touched:
        assert np.cross(after.angular_momentum, before.angular_momentum) == pytest.approx(
            (0, 0, 0), abs=1e-9)
    else:
        assert after.angular_momentum == pytest.approx(left * before.angular_momentum, abs=1e-9)


def test_what_is_lost_is_lost_and_work_is_added(make):
    """The surplus is what is above the lowest energy so far and the work since, but 0.05 %."""
    scene, state = SCENES['doll'], random_state(SCENES['doll'], 1)
    sums = make[1](scene)
    conservation, motion = make[0](scene, sums, layout_of(scene)), sums.motion(state)
    conservation.open(state)
    apart = conservation.groups(set())
    begun = conservation.surplus(motion, apart)
    assert -1e-3 * (motion.kinetic + 55 * 9.8) < begun < 0
    conservation.close_step(motion.energy - 100.0, apart)
    assert conservation.surplus(motion, apart) == pytest.approx(begun + 100.0, abs=1e-9)
    conservation.close_step(motion.energy, apart)
    assert conservation.surplus(motion, apart) == pytest.approx(begun + 100.0, abs=1e-9)
    conservation.add_work(np.array([30.0]))
    assert conservation.surplus(motion, apart) == pytest.approx(begun + 70.0, abs=0.05)


def test_a_doll_that_bursts_is_stopped_where_it_was(make):
    """And no other: it has 2 % of its energy from nothing, and more, which is counted."""
    sums = make[1](MANY)
    conservation = make[0](MANY, sums, layout_of(MANY))
    state, start, end = random_state(MANY, 1), *(random_coordinates(MANY, k) for k in (1, 2))
    motion = sums.motion(state)
    conservation.open(state)
    apart = conservation.groups(set())
    assert not conservation.burst(motion, apart).any()
    conservation.close_step(motion.energy - (0, .05, .01) * motion.kinetic, apart)
    burst = conservation.burst(motion, apart)
    assert burst.tolist() == [False, True, False]
    found = conservation.stopped(start, end, burst)
    sizes = [(len(q), len(v)) for _, q, v in each_tree(MANY, start)]
    q, v = (np.repeat(burst, [size[k] for size in sizes]) for k in range(2))
    assert (found.q == np.where(q, start.q, end.q)).all()
    assert (found.v == np.where(v, 0.0, end.v)).all()
    assert conservation.budget.stops == 1


def check_weight_alone(scene, before, after, doll=0):
    """From tick to tick a doll's momentum grows by M g h, and its angular momentum stays."""
    first, last = conserved(scene, before, doll), conserved(scene, after, doll)
    due = first.mass * np.array(scene.gravity) * scene.step
    assert last.momentum - first.momentum == pytest.approx(due, abs=1e-9)
    assert last.angular_momentum == pytest.approx(first.angular_momentum, abs=1e-9)


def test_momentum_is_kept_in_the_air_beside_the_ground():
    """Spun fast, limbs lean on their limits: only gravity acts while no bone can be at the ground.

    A bone's lowest point cannot have gone down and up again if it is farther off at both ends
    than the way of its fastest point.
    """
    scene = load_scene('drop')
    doll = dataclasses.replace(scene.dolls[0], spin=(3.0, 20.0, 5.0))
    scene = dataclasses.replace(scene, dolls=(doll,))
    lowest = Reach(scene).heights
    sizes = np.array([math.hypot(*bone.shape.half_extents) for bone in scene.bones])
    with Simulation(scene) as simulation:
        before, checked = simulation.state, 0
        for _ in range(250):
            state = simulation.advance()
            fastest = max((np.linalg.norm(each.linear_velocities, axis=1)
                           + np.linalg.norm(each.angular_velocities, axis=1) * sizes).max()
                          for each in (before, state))
            if (lowest(before) + lowest(state)).min() > 1.2 * fastest * scene.step:
                check_weight_alone(scene, before, state)
                checked += 1
            before = state
    assert checked > 30


def test_momentum_is_kept_in_the_air_while_others_lie_on_the_ground():
    scene = load_scene('drop')
    spun = dataclasses.replace(scene.dolls[0], position=(0.0, 0.0, 30.0), spin=(3.0, 20.0, 5.0))
    ball = Placement(BALL, position=(20.0, 0.0, 0.1))
    scene = dataclasses.replace(scene, dolls=(ball, spun))
    with Simulation(scene) as simulation:
        before, rested = simulation.state, 0
        for _ in range(100):
            after = simulation.advance()
            check_weight_alone(scene, before, after, 1)
            assert np.abs(conserved(scene, after, 0).momentum).max() < 1e-3
            before, rested = after, rested + bool(simulation.stats.substeps)
    assert rested > 50


def test_a_step_that_is_done_again_begins_where_the_first_one_did():
    """The doll falls as a whole, whatever its joints do: from a false start it would fall twice."""
    rng = np.random.default_rng(3)
    often = dataclasses.replace(NORMAL, order=0, momentum=False, redo=1e-6)
    with Simulation(FLIGHT, accuracy=often) as simulation:
        v = np.zeros_like(simulation.coordinates.v)
        v[:3], v[6:] = (1.0, 2.0, 3.0), rng.uniform(-8, 8, len(v) - 6)
        simulation.place(GeneralizedState(simulation.coordinates.q, v))
        before = conserved(FLIGHT, simulation.state)
        for _ in range(20):
            simulation.advance()
        after = conserved(FLIGHT, simulation.state)
        assert simulation.measures()['redone_total'] > 10
    way = before.momentum / before.mass * 0.2
    # The engine's own error of the momentum, of order 1, is 1 % of the way here.
    assert after.centre - before.centre == pytest.approx(way, abs=0.03)

"""MuJoCo's doll against equations of motion of our own, and against PyBullet's."""
import dataclasses

import numpy as np
import pytest

pytest.importorskip('mujoco')

from oracles import PLAIN, bullet_acceleration, mujoco_acceleration, unlimited
from samples import GRAVITY, every_kind, random_coordinates

from ragdoll_ros.accuracy.methods import mujoco, run
from ragdoll_ros.accuracy.motions.contact import bounce
from ragdoll_ros.accuracy.references.articulated import Articulated
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.mjcf import damping_ratio
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.engine.protocol import GROUND, AppliedWrench
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine
from ragdoll_ros.physics.engine.substepped.mujoco import MujocoEngine

ENGINES = [BulletEngine, MujocoEngine]


def flying(doll):
    return unlimited(Scene('flying', (Placement(doll),), gravity=GRAVITY, self_collision=False))


DOLLS = [load_doll('doll'), every_kind()]
EVERY = [pytest.param(doll, seed, id=f'{doll.name}-{seed}') for doll in DOLLS for seed in range(3)]


@pytest.mark.parametrize('engine', ENGINES)
@pytest.mark.parametrize(('doll', 'seed'), EVERY)
def test_poses_and_velocities_are_those_of_the_tree(engine, doll, seed):
    """Forward kinematics of three independent programs; 1e-7 rad is the root of rounding."""
    simulated = engine(flying(doll), PLAIN)
    placed = random_coordinates(flying(doll), seed, bend=.4)
    simulated.set_coordinates(placed)
    back = simulated.coordinates
    sign = np.sign(back.q[3:7] @ placed.q[3:7])
    back.q[3:7] *= sign
    assert np.abs(back.q - placed.q).max() < 1e-12
    assert np.abs(back.v - placed.v).max() < 1e-12
    state, truth = simulated.state, Articulated(doll).state(placed.q, placed.v)
    assert np.abs(state.positions - truth.positions).max() < 1e-12
    assert rotation.angle_between(state.orientations, truth.orientations).max() < 1e-7
    assert np.abs(state.linear_velocities - truth.linear_velocities).max() < 1e-11
    assert np.abs(state.angular_velocities - truth.angular_velocities).max() < 1e-11


@pytest.mark.parametrize(('engine', 'acceleration'), [
    (BulletEngine, bullet_acceleration), (MujocoEngine, mujoco_acceleration)])
@pytest.mark.parametrize(('doll', 'seed'), EVERY)
def test_engines_accelerate_as_the_equations_of_motion_say(engine, acceleration, doll, seed):
    """Measured: 1e-10 of the largest for PyBullet, 1e-12 for MuJoCo."""
    placed = random_coordinates(flying(doll), seed, bend=.4)
    truth = Articulated(doll, GRAVITY).acceleration(placed.q, placed.v)
    found = acceleration(engine(flying(doll), PLAIN), placed)
    assert np.abs(found - truth).max() < 1e-8 * np.abs(truth).max()


def test_a_push_acts_at_its_point_for_one_step():
    """Impulse and moment of momentum about the centre, against F h and r x F h; then no more."""
    doll = Ragdoll('box', (Bone('box', Box((.1, .2, .3)), 2.0, (0, 0, 0)),))
    engine = MujocoEngine(dataclasses.replace(flying(doll), gravity=(0, 0, 0)), PLAIN)
    force, point = np.array([0, 4.0, 0]), np.array([0, 0, .1])
    load = AppliedWrench(0, force, np.array([0, 0, .5]), point)
    engine.advance(1e-3, [load])
    state = engine.state
    assert state.linear_velocities[0] == pytest.approx(force * 1e-3 / 2, abs=1e-12)
    moment = np.array([0, 0, .5]) + np.cross(point, force)
    assert state.angular_velocities[0] * doll.bones[0].inertia == pytest.approx(moment * 1e-3,
                                                                                abs=1e-8)
    engine.advance(1e-3)
    assert engine.state.linear_velocities[0] == pytest.approx(state.linear_velocities[0],
                                                              abs=1e-12)


def test_a_ball_rests_on_a_tilted_ground_and_tells_of_it():
    """Contact: normal out of the ground, index GROUND, weight as force, the point on the ball."""
    ground = Ground(normal=(.6, 0, .8), offset=1.0)
    ball = Ragdoll('ball', (Bone('ball', Sphere(.1), 2.0, (0, 0, 0)),))
    normal = np.array(ground.normal)
    scene = Scene('rest', (Placement(ball, position=normal * 1.1),), ground,
                  Material(restitution=0), gravity=-9.8 * normal)
    engine = MujocoEngine(scene, NORMAL)
    engine.advance(1.0)
    assert engine.dolls_on_ground().all()
    found = engine.contacts()
    assert (found.a, found.b) == ([0], [GROUND])
    assert found.normals == pytest.approx(normal[None], abs=1e-9)
    assert found.forces == pytest.approx([2 * 9.8], rel=1e-3)
    assert found.positions[0] == pytest.approx(normal * (1.1 - .1), abs=1e-3)


@pytest.mark.parametrize('engine', ENGINES)
@pytest.mark.parametrize(('shape', 'beside'), [(Sphere(.1), 0.0), (Box((.2, .2, .2)), .1)])
def test_a_contact_lies_on_its_first_bone_however_deep(engine, shape, beside):
    """Under a ball's middle and a box's corners."""
    doll = Ragdoll('doll', (Bone('bone', shape, 2.0, (0, 0, 0)),))
    deep = engine(Scene('deep', (Placement(doll, position=(0, 0, .098)),), Ground()), PLAIN)
    found = deep.contacts()
    assert len(found)
    assert np.abs(found.positions[:, :2]) == pytest.approx(beside, abs=1e-6)
    assert found.positions[:, 2] == pytest.approx(-.002, abs=1e-6)
    assert found.depths == pytest.approx(.002, abs=1e-6)


def test_jointed_and_overlapping_pairs_do_not_collide():
    """Three boxes in one another, two of them jointed: at rest they stay where they are."""
    bones = tuple(Bone(name, Box((.2, .2, .2)), 1.0, (x, 0, 0))
                  for name, x in (('a', 0), ('b', .15), ('c', .3)))
    joints = (Joint('a', 'b', 'fixed', (.1, 0, 0)), Joint('b', 'c', 'hinge', (.2, 0, 0),
                                                          ((0, 0, 1),)))
    doll = Ragdoll('heap', (*bones, Bone('d', Box((.2, .2, .2)), 1.0, (.1, .1, 0))),
                   (*joints, Joint('c', 'd', 'hinge', (.2, .05, 0), ((0, 0, 1),))))
    engine = MujocoEngine(Scene('heap', (Placement(doll),), gravity=(0, 0, 0)), NORMAL)
    engine.advance(.5)
    assert not engine.contacts()
    assert np.abs(engine.state.linear_velocities).max() == 0


@pytest.mark.parametrize('engine', ENGINES)
def test_a_snapshot_brings_back_every_bit(engine):
    engine = engine(load_scene('drop'), NORMAL)
    push = [AppliedWrench(0, np.array([100.0, 20, 0]), np.zeros(3), np.zeros(3))]
    engine.advance(.1, push)
    snapshot, ends, told = engine.save(), [], []
    for _ in range(2):
        engine.advance(.5, push)
        ends.append(engine.state.rows)
        told.append(engine.measures())
        engine.restore(snapshot)
    engine.close()
    assert (ends[0] == ends[1]).all()
    assert told[0] == told[1] and told[0]['work_of_pushes_J'] > 0


def test_a_limit_holds_a_swinging_bone():
    """The forearm, flung at its limit, stays within MuJoCo's soft margin of some degrees."""
    doll = load_doll('doll')
    engine = MujocoEngine(Scene('slam', (Placement(doll),), gravity=(0, 0, 0)), NORMAL)
    start = engine.coordinates
    elbow = Scene('slam', (Placement(doll),)).angle_names.index('left_forearm')
    start.v[6 + elbow] = 5.0
    engine.set_coordinates(start)
    worst = max(_stepped(engine).coordinates.q[7 + elbow] for _ in range(200))
    assert 0 < worst < np.radians(10)


def _stepped(engine):
    engine.advance(1e-3)
    return engine


def test_an_unknown_integrator_is_named():
    with pytest.raises(errors.OutOfRange, match='leapfrog'):
        MujocoEngine(flying(load_doll('doll')), NORMAL, integrator='leapfrog')


@pytest.mark.parametrize('restitution', [.2, .5, .8, .95])
def test_a_contact_lets_go_with_the_restitution_it_is_built_for(restitution):
    """A mass on a spring and a damper that only push, step by step, against the speed it came with.

    A contact of time constant 2 / b and damping ratio z has the stiffness of a critical one by z^2.
    """
    ratio = damping_ratio(restitution)
    damping, way, speed, h = 1.0, 0.0, -1.0, 1e-4
    while True:
        push = -damping * speed - way * (damping / (2 * ratio)) ** 2
        if push <= 0:
            break
        speed += h * push
        way += h * speed
    assert speed == pytest.approx(restitution, abs=1e-3)


def test_a_ball_bounces_in_mujoco_as_high_as_it_is_to():
    """By the ratio of speeds, to 10 %, at ten substeps."""
    ball = Ragdoll('ball', (Bone('ball', Sphere(.1), 1.0, (0, 0, 0)),))
    scene = Scene('bounce', (Placement(ball, position=(0, 0, .8)),), Ground(),
                  Material(restitution=.5))
    engine, heights = MujocoEngine(scene, NORMAL), []
    for _ in range(120):
        engine.advance(.01)
        heights.append(engine.state.positions[0, 2] - .1)
    first = int(np.argmin(heights[:60]))
    assert np.sqrt(max(heights[first:]) / .7) == pytest.approx(.5, abs=.05)


@pytest.mark.parametrize('substeps', [1, 4, 16])
@pytest.mark.parametrize('restitution', [.5, .9, 1.0])
def test_a_ball_bounces_as_high_at_any_restitution_and_step_of_mujoco(restitution, substeps):
    """The first apex is at e^2 h, to 8 %, as the least damping ratio, 0.01, gives e = 0.97; to 30 %
    at one substep, in which the speed of the impact is known to a tenth.
    """
    motion = bounce(restitution)
    found = motion.extra(run(mujoco('implicitfast', substeps), motion.trial).trajectory)
    assert found['apex_1_error'] < (.3 if substeps == 1 else .08)

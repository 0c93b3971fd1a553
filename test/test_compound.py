"""Bones of several shapes, or with an inertia of their own: mechanics, and the engines."""
import dataclasses
from importlib.util import find_spec

import numpy as np
import pybullet
import pytest
from oracles import PLAIN, bullet_acceleration, mujoco_acceleration
from samples import GRAVITY, TURN, every_kind, random_coordinates, scene_of
from specimens import HAMMER

from ragdoll_ros.accuracy.references.articulated import Articulated
from ragdoll_ros.files.mjcf import to_mjcf
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.compound import Compound, principal_axes
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere
from ragdoll_ros.physics import kernels
from ragdoll_ros.physics.engine.protocol import GROUND
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine
from ragdoll_ros.physics.engine.substepped.mujoco import MujocoEngine

ASKEW = Compound((Part(Box((0.1, 0.2, 0.4)), (0.3, 0, -0.1), TURN),
                  Part(Capsule(0.05, 0.3), (-0.1, 0.2, 0.1), (0.3, 0, 0.1, 0.9)),
                  Part(Cylinder(0.1, 0.1), (0, -0.3, 0)), Part(Sphere(0.08), (0, 0.1, 0.4))))
"""Nothing aligned, its centre of mass off the origin."""

DUMBBELL = Compound((Part(Sphere(0.1), (0.3, 0, 0)), Part(Sphere(0.1), (-0.3, 0, 0))))

ENGINES = {BulletEngine: bullet_acceleration, MujocoEngine: mujoco_acceleration}
"""Whom to ask for accelerations, and how."""

if kernels.ready():
    from kernel_dynamics import KernelDynamics

    from ragdoll_ros.physics.engine.rigid.engine import RigidEngine

    ENGINES[RigidEngine] = lambda engine, coordinates: KernelDynamics(
        engine.scene).acceleration(coordinates)


def each_engine(function):
    return pytest.mark.parametrize('engine', [pytest.param(engine, marks=pytest.mark.skipif(
        engine is MujocoEngine and find_spec('mujoco') is None, reason='no MuJoCo'))
        for engine in ENGINES])(function)


def alone(shape, **fields):
    return Ragdoll('alone', (Bone('bone', shape, 2.0, (0.1, 0.2, 0.3), TURN, **fields),))


def test_mass_centre_and_inertia_are_those_of_its_points():
    """Against a million random points in the shapes: 1 % is more than four sigma."""
    rng, clouds = np.random.default_rng(0), []
    volume = sum(part.shape.volume for part in ASKEW.parts)
    for part in ASKEW.parts:
        half = np.array(part.shape.half_extents)
        points = rng.uniform(-half, half, (1_000_000, 3))
        points = points[part.shape.signed_distance(points) < 0]
        count = int(300_000 * part.shape.volume / volume)
        clouds.append(part.position + points[:count] @ rotation.matrix(part.orientation).T)
        assert len(clouds[-1]) == count
    points = np.concatenate(clouds)
    assert ASKEW.volume == pytest.approx(volume)
    assert ASKEW.centroid == pytest.approx(points.mean(axis=0), abs=1e-3)
    squares = points.T @ points / len(points)
    matrix = 3 * (np.trace(squares) * np.eye(3) - squares)
    assert ASKEW.inertia_matrix(3.0) == pytest.approx(matrix, abs=0.01 * matrix.max())


def test_what_is_off_its_centre_or_axes_is_refused_and_told_what_would_be_right():
    with pytest.raises(errors.OffCentre) as caught:
        alone(ASKEW)
    assert caught.value.path == 'shapes'
    centred = Compound(tuple(dataclasses.replace(
        part, position=tuple(np.subtract(part.position, caught.value.value)))
        for part in ASKEW.parts))
    with pytest.raises(errors.NotPrincipal) as caught:
        alone(centred)
    told = caught.value.expected.split('[')[1].strip(']').split(',')
    turned = centred.in_frame(Pose(orientation=np.array(told, float)))
    moments = alone(turned).bones[0].inertia
    # What is told has nine digits.
    assert sorted(moments) == pytest.approx(np.linalg.eigvalsh(centred.inertia_matrix(2.0)),
                                            rel=1e-7)
    # With an inertia of its own it may be as it is.
    assert alone(ASKEW, moments=(1, 2, 3)).bones[0].inertia == (1, 2, 3)


def test_principal_axes_are_the_nearest_ones():
    """Of a turn by less than 45 degrees about each axis: itself, in whatever order they are."""
    for moments in ((1, 2, 2.5), (2.5, 1, 2), (2, 2.5, 1)):
        turn = rotation.from_rpy(0.3, -0.4, 0.2)
        axes = rotation.matrix(turn)
        found = principal_axes(axes * moments @ axes.T)
        assert rotation.angle_between(found, turn) < 1e-9
    assert principal_axes(np.diag((3.0, 1.0, 2.0))) == pytest.approx(rotation.IDENTITY, abs=0)


@pytest.mark.parametrize('doll', [
    alone(HAMMER), alone(ASKEW, moments=(0.1, 0.02, 0.09)),
    alone(Sphere(0.1), moments=(0.1, 0.2, 0.300000299)), alone(HAMMER, moments=(1, 2, 3))],
    ids=['hammer', 'askew', 'flat', 'own'])
def test_engines_have_its_mass_and_moments(doll, tmp_path):
    """The hammer's: two solids at 0.2 m, by Steiner's theorem; the others' as they are given."""
    bone = doll.bones[0]
    if bone.moments is None:
        head, handle = (part.shape for part in HAMMER.parts)
        share = head.volume / (head.volume + handle.volume)
        apart = 2 * share * (1 - share) * 0.2 ** 2
        # The head lies along x.
        across, _, along = head.inertia(2 * share)
        expected = np.add((along, across, across), handle.inertia(2 * (1 - share)))
        expected += np.array((apart, apart, 0))
    else:
        expected = np.array(bone.moments)
    assert bone.inertia == pytest.approx(expected, rel=1e-6)
    expected = np.array(bone.inertia)
    client = pybullet.connect(pybullet.DIRECT)
    (tmp_path / 'doll.urdf').write_text(to_urdf(doll, 'bullet'))
    body = pybullet.loadURDF(str(tmp_path / 'doll.urdf'), physicsClientId=client,
                             flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
    info = pybullet.getDynamicsInfo(body, -1, client)
    pybullet.disconnect(client)
    assert info[0] == 2.0 and info[2] == pytest.approx(expected, rel=1e-9)
    mujoco = pytest.importorskip('mujoco')
    model = mujoco.MjModel.from_xml_string(to_mjcf(Scene('s', (Placement(doll),))))
    assert model.body_mass[1] == 2.0 and model.body_ipos[1] == pytest.approx(0, abs=0)
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[1])
    axes = axes.reshape(3, 3)
    assert axes * model.body_inertia[1] @ axes.T == pytest.approx(np.diag(expected), rel=1e-9,
                                                                  abs=1e-12)


def of_their_own():
    """Every kind of joint between bones of moments of their own, one of them of several shapes."""
    rng, doll = np.random.default_rng(3), every_kind()
    bones = [dataclasses.replace(bone, moments=rng.uniform(0.02, 0.035, 3)) for bone in doll.bones]
    bones[2] = dataclasses.replace(bones[2], shape=ASKEW)
    return dataclasses.replace(doll, bones=tuple(bones))


@each_engine
@pytest.mark.parametrize('mass', [1.0, 1e6])
def test_engines_accelerate_as_its_inertia_says(engine, mass):
    """Against the equations of motion; of giants too."""
    doll = of_their_own()
    doll = dataclasses.replace(doll, bones=tuple(dataclasses.replace(
        bone, mass=bone.mass * mass, moments=tuple(mass * moment for moment in bone.moments))
        for bone in doll.bones))
    scene = scene_of(doll)
    placed = random_coordinates(scene, 5, bend=0.4)
    truth = Articulated(doll, GRAVITY).acceleration(placed.q, placed.v)
    made = engine(scene, PLAIN)
    found = ENGINES[engine](made, placed)
    made.close()
    assert np.abs(found - truth).max() < 1e-8 * np.abs(truth).max()


@each_engine
def test_each_part_meets_the_ground_and_other_bones(engine):
    """A dumbbell 2 mm deep: under both balls, on the middle lines; its ends apart meet a block."""
    doll = Ragdoll('dumbbell', (Bone('bone', DUMBBELL, 2.0, (0, 0, 0)),))
    made = engine(Scene('deep', (Placement(doll, position=(0, 0, 0.098)),), Ground()), PLAIN)
    if engine is not MujocoEngine:  # its contacts, stiff in steps so short, have thrown it out then
        made.advance(1e-5)
    found = made.contacts()
    made.close()
    assert (found.a.tolist(), found.b.tolist()) == ([0, 0], [GROUND] * 2)
    assert found.positions[found.positions[:, 0].argsort()] == pytest.approx(
        np.array([(-0.3, 0, -0.002), (0.3, 0, -0.002)]), abs=1e-6)
    assert found.depths == pytest.approx(0.002, abs=1e-6)
    block = Ragdoll('block', (Bone('block', Box((0.1, 0.1, 0.1)), 1.0, (-0.448, 0, 0)),))
    made = engine(Scene('pair', (Placement(doll), Placement(block)), gravity=(0, 0, 0)), PLAIN)
    made.advance(1e-5)
    found = made.contacts()
    made.close()
    assert {*found.a, *found.b} == {0, 1}
    assert found.positions[:, 0] == pytest.approx(-0.399, abs=2e-3)


@each_engine
def test_nothing_is_between_the_parts_of_a_dumbbell(engine):
    """A ball that passes between its ends touches neither."""
    doll = Ragdoll('dumbbell', (Bone('bone', DUMBBELL, 2.0, (0, 0, 0)),))
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.15), 1.0, (0, 0, 0)),))
    made = engine(Scene('through', (Placement(doll), Placement(ball)), gravity=(0, 0, 0)), PLAIN)
    made.advance(1e-5)
    assert not made.contacts()
    made.close()

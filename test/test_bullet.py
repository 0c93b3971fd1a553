"""PyBullet behind the protocol: contacts, loads, and what it would cut off without a word."""
import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from oracles import PLAIN

from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.engine.protocol import GROUND, AppliedWrench, allowed_penetration
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine


def one(shape, mass, **scene):
    """An engine with a single bone."""
    placement = {name: scene.pop(name) for name in ('position', 'orientation') if name in scene}
    doll = Ragdoll('one', (Bone('bone', shape, mass, (0, 0, 0)),))
    return BulletEngine(Scene('one', (Placement(doll, **placement),), **scene), PLAIN)


@pytest.mark.parametrize('substeps', [1, 4])
@pytest.mark.parametrize('shape', [Sphere(.1), Box((.2, .2, .2))])
def test_what_rests_on_a_tilted_ground_tells_of_it(shape, substeps):
    """Contacts of bone 0 with the GROUND: out of it, on the bone's surface, as heavy as the bone,
    however many substeps there are in a step.
    """
    mass = 2.0
    ground = Ground(normal=(.6, 0, .8), offset=1.0)
    normal = np.array(ground.normal)
    engine = one(shape, mass, position=normal * 1.1, ground=ground, gravity=-9.8 * normal,
                 orientation=rotation.shortest_arc((0, 0, 1), normal),
                 material=Material(restitution=0))
    engine.accuracy = dataclasses.replace(PLAIN, substeps=substeps / .2)
    for _ in range(500):
        engine.advance(2e-3)
    found, centre = engine.contacts(), engine.state.positions[0]
    engine.close()
    assert len(found) and set(found.a) == {0} and set(found.b) == {GROUND}
    assert found.forces.sum() == pytest.approx(mass * 9.8, rel=1e-3)
    assert np.abs(found.normals - normal).max() < 1e-6
    assert (found.positions - centre) @ normal == pytest.approx(-.1, abs=1e-6)
    assert found.positions @ normal - 1.0 == pytest.approx(-found.depths, abs=1e-6)


@pytest.mark.parametrize('local', [False, True])
@pytest.mark.parametrize('mass', [2.0, 1e3])
def test_a_wrench_is_in_newtons(mass, local):
    """F h / m and I^-1 (tau + r x F) h, in the bone's axes where it is local."""
    turn = (.6, 0, 0, .8)
    engine = one(Sphere(.1), mass, orientation=turn, ground=None, gravity=(0, 0, 0))
    force, torque, point = mass * np.array([[1, 2, -3], [.1, 0, .3], [0, .05, .02]])
    point = point / mass
    engine.advance(1e-3, [AppliedWrench(0, force, torque, point, local=local)])
    state = engine.state
    engine.close()
    arm = rotation.rotate(turn, point)
    if local:
        force, torque = rotation.rotate(turn, force), rotation.rotate(turn, torque)
    assert state.linear_velocities[0] == pytest.approx(force * 1e-3 / mass, rel=1e-9)
    inertia = .4 * mass * .1 ** 2
    assert state.angular_velocities[0] == pytest.approx(
        (torque + np.cross(arm, force)) * 1e-3 / inertia, rel=1e-6)


@pytest.mark.parametrize(('dolls', 'overlap', 'touch'), [(1, .5, True), (1, 1.5, False),
                                                         (2, .5, True), (2, 1.5, True)])
def test_bones_of_one_doll_that_overlap_at_the_start_do_not_collide(dolls, overlap, touch):
    """Beyond allowed_penetration(); with less they rest on each other, as do those of two dolls."""
    ball = Sphere(.1)
    alone = Ragdoll('alone', (Bone('a', ball, 1.0, (0, 0, 0)),))
    depth = overlap * allowed_penetration(Scene('alone', (Placement(alone),)))
    bones = (Bone('a', ball, 1.0, (0, 0, 0)), Bone('b', ball, 1.0, (0, .5, 0)),
             Bone('c', ball, 1.0, (.2 - depth, 0, 0)))
    joints = (Joint('a', 'b', 'hinge', (0, .3, 0), ((0, 0, 1),)),
              Joint('b', 'c', 'hinge', (.2, .3, 0), ((0, 0, 1),)))
    if dolls == 1:
        placements = (Placement(Ragdoll('all', bones, joints)),)
    else:
        placements = tuple(Placement(Ragdoll(bone.name, (bone,)), bone.name) for bone in bones)
    engine = BulletEngine(Scene('overlap', placements, ground=None, gravity=(0, 0, 0)), PLAIN)
    engine.advance(1e-5)
    met = engine.contacts()
    found = set(map(frozenset, zip(met.a.tolist(), met.b.tolist(), strict=True)))
    engine.close()
    assert found == ({frozenset((0, 2))} if touch else set())


def test_what_rests_does_not_bounce_at_long_steps():
    """A step of 20 ms alone gives 0.2 m/s, which a bouncing ball would give back nine tenths of."""
    engine = one(Sphere(.1), 1.0, position=(0, 0, .1), ground=Ground(),
                 material=Material(restitution=.9))
    engine.accuracy = dataclasses.replace(PLAIN, substeps=.5)
    heights = []
    for _ in range(100):
        engine.advance(.02)
        heights.append(engine.state.positions[0, 2])
    engine.close()
    assert heights == pytest.approx([.1] * 100, abs=2e-4)


def test_more_joints_than_pybullet_tells_of_are_refused():
    """Of 128 coordinates at the most: of a chain of 31 free balls it would drop some silently."""
    balls = tuple(Bone(f'b{k}', Sphere(0.04), 0.1, (0.1 * k, 0.0, 0.0)) for k in range(32))
    joints = tuple(Joint(f'b{k}', f'b{k + 1}', 'ball', (0.1 * k + 0.05, 0.0, 0.0),
                         ((1.0, 0.0, 0.0),)) for k in range(31))
    scene = Scene('chain', (Placement(Ragdoll('chain', balls, joints)),), ground=None)
    with pytest.raises(errors.OutOfRange, match='at most 128'):
        BulletEngine(scene, PLAIN)


def test_pybullet_is_imported_without_a_word():
    """It prints when it was built; what a program says before and after is not lost."""
    done = subprocess.run(
        [sys.executable, '-c', 'print("before"); '
         'import ragdoll_ros.physics.engine.substepped.bullet\n'
         'print("after")'], capture_output=True, text=True, timeout=60, check=True)
    assert (done.stdout, done.stderr) == ('before\nafter\n', '')

"""The references against each other and against conservation laws: no engine takes part."""
import math

import numpy as np
import pytest

pytest.importorskip('scipy')

from scipy.special import ellipk

from ragdoll_ros.accuracy.motions import flight
from ragdoll_ros.accuracy.motions.motion import without_damping
from ragdoll_ros.accuracy.references import closed_forms
from ragdoll_ros.accuracy.references.articulated import Articulated, torque_free_rotation
from ragdoll_ros.accuracy.references.planar_chain import PlanarChain
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.shapes import Box

TIMES = np.linspace(0, .3, 4)
"""s: a radian of motion, within which any wrong term of order 1 shows at once."""


def chain(links, length=0.3):
    """Rods along x, hinged about z."""
    bones = tuple(Bone(f'rod_{i}', Box((length, .02, .04)), 1.5, (i * length, 0, 0))
                  for i in range(links))
    joints = tuple(Joint(f'rod_{i - 1}', f'rod_{i}', 'hinge', ((i - .5) * length, 0, 0),
                         ((0, 0, 1),)) for i in range(1, links))
    return Ragdoll('chain', bones, joints)


def random_motion(tree, seed, speed=3.0):
    rng = np.random.default_rng(seed)
    q = tree.bind()
    q[3:7] = rotation.normalized(rng.normal(size=4))
    q[7:] = rng.uniform(-1, 1, size=q.size - 7)
    return q, rng.normal(size=tree.nv) * speed


@pytest.mark.parametrize('links', [2, 5])
def test_articulated_agrees_with_lagrange_in_the_plane(links):
    """Two derivations that share no line; both integrated at 1e-12, so 1e-9 is generous."""
    doll = chain(links)
    planar = PlanarChain(links, .3, 1.5, doll.bones[0].inertia[2])
    angles, rates = np.linspace(0, 1.2, links), np.linspace(2, -3, links)
    centres, phi = planar.motion(angles, rates, TIMES, gravity=(0, -9.8))
    tree = Articulated(doll, (0, -9.8, 0))
    q, v = tree.bind(), np.zeros(tree.nv)
    q[3:7] = rotation.from_axis_angle((0, 0, 1), angles[0])
    q[7:], v[6:], v[5] = np.diff(angles), np.diff(rates), rates[0]
    v[:2] = -tree.state(q, v).linear_velocities.mean(axis=0)[:2]
    moved = tree.trajectory(q, v, TIMES)
    assert np.abs(moved.positions[..., :2] - centres).max() < 1e-9
    assert np.abs(moved.positions[..., 2]).max() < 1e-12
    rotations = rotation.from_rotation_vector(np.stack([0 * phi, 0 * phi, phi], axis=-1))
    assert rotation.angle_between(moved.orientations, rotations).max() < 1e-9


def test_one_link_tumbles_as_euler_says():
    box = Box((.3, .2, .1))
    doll = Ragdoll('box', (Bone('box', box, 2.0, (0, 0, 0)),))
    omega = np.array([.1, 8.0, .2])
    orientations, body_omega = torque_free_rotation(doll.bones[0].inertia, omega, TIMES)
    tree = Articulated(doll)
    moved = tree.trajectory(tree.bind(), np.array([0, 0, 0, *omega]), TIMES)
    assert rotation.angle_between(moved.orientations[:, 0], orientations).max() < 1e-9
    world_omega = rotation.rotate(orientations, body_omega)
    assert np.abs(moved.angular_velocities[:, 0] - world_omega).max() < 1e-9


def test_tumbling_keeps_energy_and_angular_momentum():
    """The middle axis is unstable: after 1.1 s the box turns over, and still keeps both."""
    moments = np.array([1.0, 2.0, 3.0])
    orientations, omega = torque_free_rotation(moments, (.1, 8.0, .1), np.linspace(0, 1.5, 151))
    assert np.sign(omega[:, 1]).min() == -1
    energy = (moments * omega ** 2).sum(axis=1) / 2
    momentum = rotation.rotate(orientations, moments * omega)
    assert np.ptp(energy) / energy[0] < 1e-9
    assert np.ptp(momentum, axis=0).max() / np.linalg.norm(momentum[0]) < 1e-9


@pytest.mark.parametrize('seed', range(3))
def test_a_doll_in_flight_keeps_momentum_and_energy(seed):
    """Conservation catches any sign error in the drift terms; no gravity, no damping."""
    doll = without_damping(load_doll('doll'))
    tree = Articulated(doll)
    moved = tree.trajectory(*random_motion(tree, seed), (0, .05, .1))
    masses = np.array([bone.mass for bone in doll.bones])
    own = rotation.rotate(moved.orientations, np.array([b.inertia for b in doll.bones])
                          * rotation.rotate(rotation.inverse(moved.orientations),
                                            moved.angular_velocities))
    linear = masses[:, None] * moved.linear_velocities
    angular = (own + np.cross(moved.positions, linear)).sum(axis=1)
    energy = ((linear * moved.linear_velocities).sum((1, 2))
              + (own * moved.angular_velocities).sum((1, 2))) / 2
    assert np.ptp(energy) / energy[0] < 1e-9
    assert np.ptp(angular, axis=0).max() / np.linalg.norm(angular[0]) < 1e-9
    assert np.ptp(linear.sum(axis=1), axis=0).max() < 1e-9 * np.abs(linear).sum()


@pytest.mark.parametrize('make', [flight.free_fall, flight.projectile, flight.first_touch])
def test_falls_that_are_formulas_are_those_of_their_scenes(make):
    """As the articulated reference has them: a scene that turns at its start is no such fall."""
    motion = make()
    placement, = motion.trial.scene.dolls
    tree = Articulated(placement.doll, motion.trial.scene.gravity)
    times = np.array([0.0, 0.1])
    q = tree.bind(placement.position, placement.orientation)
    v = np.zeros(tree.nv)
    v[:3], v[3:6] = placement.velocity, placement.spin
    found, truth = tree.trajectory(q, v, times), motion.truth(times)
    assert found.positions == pytest.approx(truth.positions, abs=1e-9)


def test_velocities_are_the_derivatives_of_the_poses():
    """Central differences of step h leave h^2: 1e-4 s, rates of 30 1/s, so under 1e-5."""
    doll = load_doll('doll')
    tree = Articulated(doll, (0, 0, -9.8))
    h = 1e-4
    moved = tree.trajectory(*random_motion(tree, 9), (0, h, 2 * h))
    speed = (moved.positions[2] - moved.positions[0]) / (2 * h)
    assert np.abs(speed - moved.linear_velocities[1]).max() < 1e-4
    turned = rotation.multiply(moved.orientations[2], rotation.inverse(moved.orientations[0]))
    turned *= np.sign(turned[:, 3:])
    assert np.abs(turned[:, :3] * 2 / (2 * h) - moved.angular_velocities[1]).max() < 1e-3


def test_a_damped_hinge_and_a_wrench_act_as_newton_says():
    """Two boxes hinged at their common centre, I d' = 2 t - 2 c d for the relative rate d."""
    box = Box((.3, .2, .1))
    bones = (Bone('a', box, 1.5, (0, 0, 0)), Bone('b', box, 1.5, (0, 0, 0)))
    hinge = Joint('a', 'b', 'hinge', (0, 0, 0), ((0, 0, 1),), damping=.5)
    tree = Articulated(Ragdoll('pair', bones, (hinge,)))
    pair = np.array([[0, 0, -1.0], [0, 0, 1.0]])
    moved = tree.trajectory(tree.bind(), np.zeros(7), (0, .02),
                            lambda t, state: (np.zeros((2, 3)), pair))
    difference = moved.angular_velocities[-1, 1, 2] - moved.angular_velocities[-1, 0, 2]
    moment = bones[0].inertia[2]
    assert difference == pytest.approx(1 / .5 * -math.expm1(-2 * .5 * .02 / moment), rel=1e-10)


def test_breaks_of_a_push_are_met():
    """F t / m for a push that ends between two instants, to the integrator's tolerance."""
    doll = Ragdoll('ball', (Bone('ball', Box((.1, .1, .1)), 2.0, (0, 0, 0)),))
    tree = Articulated(doll)
    push = np.array([[3.0, 0, 0]])
    moved = tree.trajectory(tree.bind(), np.zeros(6), TIMES, breaks=(.13,),
                            wrenches=lambda t, _: (push * (t < .13), 0 * push))
    assert moved.linear_velocities[-1, 0, 0] == pytest.approx(3 * .13 / 2, abs=1e-12)


def test_small_and_large_pendulums():
    """Small: the cosine. Large: down after a quarter of 4 K(k^2) / omega.

    At 179 degrees that is 3.9011 times as long as for small swings, a value of tables.
    """
    t = np.linspace(0, 2, 50)
    small = closed_forms.pendulum_angle(1e-4, 3.0, t)
    assert np.abs(small - 1e-4 * np.cos(3 * t)).max() < 1e-4 * 1e-8
    quarter = ellipk(math.sin(2.5 / 2) ** 2) / 3.0
    assert abs(closed_forms.pendulum_angle(2.5, 3.0, np.array([quarter]))[0]) < 1e-12
    before, after = math.pi / 2 * np.array([3.9010, 3.9012])
    down = closed_forms.pendulum_angle(math.radians(179), 1.0, np.array([before, after]))
    assert down[0] > 0 > down[1]


def test_the_pendulum_solves_its_equation():
    """Second difference of the formula against -omega^2 sin(phi): error h^2 phi''''/12."""
    h, t = 1e-3, np.linspace(0.1, 2, 20)
    before, here, after = (closed_forms.pendulum_angle(2.5, 3.0, t + d) for d in (-h, 0, h))
    assert np.abs((before - 2 * here + after) / h ** 2 + 9 * np.sin(here)).max() < 1e-3


def test_the_sliding_ball_ends_at_five_sevenths():
    """Angular momentum about the contact line is kept: v = 5/7 v0 whatever the friction."""
    for friction in (.1, .9):
        t = np.array([5.0, 6.0])
        x = closed_forms.ball_slide_then_roll(2.0, friction, 9.8, t)
        assert x[1] - x[0] == pytest.approx(10 / 7, abs=1e-12)


def test_a_block_sticks_below_the_friction_angle():
    t = np.array([1.0])
    assert closed_forms.incline_slide(math.atan(.5), .51, 9.8, t)[0] == 0
    assert closed_forms.incline_slide(math.pi / 2, .5, 9.8, t)[0] == pytest.approx(4.9)


def test_bounces_fit_their_heights():
    times = closed_forms.bounce_times(1.0, .5, 9.8, 3)
    assert times[0] == pytest.approx(math.sqrt(2 / 9.8))
    assert times[1] - times[0] == pytest.approx(2 * .5 * times[0])
    assert closed_forms.bounce_apex(1.0, .5, 2) == pytest.approx(1 / 16)

"""Swings against closed forms and independent integrators."""
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.special import ellipj, ellipk

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.model.swing import Link, Swing, strand
from ragdoll_ros.model.swing_mount import SwingMount
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.physics.swing.swings import Swings
from ragdoll_ros.physics.swing.track import Track

G = 9.8
DOWN = (0, 0, -G)


def mounted(links, mode='spring', direction=(1, 0, 0), root=(0, 0, 0), name='swing', **fields):
    links = links if isinstance(links, (tuple, list)) else (links,)
    swing = Swing(name, 'bone', root, direction, links, mode=mode, **fields)
    return SwingMount.on(swing, Bone('bone', Sphere(0.1), 1, (0, 0, 0)), 0)


def still(_):
    return bone()


def bone(position=(0, 0, 0), turn=rotation.IDENTITY, linear=(0, 0, 0), angular=(0, 0, 0)):
    """State of one bone."""
    return State(*(np.array([row], float) for row in (position, turn, linear, angular)))


def shaken(t, move=(0.0, 0.1, 0.0), axis=(0.3, 0.0, 0.0), hertz=3.0):
    """A bone that shakes and nods about one axis."""
    rate = 2 * math.pi * hertz
    sin, cos = math.sin(rate * t), math.cos(rate * t)
    move, axis = np.array(move), np.array(axis)
    return bone(move * sin, rotation.from_rotation_vector(axis * sin), move * rate * cos,
                axis * rate * cos)


# The source's own example

@pytest.mark.parametrize('rate', [1, 7, 30, 1000])
def test_free_fall_is_exact_at_every_frame_rate(rate):
    mount = mounted(Link(0.1), 'free', direction=(0, 0, 1), velocity=(0, 0, 2))
    swings = Swings([mount], (0, 0, -2), still)
    heights = {i: swings.evaluate(i / rate).positions[0, 2] - 0.1 for i in range(2 * rate + 1)}
    assert heights[rate] == pytest.approx(1, abs=1e-9)
    assert heights[2 * rate] == pytest.approx(0, abs=1e-9)


# The pendulum

def elliptic_angle(t):
    """Angle from straight down of a pendulum of 1 m let go at 90 degrees."""
    sn = ellipj(ellipk(0.5) - math.sqrt(G) * t, 0.5)[0]
    return 2 * np.arcsin(math.sin(math.pi / 4) * sn)


def pendulum_angles(step, times):
    swings = Swings([mounted(Link(1.0), 'pendulum')], DOWN, still, step=step)
    places = [swings.evaluate(t).positions[0] for t in times]
    return np.array([math.atan2(x, -z) for x, _, z in places])


@pytest.mark.parametrize('step', [1 / 60, None])
def test_period_of_a_pendulum_from_90_degrees_at_60_frames(step):
    times = np.arange(301) / 60
    angles = pendulum_angles(step, times)
    at = np.flatnonzero(angles[:-1] * angles[1:] < 0)
    # the rate is at its top at a crossing, so that a straight line is right to third order
    crossings = times[at] + angles[at] / (angles[at] - angles[at + 1]) / 60
    period = 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    assert abs(period / (4 * ellipk(0.5) / math.sqrt(G)) - 1) < 1e-3


def test_pendulum_is_of_second_order():
    steps = [1 / 15, 1 / 30, 1 / 60, 1 / 120, 1 / 240]
    times = np.arange(26) / 5
    errors = np.array([np.abs(pendulum_angles(step, times) - elliptic_angle(times)).max()
                       for step in steps])
    orders = np.log2(errors[:-1] / errors[1:])
    print('step, s    error in 5 s, rad    order')
    for step, error, order in zip(steps, errors, [math.nan, *orders], strict=True):
        print(f'{step:.5f}    {error:.3e}            {order:.3f}')
    assert np.all(np.abs(orders - 2) < 0.05)
    assert errors[-1] < 2e-4


# The spring

def oscillator(t, start, omega, zeta):
    """Closed form of x'' + 2 zeta omega x' + omega^2 x = 0 from rest at ``start``."""
    if zeta < 1:
        fast = omega * math.sqrt(1 - zeta ** 2)
        return start * math.exp(-zeta * omega * t) * (
            math.cos(fast * t) + zeta * omega / fast * math.sin(fast * t))
    if zeta == 1:
        return start * math.exp(-omega * t) * (1 + omega * t)
    root = math.sqrt(zeta ** 2 - 1)
    quick, slow = omega * (zeta + root), omega / (zeta + root)
    return start * (quick * math.exp(-slow * t) - slow * math.exp(-quick * t)) / (quick - slow)


@pytest.mark.parametrize('rate', [15, 30, 60, 240, 1000])
def test_spring_is_the_closed_form_at_every_frame_rate(rate):
    length, mass, start = 0.3, 0.5, 1.2
    cases = list(itertools.product([2.0, 40.0, 4e5], [0.0, 0.1, 1.0, 3.0]))
    swings = Swings([mounted(Link(length, mass, k, zeta), gravity=0) for k, zeta in cases],
                    DOWN, still)
    swings.begin(0, [[math.cos(start), math.sin(start), 0]] * len(cases),
                 [[0, 0, 0]] * len(cases))
    for index in range(1, rate + 1):
        places = swings.evaluate(index / rate).positions
        expected = [oscillator(index / rate, start, math.sqrt(k / (mass * length ** 2)), zeta)
                    for k, zeta in cases]
        np.testing.assert_allclose(np.arctan2(places[:, 1], places[:, 0]), expected, rtol=0,
                                   atol=1e-9)


@pytest.mark.slow
def test_a_shaken_strand_does_not_depend_on_the_frame_rate():
    swing = load_scene('ponytail').dolls[0].doll.swings[0]
    size = sum(link.length for link in swing.links)
    mount = mounted(swing.links, direction=swing.direction, root=(-0.09, 0, 0.04))
    seen = {}
    for rate in (15, 30, 60, 240, 1000):
        track = Track()
        swings = Swings([mount], DOWN, track)
        places = []
        for index in range(round(0.8 * rate) + 1):
            track.add(index / rate, shaken(index / rate))
            state = swings.evaluate(index / rate)
            if index * 5 % rate == 0:
                places.append(state.positions)
        seen[rate] = np.array(places)
    assert np.ptp(seen[1000][1:, -1], axis=0).max() > size / 4  # it does swing
    for rate, share in ((15, 0.05), (30, 0.01), (60, 0.01), (240, 0.01)):
        off = np.linalg.norm(seen[rate] - seen[1000], axis=2).max() / size
        print(f'{rate} frames a second: {off:.1e} of the size from 1000')
        assert off < share


ROOT = np.array([0.1, 0.05, -0.02])
REST = rotation.normalized(np.array([1, 0.4, -0.3]))


def reference(link, motion, end):
    """A single swing's direction at ``end`` by an integrator of order 8, from its equation."""
    inertia = link.mass * link.length ** 2
    c = 2 * link.damping * math.sqrt(link.stiffness / inertia + G / link.length)
    small = 1e-4

    def point(t):
        frame = motion(t)
        return frame.positions[0] + rotation.rotate(frame.orientations[0], ROOT)

    def rates(t, y):
        d, u = y[:3], y[3:]
        frame = motion(t)
        rest = rotation.rotate(frame.orientations[0], REST)
        acceleration = (point(t + small) - 2 * point(t) + point(t - small)) / small ** 2
        across = rest - (rest @ d) * d
        sin = np.linalg.norm(across)
        arc = across * math.atan2(sin, rest @ d) / sin if sin else across
        force = (link.stiffness / inertia * arc - c * (u - np.cross(frame.angular_velocities[0], d))
                 + (np.array(DOWN) - acceleration) / link.length)
        return np.concatenate([u, force - (force @ d) * d - (u @ u) * d])

    frame = motion(0)
    d = rotation.rotate(frame.orientations[0], REST)
    start = np.concatenate([d, np.cross(frame.angular_velocities[0], d)])
    return solve_ivp(rates, (0, end), start, rtol=1e-8, atol=1e-9, method='DOP853').y[:3, -1]


@pytest.mark.parametrize(('stiffness', 'damping'), [(0, 0), (0, 0.3), (0.5, 0), (0.5, 0.3),
                                                    (20, 1)])
def test_second_order_in_space_on_a_bone_that_shakes_and_turns(stiffness, damping):
    link = Link(0.3, 0.5, stiffness, damping)
    mount = mounted(link, direction=REST, root=ROOT)

    def motion(t):
        return shaken(t, (0.03, 0.1, 0.05), (0.5, 0.3, 0.4), 1.5)

    exact = reference(link, motion, 1.0)
    errors = []
    for step in (0.02, 0.01, 0.005, 0.0025):
        swings = Swings([mount], DOWN, motion, step=step)
        swings.evaluate(0)
        errors.append(np.linalg.norm(swings.evaluate(1.0).directions[0] - exact))
    print(stiffness, damping, errors)
    # a halving divides by four where the method is of order 2, by two where it is of order 1
    assert errors[-2] / errors[-1] > 3.5
    assert errors[1] < 0.02


# The twin

def test_twin_under_a_spinning_accelerating_parent_falls_alike():
    turn = rotation.from_rpy(0.3, -0.2, 0.5)
    place = np.array([1.0, 2.0, 3.0])
    start = place + rotation.rotate(turn, [0.2, 0.1, 1])

    def wild(t):
        spin = np.array([3.0, -7.0, 11.0])
        whole = rotation.multiply(rotation.from_rotation_vector(spin * t), turn)
        return bone(place + np.array([4.0, -2, 1]) * t * t, whole, np.array([8.0, -4, 2]) * t, spin)

    fields = {'mode': 'free', 'direction': (0, 0, 1), 'velocity': (1, 2, 3)}
    under = Swings([mounted(Link(1), root=(0.2, 0.1, 0), **fields)], DOWN, wild)
    alone = Swings([mounted(Link(1), root=start - [0, 0, 1], **fields)], DOWN, still)
    for t in np.linspace(0, 2, 61):
        state, twin = under.evaluate(t), alone.evaluate(t)
        np.testing.assert_allclose(state.positions, twin.positions, rtol=0, atol=1e-9)


# Extremes

def event(kind, time):
    """A root that jumps 10 m, a bone that turns 180 degrees, from one frame to the next."""
    after = time > 0.2
    turn = (0, 0, 1, 0) if after and kind != 'jump' else rotation.IDENTITY
    return bone((10 if after and kind != 'turn' else 0, 0, 0), turn)


TABLE = list(itertools.product((0, 1e-3, 1, 1e3, 1e6, 1e9), (0, 0.05, 1, 100),
                               (1e-6, 1e-3, 1, 1e3), (0.02, 0.3, 2)))
"""Stiffness, damping, mass, length."""


@pytest.mark.parametrize('kind', ['jump', 'turn', 'both'])
@pytest.mark.parametrize('rate', [15, pytest.param(60, marks=pytest.mark.slow), 1000])
def test_extremes_stay_bounded(kind, rate):
    stiffness, _, mass, length = np.array(TABLE).T
    swinging = [mounted(Link(el, m, k, zeta), direction=(1, 0.3, -0.2), root=(0.1, 0.05, 0))
                for k, zeta, m, el in TABLE]
    track = Track()
    swings = Swings(swinging, DOWN, track)
    energies = []
    for index in range(round(rate * (0.6 if rate == 1000 else 3)) + 1):
        frame = event(kind, index / rate)
        track.add(index / rate, frame)
        state = swings.evaluate(index / rate)
        np.testing.assert_allclose(np.linalg.norm(state.orientations, axis=1), 1, atol=1e-9)
        lengths = np.linalg.norm(state.positions - state.roots, axis=1)
        np.testing.assert_allclose(lengths, length, rtol=0, atol=1e-9)
        rest = rotation.rotate(frame.orientations[0], swinging[0].directions[0])
        d = state.directions
        arc = np.arctan2(np.linalg.norm(np.cross(rest, d), axis=1), d @ rest)
        energies.append(mass * length ** 2 * np.sum(state.rates ** 2, axis=1) / 2
                        + stiffness * arc ** 2 / 2 + mass * G * length * (1 + d[:, 2]))
    energies = np.array(energies)
    # When the interval of the grid in which the event fell is over, the bone is still and nothing
    # may gain energy. Where only gravity acts the method is Stoermer and Verlet's, whose energy
    # sways by (step rate)^2/8.
    settled = energies[math.floor((0.2 + 2 * swings.step) * rate) + 3:]
    assert np.all(settled <= settled[0] * 1.02 + 1e-12)
    # The event: root and rest direction go at up to 1.5 times their mean speed, there and back,
    # and the spring is drawn out by at most half a turn.
    way = (10 if kind != 'turn' else 0) + (0 if kind == 'jump' else math.pi * (0.12 + length))
    speed = 2 * 1.5 * way * rate + G
    bound = mass * speed ** 2 + stiffness * math.pi ** 2 + mass * (1 + 4 * G * length)
    assert np.all(energies <= bound)


@pytest.mark.parametrize('damping', [0, 0.1, 10])
def test_chains_stay_bounded_through_extremes(damping):
    lengths = (0.02, 0.3)
    swinging = [mounted([Link(el, m, k, damping)] * 4, direction=(1, 0.3, -0.2))
                for k, m, el in itertools.product((0, 1, 1e9), (1e-6, 1, 1e3), lengths)]
    track = Track()
    swings = Swings(swinging, DOWN, track)
    most = math.pi / swings.step
    for index in range(121):
        track.add(index / 60, event('both', index / 60))
        state = swings.evaluate(index / 60)
        rods = np.linalg.norm(state.positions - state.roots, axis=1)
        np.testing.assert_allclose(rods, np.tile(np.repeat(lengths, 4), 9), rtol=0, atol=1e-9)
        rates = np.linalg.norm(state.rates, axis=1).reshape(-1, 4)
        np.testing.assert_allclose(np.linalg.norm(state.orientations, axis=1), 1, atol=1e-9)
        assert np.all(rates[:, 1:] <= most * (1 + 1e-12))


def test_undamped_springs_never_gain_energy_whatever_the_step():
    step, mass, length = 0.01, 0.5, 0.3
    inertia = mass * length ** 2
    phases = [0.05, 0.2, 0.5, 1, 2, 3, math.pi, 3.3, 4, 6.2, 2 * math.pi, 30, 1e4]
    cases = list(itertools.product(phases, [0.3, 1.5, 3.0], [0.1, 1.0, 3.0]))
    k = np.array([(phase / step) ** 2 * inertia for phase, _, _ in cases])
    swings = Swings([mounted(Link(length, mass, value), gravity=0) for value in k], DOWN, still,
                    step=step)

    def energy(state):
        arc = np.arctan2(np.hypot(*state.directions.T[1:]), state.directions[:, 0])
        return inertia * np.sum(state.rates ** 2, axis=1) / 2 + k * arc ** 2 / 2

    swings.begin(0, [[math.cos(arc), math.sin(arc), 0] for _, arc, _ in cases],
                 [[0, 0, phase / step * speed] for phase, _, speed in cases])
    first = energy(swings.evaluate(0))
    for index in range(1, 1500):
        # 1e-12 a step is what the integrator counts as rounding
        assert np.all(energy(swings.evaluate(index * step)) <= first * (1 + 2e-12 * index))


# The same time, earlier times, odd times

def test_repeated_irregular_and_rewound_times_give_what_one_pass_gives():
    mount = mounted(strand(4, 0.4, 0.1, (0.5, 0.1), 0.2), root=(0.1, 0, 0))
    once = Swings([mount], DOWN, shaken)
    once.evaluate(0)
    expected = once.evaluate(1.7).positions
    odd = Swings([mount], DOWN, shaken)
    for t in (0, 0.3, 0.3, 0.30001, 0.9, 0.913, 0.913, 1.2345):
        odd.evaluate(t)
    np.testing.assert_array_equal(odd.evaluate(1.7).positions, expected)
    np.testing.assert_array_equal(odd.evaluate(1.7).positions, expected)
    for t in (0, 0.5):
        odd.evaluate(t)
    np.testing.assert_array_equal(odd.evaluate(1.7).positions, expected)


def test_an_earlier_time_starts_again_from_rest():
    swings = Swings([mounted(Link(1.0), 'pendulum')], DOWN, still)
    swings.evaluate(0)
    assert abs(swings.evaluate(2.0).positions[0, 2]) > 0.1
    back = swings.evaluate(1.0)
    np.testing.assert_allclose(back.positions, [[1, 0, 0]], atol=1e-15)
    np.testing.assert_array_equal(back.rates, np.zeros((1, 3)))


def test_a_scene_without_swings_carries_nothing():
    with Simulation(load_scene('drop')) as simulation:
        simulation.advance()
        assert simulation.swings is None


# In a simulation

def test_a_simulation_carries_its_ponytail_and_repeats_it():
    with Simulation(load_scene('ponytail')) as simulation:
        head = simulation.scene.bone_index('head')
        ways = []
        for _ in range(2):
            places = []
            for _ in range(60):
                state = simulation.advance()
                swings = simulation.swings
                places.append(np.vstack([swings.roots[:1], swings.positions]))
                root = rotation.rotate(rotation.inverse(state.orientations[head]),
                                       swings.roots[0] - state.positions[head])
                np.testing.assert_allclose(root, [-0.09, 0, 0.04], atol=1e-12)
            ways.append(np.array(places))
            simulation.reset()
    np.testing.assert_array_equal(*ways)
    shape = ways[0] - ways[0][:, :1]
    # in free fall nothing has weight and nothing moves; from the landing on it swings
    np.testing.assert_allclose(shape[25], shape[0], atol=1e-6)
    assert np.linalg.norm(shape[55, -1] - shape[0, -1]) > 0.2


# Chains

def lowest_frequency(links, gravity):
    """rad/s of a straight chain that hangs, by a solver of its whole eigenproblem."""
    lengths, masses, springs = np.array([(a.length, a.mass, a.stiffness) for a in links]).T
    to_places = np.tril(np.ones((len(links),) * 2)) * lengths
    between_links = np.eye(len(links)) - np.eye(len(links), k=-1)
    stiffness = (between_links.T @ np.diag(springs) @ between_links
                 + gravity * np.diag(lengths * np.cumsum(masses[::-1])[::-1]))
    return math.sqrt(eigh(stiffness, to_places.T @ np.diag(masses) @ to_places,
                          eigvals_only=True)[0])


def measured_frequency(links, gravity, mode='spring', **fields):
    """rad/s of the first link of a chain that hangs, let go a little aside."""
    mount = mounted(links, mode, direction=(0, 0, -1), **fields)
    swings = Swings([mount], (0, 0, -gravity), still, step=0.002)
    swings.begin(0, [[1e-3, 0, -1]] * len(links), np.zeros((len(links), 3)))
    times = np.arange(3000) * 0.002
    angles = np.array([swings.evaluate(t).directions[0, 0] for t in times])
    at = np.flatnonzero(angles[:-1] * angles[1:] < 0)
    crossings = times[at] + angles[at] / (angles[at] - angles[at + 1]) * 0.002
    return math.pi / np.mean(np.diff(crossings))


@pytest.mark.parametrize('kind', ['springs', 'gravity', 'both'])
@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12, 40])
def test_a_hanging_chain_swings_as_slowly_as_the_true_one(count, kind):
    """To the 1e-5 of the step, and of crossings by straight lines."""
    links = strand(count, 1.0, 1.0, 0 if kind == 'gravity' else (2.0 * count, count))
    gravity = 0 if kind == 'springs' else G
    own = measured_frequency(links, gravity, 'pendulum' if kind == 'gravity' else 'spring')
    assert own == pytest.approx(lowest_frequency(links, gravity), rel=2e-5)


@pytest.mark.parametrize(('count', 'share'), [(4, 0.05), (8, 0.014), (40, 0.001)])
def test_a_strap_swings_as_a_clamped_beam(count, share):
    """Euler and Bernoulli's: 1.8751^2 sqrt(E I / (m L^3)). ``share``: what so few links leave."""
    length, mass, rigidity = 0.4, 0.2, 0.05
    beam = 1.8751041 ** 2 * math.sqrt(rigidity / (mass * length ** 3))
    own = measured_frequency(strand(count, length, mass, rigidity=rigidity), 0)
    assert 1 - share < own / beam < 1


@pytest.mark.parametrize('count', [1, 2, 3, 5, 8])
def test_independent_links_swing_as_if_nothing_hung_on_them(count):
    link = Link(0.1, 0.05, 0.02)
    own = measured_frequency((link,) * count, G, independent=True)
    alone = math.sqrt(link.stiffness / (link.mass * link.length ** 2) + G / link.length)
    assert own == pytest.approx(alone, rel=2e-5)


@pytest.mark.parametrize('damping', [0, 0.1, 0.3])
@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12, 40])
def test_a_chain_that_is_shaken_hard_stays_whole(count, damping):
    """Though undamped it may gain energy: rods keep their lengths, frames are orthogonal."""
    mount = mounted(strand(count, 0.4, 0.1, 0.02, damping))
    swings = Swings([mount], DOWN, lambda t: shaken(t, (0.1, 0.2, 0.1), (1.0, 0.5, 0.2), 4.0))
    for index in range(400):
        state = swings.evaluate(index * 0.02)
    lengths = np.linalg.norm(state.positions - state.roots, axis=1)
    np.testing.assert_allclose(lengths, 0.4 / count, rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(state.orientations, axis=1), 1, atol=1e-9)
    axes = state.link_states['axes']
    np.testing.assert_allclose(np.einsum('nji,nki->njk', axes, axes),
                               np.broadcast_to(np.eye(3), axes.shape), atol=1e-9)


def test_a_chain_hangs_straight_down_in_the_end_and_turns_its_frames_with_it():
    mount = mounted(strand(3, 0.3, 0.1, 0, 1.0), 'pendulum', direction=(1, 0, 0))
    swings = Swings([mount], DOWN, still)
    swings.evaluate(0)
    state = swings.evaluate(10)
    np.testing.assert_allclose(state.directions, [[0, 0, -1]] * 3, atol=1e-6)
    for orientation in state.orientations:
        np.testing.assert_allclose(rotation.rotate(orientation, [1, 0, 0]), [0, 0, -1], atol=1e-6)
    np.testing.assert_allclose(state.positions[-1], [0, 0, -0.3], atol=1e-6)


def test_chains_of_many_lengths_keep_the_scenes_order():
    kinds = [(1, 'spring'), (3, 'spring'), (2, 'free'), (2, 'pendulum'), (3, 'spring')]
    several = [mounted(strand(count, 0.1 * count), mode, name=f's{i}', root=(i, 0, 0))
               for i, (count, mode) in enumerate(kinds)]
    together = Swings(several, DOWN, shaken, step=0.005)
    together.evaluate(0)
    state = together.evaluate(0.53)
    begin = 0
    for mount in several:
        alone = Swings([mount], DOWN, shaken, step=0.005)
        alone.evaluate(0)
        expected = alone.evaluate(0.53)
        rows = slice(begin, begin + len(mount.names))
        for key in ('positions', 'orientations', 'roots', 'velocities'):
            np.testing.assert_allclose(getattr(state, key)[rows], getattr(expected, key),
                                       atol=1e-9, err_msg=key)
        assert together.names[rows] == mount.names
        begin += len(mount.names)


# The bones' motion between frames

def between(first, last, span, part):
    """State at a fraction of the path of ``span`` s between two."""
    track = Track()
    track.add(0.0, first)
    track.add(span, last)
    # At its end a track gives what it was given.
    return track(span * min(part, 1 - 1e-12))


def test_frames_between_are_of_fourth_order_and_meet_both_ends():
    errors = []
    for span in (0.1, 0.05):
        first, last, middle = (shaken(0.02 + part * span) for part in (0, 1, 0.5))
        made = between(first, last, span, 0.5)
        errors.append(max(np.abs(made.positions - middle.positions).max(),
                          rotation.angle_between(made.orientations, middle.orientations).max()))
        end = between(first, last, span, 1.0)
        np.testing.assert_allclose(end.angular_velocities, last.angular_velocities, atol=1e-9)
        np.testing.assert_allclose(end.linear_velocities, last.linear_velocities, atol=1e-9)
    assert errors[0] / errors[1] > 10


def test_a_fast_spin_is_followed_through_more_than_half_a_turn():
    spin = np.array([0, 0, 60.0])
    first = bone(angular=spin)
    last = bone(turn=rotation.from_rotation_vector(spin / 15), angular=spin)
    made = between(first, last, 1 / 15, 0.25)
    expected = rotation.from_rotation_vector(spin / 60)
    assert rotation.angle_between(made.orientations[0], expected) < 1e-9
    np.testing.assert_allclose(made.angular_velocities[0], spin, atol=1e-9)

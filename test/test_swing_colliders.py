"""Masses of swings do not enter colliders: against an event-driven reference, and at random."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ragdoll_ros.model import rotation
from ragdoll_ros.model.state import State
from ragdoll_ros.model.swing import Link, Swing
from ragdoll_ros.model.swing_mount import MountedCollider, SwingMount
from ragdoll_ros.physics.swing.swings import Swings
from ragdoll_ros.physics.swing.track import Track

GRAVITY = np.array([0, 0, -9.8])


def still(_):
    return State(np.zeros((1, 3)), np.array([rotation.IDENTITY]), *np.zeros((2, 1, 3)))


def sphere(center, radius, bone=0):
    return MountedCollider(bone, np.array([center, center], float), radius)


def hung(links, colliders, motion=still, direction=(1, 0, 0), **changes):
    return Swings([mounted(links, colliders, direction, **changes)], GRAVITY, motion)


def reference(length, center, radius, d, rate, times):
    """Directions (t, 3) of a pendulum that falls on a sphere: free flight until it touches, then
    without its speed towards the sphere on the circle in which it and the tip's sphere meet, until
    the sphere would have to pull.
    """
    def normal(d):
        out = length * d - center
        out = out - (out @ d) * d
        return out / np.linalg.norm(out)

    def force(y):
        """Acceleration along the normal that keeps the tip on the sphere: with f = |l d - c|^2,
        f'' = 0 of d'' = -|d'|^2 d + P g/l + force n. f' = -2 l c . d'.
        """
        d, own = y[:3], free(0, y)[3:]
        return -(center @ own) / (center @ normal(d))

    def free(_, y):
        d, v = y[:3], y[3:]
        g = GRAVITY / length
        return np.concatenate([v, -(v @ v) * d + g - (g @ d) * d])

    def held(_, y):
        rates = free(0, y)
        rates[3:] += force(y) * normal(y[:3])
        return rates

    def arrives(_, y):
        return np.linalg.norm(length * y[:3] - center) - radius
    arrives.terminal, arrives.direction = True, -1

    def leaves(_, y):
        return force(y)
    leaves.terminal, leaves.direction = True, -1
    y, t, found, is_held = np.concatenate([d, rate]).astype(float), 0.0, {}, False
    events = []
    while t < times[-1]:
        path = solve_ivp(held if is_held else free, (t, times[-1]), y, 'DOP853', rtol=1e-10,
                         atol=1e-12, events=leaves if is_held else arrives, dense_output=True)
        for at in times[(times >= t) & (times <= path.t[-1])]:
            found[at] = path.sol(at)[:3]
        y, t = path.y[:, -1], path.t[-1]
        if path.status == 1:
            events.append((t, is_held))
            if not is_held:
                n = normal(y[:3])
                y[3:] -= (y[3:] @ n) * n
            is_held = not is_held and force(y) > 0
    return np.array([found[at] for at in times]), events


@pytest.mark.parametrize('rate', [20, 60, 240])
@pytest.mark.parametrize(('center', 'd', 'v'), [
    ((.2, 0, -.4), (1, 0, 0), (0, 0, 0)), ((.25, .1, -.45), (1, 0, 0), (0, 1, 0)),
    ((.1, -.3, -.3), (.6, -.8, 0), (0, 0, -1))])
def test_a_pendulum_falls_on_a_sphere_as_the_reference(rate, center, d, v):
    """It arrives, slides around and leaves, at any frame rate."""
    center = np.array(center, float)
    times = np.arange(0, 1.5, 1 / rate)
    expected, events = reference(.5, center, .2, d, v, times)
    assert events and not events[0][1]
    swings = hung((Link(.5),), [sphere(center, .2)], mode='pendulum', direction=d)
    swings.begin(0.0, np.array([d]), np.array([v]))
    found = np.array([swings.evaluate(t).directions[0] for t in times])
    # Of second order in steps of 10 ms: a pendulum alone has 2e-3 rad in 3 s.
    assert np.abs(found - expected).max() < 1e-3


def shaken(random):
    """Two bones that move and turn at 1 to 3 Hz: a smooth function of time."""
    rate, phase = 2 * np.pi * random.uniform(1, 3, 2)[:, None], random.uniform(0, 6, (2, 1))
    move, axis = random.normal(0, .06, (2, 3)), random.normal(0, .4, (2, 3))
    width = np.linalg.norm(axis, axis=1, keepdims=True)

    def at(t):
        sin, cos = np.sin(rate * t + phase), np.cos(rate * t + phase)
        half = width * sin / 2
        # The axis is fixed, so that the angular velocity is the rate of the rotation vector.
        turn = np.concatenate([axis / width * np.sin(half), np.cos(half)], axis=1)
        return State(move * sin, turn, move * rate * cos, axis * rate * cos)
    return at


def random_chain(random):
    """Some links with one or two spheres or capsules on two bones, none about the root: among
    three that close in on it, a mass may have no room.
    """
    colliders, directions = [], rotation.normalized(random.normal(size=(4, 3)))
    while len(colliders) < random.integers(1, 3):
        # About where gravity or a spring pulls the chain.
        way = rotation.normalized(random.normal(0, .4, 3) + [(0, 0, -1), directions[0]][
            random.integers(2)])
        ends = random.uniform(.1, .4) * way + np.array([np.zeros(3), random.normal(0, .1, 3)])
        radius = random.uniform(.05, .2)
        collider = MountedCollider(int(random.integers(2)), ends if random.random() < .5 else
                                   ends[[0, 0]], radius)
        # The root stays outside of those that move relative to it, too.
        if distance(np.zeros(3), collider.axis) > radius + (.2 if collider.bone else .02):
            colliders.append(collider)
    links = tuple(Link(random.uniform(.06, .25), .1, random.choice([0, .02, .3]),
                       random.choice([0, .3, 1]), tuple(direction),
                       radius=random.choice([0, .01]))
                  for direction in directions[:random.integers(1, 5)])
    return mounted(links, colliders)


def mounted(links, colliders, direction=(1, 0, 0), **changes):
    swing = Swing('s', 'b', (0, 0, 0), direction, links, **changes)
    return SwingMount(swing, 0, 's', np.zeros(3), np.array(swing.directions()), tuple(colliders))


def distance(point, axis):
    """From points (..., 3) to segments (..., 2, 3)."""
    along = axis[..., 1, :] - axis[..., 0, :]
    square = (along ** 2).sum(axis=-1)
    way = point - axis[..., 0, :]
    part = np.clip((way * along).sum(axis=-1) / np.where(square, square, 1.0), 0, 1)
    return np.linalg.norm(way - part[..., None] * along, axis=-1)


def inside(mount, states, positions):
    """How deep, m, masses at (t, n, 3) m are within the colliders, the most; below 0 outside."""
    places = np.array([state.positions for state in states])
    turns = np.array([state.orientations for state in states])
    deepest = -np.inf
    for collider in mount.colliders:
        axes = places[:, collider.bone, None] + rotation.rotate(
            turns[:, collider.bone, None], collider.axis)
        for k, link in enumerate(mount.swing.links):
            deepest = max(deepest, collider.radius + link.radius - distance(
                positions[:, k], axes).min())
    return deepest


@pytest.mark.parametrize('rate', [20, 60, 240])
def test_200_random_chains_are_never_inside(rate):
    """By more than 1 mm at any tick, the first included, on bones that shake them."""
    deepest = []
    for seed in range(200):
        random = np.random.default_rng(seed)
        mount = random_chain(random)
        bones_at, track = shaken(random), Track()
        swings = Swings([mount], GRAVITY, track)
        states, positions = [], []
        for tick in range(2 * rate + 1):
            states.append(bones_at(tick / rate))
            track.add(tick / rate, states[-1])
            positions.append(swings.evaluate(tick / rate).positions)
        deepest.append(inside(mount, states, np.array(positions)))
    # Most of them touch something.
    assert (np.array(deepest) > -1e-3).sum() > 100
    assert max(deepest) < 1e-3


def energies(rest, stiffness, colliders):
    """Energy per moment of inertia, 1/s^2, of an undamped link over 3 s at 60 Hz."""
    swings = hung((Link(.4, .1, stiffness),), colliders, direction=rest)
    found = []
    for tick in range(180):
        state = swings.evaluate(tick / 60)
        d, rate = state.directions[0], state.rates[0]
        angle = np.arccos(np.clip(d @ rotation.normalized(rest), -1, 1))
        # The moment of inertia m l^2 is 0.016 kg m^2.
        found.append(rate @ rate / 2 + 9.8 / .4 * d[2] + stiffness / .016 * angle ** 2 / 2)
    return np.array(found)


def test_energy_does_not_rise():
    """Of 100 links that fall on what does not move, some with springs: between any two ticks by no
    more than in their free motion, whose error is of second order.
    """
    rises, free, lost = [], [], 0
    for seed in range(100):
        random = np.random.default_rng(seed)
        rest = np.append(random.normal(size=2), 1.0)
        center = np.append(random.normal(0, .15, 2), -.35)
        stiffness = random.choice([0, .05])
        energy = energies(rest, stiffness, [sphere(center, .15)])
        lost += energy[-1] < energy[0] - .5
        rises.append(np.max(energy - np.minimum.accumulate(energy)))
        alone = energies(rest, stiffness, [])
        free.append(np.max(alone - np.minimum.accumulate(alone)))
    # Most arrive; the energy of one that falls from the top is 24.5 / s^2 above the middle.
    assert lost > 30
    assert max(rises) < 1.05 * max(free) < .05


def test_without_colliders_nothing_changes_and_far_ones_change_little():
    """To the bit, beside a chain that has some; far ones only divide the steps of fast chains."""
    links = tuple(Link(.1, .1, .05, .3) for _ in range(4))
    plain, near, far = (mounted(links, some, (0, 0, -1)) for some in (
        (), [sphere((.1, 0, -.2), .05)], [sphere((9, 0, 0), .05)]))
    motion = shaken(np.random.default_rng(3))
    alone, beside = Swings([plain], GRAVITY, motion), Swings([near, plain, far], GRAVITY, motion)
    for tick in range(120):
        expected = alone.evaluate(tick / 60).positions
        found = beside.evaluate(tick / 60).positions
        assert np.array_equal(found[4:8], expected)
        assert np.abs(found[8:] - expected).max() < 5e-3


def test_a_mass_that_starts_inside_starts_on_the_surface():
    swings = hung((Link(.3),), [sphere((.3, 0, -.02), .1)])
    position = swings.evaluate(0.0).positions[0]
    assert np.linalg.norm(position) == pytest.approx(.3)
    assert np.linalg.norm(position - (.3, 0, -.02)) == pytest.approx(.1, abs=1e-6)


def test_the_same_at_any_frame_rate():
    """Bones at rest: at 20, 60 and 240 Hz the same to rounding, after arrivals too."""
    found = []
    for rate in (20, 60, 240):
        swings = hung((Link(.2, .1, .1, .3), Link(.2, .1, .02, .3), Link(.1)),
                      [sphere((.25, .05, -.2), .12)])
        every = [swings.evaluate(tick / rate).positions for tick in range(2 * rate)]
        found.append(every[::rate // 20])
    assert np.abs(np.diff(found, axis=0)).max() < 1e-9

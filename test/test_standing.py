"""Dolls sleep where they rest, and only there: not balanced, and not while they still creep."""
import dataclasses
import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

from ragdoll_ros import Simulation, load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene, all_above_ground
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder
from ragdoll_ros.physics.accuracy import NORMAL

G = 9.8

SINGLE_DOLLS = ('article', 'drop', 'doll', 'article_doll', 'man', 'woman', 'man_faints',
                'woman_faints', 'ponytail')

UPRIGHT = 0.6
"""Share of a doll's greatest height of its centre of mass above which it has not fallen."""

BOX = Ragdoll('box', (Bone('box', Box((0.2, 0.2, 0.2)), 2.0, (0, 0, 0)),))


def advance_until_asleep(simulation, seconds=20.0):
    """Advance until all dolls sleep, for so many s of simulated time at most."""
    while not simulation.asleep and simulation.time < seconds * 1e9:
        simulation.advance()
    return simulation.asleep


def center_height(scene, positions):
    """Height, m, of the centre of mass of all bones over level ground at zero."""
    masses = np.array([bone.mass for bone in scene.bones])
    return float(masses @ positions[:, 2] / masses.sum())


def standing_height(scene):
    """Height, m, of the centre of mass of one doll in the bind pose, its lowest point at zero."""
    lifted = all_above_ground('standing', scene.dolls, clearance=0.0)
    doll = lifted.dolls[0]
    positions = [doll.bone_pose(bone).position for bone in doll.doll.bones]
    return center_height(scene, np.array(positions))


def stays_in_mujoco(scene, coordinates):
    """Whether copies in MuJoCo, moving at 1e-3 rad/s at random, keep their height for 5 s.

    What is unstable departs there as exp(t sqrt(g / l)): e^5 after 3 s for the 4 m of the tallest.
    """
    pytest.importorskip('mujoco')
    awake = dataclasses.replace(NORMAL, sleep=False)
    for seed in range(3):
        with Simulation(scene, accuracy=awake, engine='mujoco') as simulation:
            moved = dataclasses.replace(coordinates, v=1e-3 * np.random.default_rng(seed).normal(
                size=coordinates.v.shape))
            before = center_height(scene, simulation.place(moved).positions)
            for _ in range(500):
                state = simulation.advance()
            if center_height(scene, state.positions) < 0.9 * before:
                return False
    return True


def balanced_asleep(scene):
    """Whether a doll sleeps upright in a pose that MuJoCo does not keep; and whether it sleeps."""
    with Simulation(scene, engine='rigid') as simulation:
        asleep = advance_until_asleep(simulation)
        upright = center_height(scene, simulation.state.positions) > (
            UPRIGHT * standing_height(scene))
        coordinates = simulation.coordinates
    return asleep and upright and not stays_in_mujoco(scene, coordinates), asleep


@pytest.mark.parametrize('name', SINGLE_DOLLS)
def test_no_shipped_doll_sleeps_balanced(name):
    balanced, asleep = balanced_asleep(load_scene(name))
    assert asleep and not balanced


@pytest.mark.parametrize('name', ['article', 'ponytail'])
def test_what_leans_back_falls_backwards(name):
    """It lies on its back, its head against x, which it faced; its legs fold below it. Nothing
    pushes it aside but rounding, until it rolls over what lies below its back.
    """
    with Simulation(load_scene(name), engine='rigid') as simulation:
        torso = simulation.scene.bone_names.index('torso')
        start = simulation.state.positions[1]
        for _ in range(300):
            state = simulation.advance()
            if simulation.bones_on_ground[torso]:
                break
        back, side, _ = state.positions[1] - start
        assert back < -0.4 and abs(side) < 0.1
        assert advance_until_asleep(simulation)
        state = simulation.state
    back, side, _ = state.positions[1] - start
    assert back < -0.4 and abs(side) < -back / 2
    assert rotation.rotate(state.orientations[0], np.array((1.0, 0.0, 0.0)))[2] > 0.9


def random_tower(seed):
    """One to five bones on top of each other, on joints of a random kind, dropped upright."""
    rng, bones, joints, z = np.random.default_rng(seed), [], [], 0.0
    for k in range(rng.integers(1, 6)):
        width, height = rng.uniform(0.05, 0.3), rng.uniform(0.1, 0.5)
        shape = [Box((width, rng.uniform(0.05, 0.3), height)), Cylinder(width / 2, height),
                 Capsule(width / 2, height)][rng.choice(3, p=(0.6, 0.2, 0.2))]
        half = shape.half_extents[2]
        bones.append(Bone(f'bone_{k}', shape, rng.uniform(0.5, 5.0), (0, 0, z + half)))
        if k:
            kind = ('hinge', 'universal', 'ball')[rng.integers(3)]
            axes = ((0, 1, 0), (1, 0, 0))[:{'hinge': 1, 'universal': 2, 'ball': 1}[kind]]
            limits = {'hinge': ((0, 2),), 'universal': ((-1, 1),) * 2, 'ball': ()}[kind]
            joints.append(Joint(f'bone_{k - 1}', f'bone_{k}', kind, (0, 0, z), axes, limits,
                                damping=rng.choice((0.0, 0.2))))
        z += 2 * half + 0.01
    tower = Ragdoll('tower', tuple(bones), tuple(joints))
    scene = all_above_ground('tower', (Placement(tower),), clearance=rng.uniform(0.0, 0.4))
    return dataclasses.replace(scene, material=Material(0.7, 0.0, rng.choice((0.0, 0.5))))


def balanced_towers(seeds):
    """Seeds of the random towers that sleep balanced."""
    return [seed for seed in seeds if balanced_asleep(random_tower(seed))[0]]


def test_no_random_tower_sleeps_balanced():
    assert not balanced_towers(range(20))


@pytest.mark.slow
def test_none_of_two_hundred_random_towers_sleeps_balanced():
    assert not balanced_towers(range(200))


def upright(shape, mass=0.01):
    """A scene of one bone that stands on the ground, at rest."""
    bone = Bone('bone', shape, mass, (0, 0, 0))
    return all_above_ground('upright', (Placement(Ragdoll('one', (bone,))),), clearance=0.0)


def test_a_pencil_on_its_tip_falls():
    with Simulation(upright(Capsule(0.004, 0.17)), engine='rigid') as simulation:
        assert advance_until_asleep(simulation)
        assert simulation.state.positions[0, 2] == pytest.approx(0.004, abs=1e-4)


def test_a_pencil_on_its_flat_end_stands():
    """It falls past a barrier of g r^2 / h = 9e-4 J/kg, of 4 cm/s."""
    with Simulation(upright(Cylinder(0.004, 0.18)), engine='rigid') as simulation:
        assert advance_until_asleep(simulation, 1.0)
        assert simulation.state.positions[0, 2] == pytest.approx(0.09, abs=1e-5)


def stack():
    """Five boxes on top of each other."""
    return Scene('stack', tuple(Placement(BOX, f'box_{k}', (0, 0, 0.1 + 0.2 * k))
                                for k in range(5)), Ground(), Material(0.6, 0.0, 0.0))


def tent(name, doll, x, z, degrees=20):
    """Two cards of 0.4 x 0.3 x 0.02 m on z that lean on each other above x."""
    lean = math.radians(degrees)
    up, out = ((a * math.sin(lean) + b * math.cos(lean)) for a, b in ((0.01, 0.2), (0.2, 0.01)))
    return [Placement(doll, f'{name}_{side}', (x - side * (out + 1e-5), 0, z + up),
                      (0, side * math.sin(lean / 2), 0, math.cos(lean / 2))) for side in (1, -1)]


def card_house():
    """Two tents, a card across their tips, and a tent on it."""
    card = Ragdoll('card', (Bone('card', Box((0.02, 0.3, 0.4)), 0.5, (0, 0, 0)),))
    roof = Ragdoll('roof', (Bone('roof', Box((0.8, 0.3, 0.02)), 0.5, (0, 0, 0)),))
    tip = 0.4 * math.cos(math.radians(20))
    cards = (*tent('left', card, -0.2, 0), *tent('right', card, 0.2, 0),
             Placement(roof, 'roof', (0, 0, tip + 0.01)), *tent('top', card, 0, tip + 0.02))
    return Scene('card_house', cards, Ground(), Material(0.7, 0.0, 0.0))


def plank_on_box():
    """A plank leans on a box."""
    plank = Ragdoll('plank', (Bone('plank', Box((0.04, 0.2, 1.0)), 3.0, (0, 0, 0)),))
    block = Ragdoll('block', (Bone('block', Box((0.4, 0.4, 0.6)), 20.0, (0, 0, 0)),))
    lean = math.radians(25)
    up = 0.02 * math.sin(lean) + 0.5 * math.cos(lean)
    # Its face passes the upper edge of the block, at (-0.2, 0.6).
    foot = -0.2 - 0.02 / math.cos(lean) - (0.6 - up) * math.tan(lean)
    return Scene('lean', (Placement(block, 'block', (0, 0, 0.3)), Placement(
        plank, 'plank', (foot - 1e-4, 0, up), (0, math.sin(lean / 2), 0, math.cos(lean / 2)))),
        Ground(), Material(0.7, 0.0, 0.0))


@pytest.mark.parametrize(('make', 'moved'), [(stack, 1e-4), (card_house, 5e-3),
                                             (plank_on_box, 5e-3)])
def test_what_bears_itself_stays_and_sleeps(make, moved):
    """Within what it settles by, m: cards slide until they touch."""
    with Simulation(make(), engine='rigid') as simulation:
        start = simulation.state.positions
        assert advance_until_asleep(simulation, 5.0)
        assert np.abs(simulation.state.positions - start).max() < moved
        work = simulation.measures()['work_of_pushes_J']
    assert work == 0, 'and is not disturbed'


def balanced_crowd(count=3):
    """Dolls side by side that land evenly on their feet."""
    doll = load_scene('doll').dolls[0]
    return dataclasses.replace(load_scene('doll'), dolls=tuple(
        dataclasses.replace(doll, name=f'doll_{k}', position=(2.5 * k, 0.0, 0.0))
        for k in range(count)))


def falls(simulation, ticks=450):
    """States (t, n, 13) of a run."""
    return np.array([simulation.advance().rows for _ in range(ticks)])


def test_balanced_dolls_fall_to_the_same_bits():
    """For any number of workers, after a reset, in a second Simulation, and alone."""
    crowd = balanced_crowd()
    with Simulation(crowd, engine='rigid') as simulation:
        first = falls(simulation)
        simulation.reset()
        assert (falls(simulation) == first).all()
    with Simulation(crowd, engine='rigid', workers=2) as simulation:
        assert (falls(simulation) == first).all()
    lone = dataclasses.replace(crowd, dolls=crowd.dolls[:1])
    with Simulation(lone, engine='rigid') as simulation:
        assert (falls(simulation) == first[:, crowd.bone_slices[0]]).all()
    torsos = first[-1, [own.start for own in crowd.bone_slices]]
    assert (torsos[:, 2] < 0.4).all(), 'all have fallen'
    directions = torsos[:, :2] - first[0, [own.start for own in crowd.bone_slices], :2]
    assert np.abs(directions - directions[0]).max() > 0.01, 'not all alike'


def test_the_energy_of_the_disturbance_is_work():
    """1e-3 m/s or rad/s of each degree of freedom: less than 1e-3 J of 55 kg."""
    with Simulation(load_scene('doll'), engine='rigid') as simulation:
        excess = [simulation.energy_excess]
        while not simulation.measures()['work_of_pushes_J'] and simulation.time < 5e9:
            simulation.advance()
            excess.append(simulation.energy_excess)
        work = simulation.measures()['work_of_pushes_J']
        assert 0 < work < 1e-3
        assert simulation.kinetic_energy == pytest.approx(work, rel=1e-6)
        while not simulation.asleep:
            simulation.advance()
            excess.append(simulation.energy_excess)
        # Of a step's contact solve: 1e-10 of m g L, L = 2 m, of which there are four in a tick.
        assert np.diff(excess).max() < 4 * 1e-10 * 55 * 9.8 * 2
        assert simulation.measures()['work_of_pushes_J'] == work, 'once, as it falls'


def test_without_sleep_nothing_is_disturbed():
    with Simulation(load_scene('doll'), accuracy=dataclasses.replace(NORMAL, sleep=False),
                    engine='rigid') as simulation:
        for _ in range(200):
            simulation.advance()
        assert simulation.measures()['work_of_pushes_J'] == 0


def box_on_slope(degrees, share):
    """A box at rest on a slope, its coefficient of friction this share of the slope's tangent."""
    turn = rotation.from_rotation_vector(np.array((0, math.radians(degrees), 0)))
    normal = rotation.rotate(turn, np.array((0.0, 0.0, 1.0)))
    friction = share * math.tan(math.radians(degrees))
    return Scene('slope', (Placement(BOX, 'box', tuple(0.1 * normal), tuple(turn)),),
                 Ground(tuple(normal)), Material(friction, 0.0, 0.0))


@pytest.mark.parametrize('degrees', [5, 20, 40])
def test_a_box_that_creeps_is_awake(degrees):
    """.001 g sin(a) t^2 / 2: 6.7 mm in 2 s at 20 degrees."""
    with Simulation(box_on_slope(degrees, 0.999), engine='rigid') as simulation:
        start = simulation.state.positions
        for _ in range(200):
            state = simulation.advance()
        slid = np.linalg.norm(state.positions - start)
        assert not simulation.asleep
    # Friction is solved to 1e-5 m/s in each step: some 1 % of the speed.
    assert slid == pytest.approx(0.001 * G * math.sin(math.radians(degrees)) * 2, rel=0.01)


@pytest.mark.parametrize('degrees', [5, 20, 40])
def test_a_box_that_friction_holds_sleeps(degrees):
    with Simulation(box_on_slope(degrees, 1.001), engine='rigid') as simulation:
        start = simulation.state.positions
        assert advance_until_asleep(simulation, 1.0)
        assert np.linalg.norm(simulation.state.positions - start) < 1e-6

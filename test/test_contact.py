"""Falls and contact: the first touch, energy, friction, rolling, impacts, what must not sink."""
import dataclasses
import math

import numpy as np
import pytest
from conserved import conserved

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import NO_SLIP, SECOND, Ground, Material, Placement, Scene, height
from ragdoll_ros.model.shapes import Box, Capsule, Sphere
from ragdoll_ros.physics.accuracy import EXACT, NORMAL
from ragdoll_ros.physics.rigid_body import JointGap
from ragdoll_ros.physics.simulation import Simulation

DROP = load_scene('drop')
FIRST_TOUCH = math.sqrt(2 * 0.4 / 9.8)
BALL = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0.0, 0.0, 0.0)),))


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_first_touch_comes_when_a_free_fall_says(accuracy):
    with Simulation(DROP, accuracy=accuracy) as simulation:
        gained = -math.inf
        while gained < -55 * 9.8 * 0.01 + 1e-6:
            before = conserved(DROP, simulation.state).momentum[2]
            gained = conserved(DROP, simulation.advance()).momentum[2] - before
        assert simulation.time / SECOND - 0.01 <= FIRST_TOUCH <= simulation.time / SECOND


def lowest(scene, state):
    """Height, m, of the lowest point of all bones."""
    return min(height(bone, state.positions[i], state.orientations[i], scene.ground)
               for i, bone in enumerate(scene.bones))


def turned_start(seed):
    """The default scene with its doll turned at random, its lowest point 0.4 m up."""
    q = tuple(rotation.normalized(np.random.default_rng(seed).normal(size=4)))
    placement = dataclasses.replace(DROP.dolls[0], orientation=q)
    low = min(height(bone, *placement.bone_pose(bone), Ground())
              for bone in placement.doll.bones)
    placement = dataclasses.replace(placement, position=(0, 0, 0.4 - low))
    return dataclasses.replace(DROP, dolls=(placement,))


@pytest.mark.parametrize(('engine', 'seed'), [
    *(('auto', seed) for seed in range(20)), *(('bullet', seed) for seed in range(5))])
def test_a_fall_makes_no_energy_keeps_together_and_ends(engine, seed):
    """Bullet's account leaves 0.1 % alone, and its bones sink; the rigid engine's are lifted."""
    scene, rigid = turned_start(seed), engine == 'auto'
    gap = JointGap(scene)
    with Simulation(scene, engine=engine) as simulation:
        start = conserved(scene, simulation.state).energy
        while not simulation.asleep:
            state = simulation.advance()
            assert conserved(scene, state).energy <= start * (1 + (1e-5 if rigid else 1e-3))
            assert gap.gaps(state).max() <= (1e-12 if rigid else 1e-6)
            assert simulation.time <= 10 * SECOND
        assert -(0.001 if rigid else 0.005) <= lowest(scene, state) <= 0.002


def test_the_crowd_makes_no_energy():
    scene = load_scene('crowd')

    def energy(state):
        return sum(conserved(scene, state, doll).energy for doll in range(len(scene.dolls)))

    with Simulation(scene, accuracy='draft') as simulation:
        start = energy(simulation.state)
        for _ in range(100):
            assert energy(simulation.advance()) <= start * 1.001


@pytest.mark.parametrize('friction', [0.3, 0.5, math.inf])
def test_rolling_friction_is_a_lever_arm(friction):
    """A ball that rolls slows down by 5/7 g b / R; an even deceleration is exact in any step."""
    radius, arm = 0.1, 0.01
    scene = Scene('roll', (Placement(BALL, position=(0.0, 0.0, radius), velocity=(2.0, 0.0, 0.0),
                                     spin=(0.0, 2 / radius, 0.0)),), Ground(),
                  Material(friction, arm, 0.0))
    with Simulation(scene) as simulation:
        for _ in range(20):
            first = simulation.advance().linear_velocities[0, 0]
        for _ in range(40):
            last = simulation.advance().linear_velocities[0, 0]
    assert (first - last) / 0.4 == pytest.approx(5 / 7 * 9.8 * arm / radius, rel=1e-9)


def test_a_ball_that_spins_on_the_spot_goes_on():
    """It touches in a point: there is no friction of spinning."""
    scene = Scene('top', (Placement(BALL, position=(0, 0, 0.1), spin=(0, 0, 10)),), Ground())
    with Simulation(scene) as simulation:
        for _ in range(60):
            state = simulation.advance()
    assert state.angular_velocities[0] == pytest.approx((0, 0, 10), abs=1e-12)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
@pytest.mark.parametrize('apart', [0.5, 0.503, 0.51, 0.5151, 0.5299])
def test_a_ball_hands_its_momentum_on_to_another(accuracy, apart):
    """A central impact: v (1 - e) / 2 and v (1 + e) / 2, at whatever instant of the tick, but for
    the compliance of an impact, 1e-10 of W.
    """
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.1), 2.0, (0.0, 0.0, 0.0)),))
    scene = Scene('billiards', (Placement(ball, 'cue', velocity=(3.0, 0.0, 0.0)),
                                Placement(ball, 'target', position=(apart, 0.0, 0.0))),
                  ground=None, gravity=(0.0, 0.0, 0.0), material=Material(restitution=0.5))
    with Simulation(scene, accuracy=accuracy) as simulation:
        for _ in range(30):
            state = simulation.advance()
    assert state.linear_velocities[:, 0] == pytest.approx([0.75, 2.25], abs=5e-10)


def on_a_slope(degrees, friction, engine='auto'):
    """Way, m, that a box slides down a slope within a second."""
    tilt = math.radians(degrees)
    box = Ragdoll('box', (Bone('box', Box((0.4, 0.4, 0.1)), 5.0, (0.0, 0.0, 0.0)),))
    normal = (math.sin(tilt), 0.0, math.cos(tilt))
    placement = Placement(box, position=tuple(0.05 * n for n in normal),
                          orientation=tuple(rotation.from_rpy(0.0, tilt, 0.0)))
    scene = Scene('slope', (placement,), Ground(normal), material=Material(friction, 0.0, 0.0))
    with Simulation(scene, engine=engine) as simulation:
        start = simulation.state.positions[0]
        for _ in range(100):
            state = simulation.advance()
    return float(np.linalg.norm(state.positions[0] - start))


@pytest.mark.parametrize(('engine', 'settling', 'error'), [
    ('auto', 1e-9, 1e-9), ('bullet', 0.004, 0.02)])
def test_friction_holds_up_to_its_angle(engine, settling, error):
    """Coulomb's: no slip below atan(mu), above g (sin - mu cos) t^2 / 2.

    In bullet the box settles, by as much as it sinks; for rigid an even acceleration is exact.
    """
    assert on_a_slope(30, 0.7, engine) < settling
    assert on_a_slope(50, 2.0, engine) < settling
    tilt = math.radians(50)
    way = 9.8 * (math.sin(tilt) - 0.7 * math.cos(tilt)) / 2
    assert on_a_slope(50, 0.7, engine) == pytest.approx(way, rel=error)


def test_friction_without_limit_holds_on_any_slope():
    assert on_a_slope(70, math.inf, 'rigid') < 1e-9


def test_friction_without_limit_is_a_large_one_for_bullet():
    """Its solver does not end with larger ones."""
    assert on_a_slope(50, math.inf, 'bullet') == on_a_slope(50, NO_SLIP, 'bullet')


@pytest.mark.parametrize('engine', ['auto', 'bullet'])
def test_the_longest_tick_ends_a_fast_fall_on_the_ground(engine):
    """At 28 m/s, in ticks of 0.2 s: the blow takes most of its 22 kJ, and what is left, of half
    the speed at the most, throws it up and about until it lies.
    """
    scene = load_scene('drop')
    fast = dataclasses.replace(scene.dolls[0], velocity=(0.0, 0.0, -28.0))
    scene = dataclasses.replace(scene, dolls=(fast,), step=0.2)
    with Simulation(scene, accuracy='exact', engine=engine) as simulation:
        energies = [conserved(scene, simulation.state).energy]
        while not simulation.asleep:
            state = simulation.advance()
            energies.append(conserved(scene, state).energy)
            assert lowest(scene, state) >= -0.005
            assert simulation.time <= 10 * SECOND
    assert lowest(scene, state) < 0.005
    assert np.diff(energies).max() < 1e-5 * energies[0]
    assert energies[1] < 0.1 * energies[0]


@pytest.mark.parametrize('tick', [0.2, 0.1, 0.05, 0.01])
def test_what_turns_fast_hits_the_ground_at_long_ticks_too(tick):
    """A rod of 1 m at 30 rad/s, 0.3 m high: its end is in the ground four times in a tick."""
    rod = Ragdoll('rod', (Bone('rod', Capsule(0.05, 0.9), 2.0, (0.0, 0.0, 0.0)),))
    scene = Scene('rod', (Placement(rod, position=(0.0, 0.0, 0.3), velocity=(0.0, 0.0, 3.0),
                                    orientation=tuple(rotation.from_rpy(0, math.pi / 2, 0)),
                                    spin=(0.0, 30.0, 0.0)),), Ground(), step=tick)
    with Simulation(scene) as simulation:
        for _ in range(round(0.4 / tick)):
            state = simulation.advance()
    assert abs(state.angular_velocities[0, 1]) < 25


@pytest.mark.parametrize('direction', range(6))
def test_a_doll_dragged_over_the_ground_is_borne_by_it(direction):
    """At up to 80 m/s; what is found past a limit or in the ground is what one step errs by."""
    turn = math.radians(60 * direction + 10)
    with Simulation(DROP) as simulation:
        simulation.push(Push('torso', (2000 * math.cos(turn), 2000 * math.sin(turn), 0.0),
                             start=0.3, duration=2.0))
        for _ in range(250):
            simulation.advance()
            measures = simulation.measures()
            assert measures['sinking_m'] < 0.001
            assert math.degrees(measures['limit_overshoot_rad']) < 0.2


def test_a_doll_in_the_floor_starts_on_it_and_stays_calm():
    scene = dataclasses.replace(DROP, dolls=(dataclasses.replace(
        DROP.dolls[0], position=(0, 0, -0.6)),))
    with Simulation(scene) as simulation:
        assert lowest(scene, simulation.state) == pytest.approx(0, abs=1e-9)
        # A fall from a height of 1.5 m reaches 5.4 m/s.
        assert all(np.abs(simulation.advance().linear_velocities).max() < 5.4 for _ in range(200))


@pytest.mark.parametrize('accuracy', [NORMAL, EXACT])
def test_what_lies_goes_on_lying_where_it_is_put_down(accuracy):
    """On the ground, and limbs on each other: that is no error of the start.

    Joints that sag against their damping go on to, as they do in a twin that is left alone.
    """
    awake = dataclasses.replace(accuracy, sleep=False)
    with Simulation(DROP, accuracy=awake) as simulation, Simulation(DROP, accuracy=awake) as twin:
        for _ in range(600):
            simulation.advance()
            twin.advance()
        simulation.place(simulation.coordinates)
        for _ in range(30):
            state, left = simulation.advance(), twin.advance()
    # It settles anew, as contact points begin anew too, within some tenths of a mm.
    assert np.linalg.norm(state.positions - left.positions, axis=1).max() < 0.0005


def along_one_way(friction, bones, joints, angle=0.0, rate=0.0):
    """Coordinates of a doll without gravity after 0.1 s, its last joint moved, and the energy that
    it has won, J. Nothing is lost in a blow.
    """
    scene = Scene('s', (Placement(Ragdoll('d', bones, joints)),), None, gravity=(0, 0, 0),
                  material=Material(friction=friction, restitution=1.0))
    with Simulation(scene, engine='rigid') as simulation:
        start = simulation.coordinates
        start.q[-1], start.v[-1] = angle, rate
        simulation.place(start)
        for _ in range(10):
            simulation.advance()
        return simulation.coordinates, simulation.measures()['energy_excess_J']


@pytest.mark.parametrize('friction', [0.0, 0.5, np.inf])
def test_bones_that_no_joint_lets_slide_bounce_whatever_the_friction(friction):
    """Both turn about one axis: along it nothing can move, and across it nothing slides, so that
    friction has nothing to brake. A blow that loses nothing keeps the energy, here some joules.
    """
    bones = (Bone('hub', Sphere(0.05), 1.0, (0, 0, 0)), Bone('a', Sphere(0.025), 1.0, (0.3, 0, 0)),
             Bone('b', Sphere(0.025), 1.0, (0, 0.3, 0)))
    joints = (Joint('hub', 'a', 'fixed', (0, 0, 0)),
              Joint('hub', 'b', 'hinge', (0, 0, 0), ((0, 0, 1),)))
    met, won = along_one_way(friction, bones, joints, np.radians(-75), -8.0)
    assert met.v[-1] > 1
    assert abs(won) < 1e-9


def test_what_no_joint_can_open_rests():
    """Two bones that touch along the axis about which one of them turns."""
    bones = (Bone('hub', Sphere(0.02), 1.0, (0, 0, 0)), Bone('a', Sphere(0.03), 1.0, (0, 0, 0.06)),
             Bone('b', Sphere(0.03), 1.0, (0, 0, 0.1195)))
    joints = (Joint('hub', 'a', 'fixed', (0, 0, 0)),
              Joint('hub', 'b', 'hinge', (0, 0, 0), ((0, 0, 1),)))
    rest, _ = along_one_way(np.inf, bones, joints)
    assert np.abs(rest.v).max() < 1e-12


def test_a_stretch_of_two_picoseconds_is_one_step():
    """What is left of a tick after a touch may be any length. To 1e-8 m/s contacts are solved."""
    with Simulation(DROP, engine='rigid') as simulation:
        for _ in range(60):
            simulation.advance()
        before = simulation.state.rows
        simulation._engine.advance(2e-12, [], [])
        assert simulation._engine.state.rows == pytest.approx(before, abs=1e-7)

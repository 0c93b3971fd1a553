"""Motors: a spring with a torque limit on each joint, against closed forms and an integrator."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.motors import Motors, angle_inertias
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.simulation import Simulation

HEAVY, MASS, LENGTH = 1e7, 2.0, 0.8
ARM = LENGTH / 2
INERTIA = MASS * (LENGTH ** 2 + 0.05 ** 2) / 12 + MASS * ARM ** 2
"""kg m^2, of the bar about its joint."""


def pendulum(gravity=0.0, **motors):
    """A bar that hangs by a hinge, about y, beside a block that stands on the ground, so heavy that
    it stays; it swings away from it.
    """
    block = Bone('block', Box((1.0, 1.0, 1.0)), HEAVY, (0.6, 0, -0.5))
    bar = Bone('bar', Box((0.05, 0.05, LENGTH)), MASS, (0, 0, -ARM))
    doll = Ragdoll('pendulum', (block, bar), (
        Joint('block', 'bar', 'hinge', (0, 0, 0), ((0, 1, 0),), ((-3.1, 3.1),)),))
    return Scene('pendulum', (Placement(doll, position=(0, 0, 1), motors=Motors(**motors)),),
                 Ground() if gravity else None, gravity=(0.0, 0.0, -gravity))


def angles(scene, target, ticks, accuracy='exact', rates=None, strength=None):
    """Angle and rate (ticks, 2) of the bar, whose motor's target is set at the start."""
    found = []
    with Simulation(scene, accuracy=accuracy) as simulation:
        simulation.set_pose_target({'bar': target}, rates)
        if strength is not None:
            simulation.set_strength(strength)
        for _ in range(ticks):
            simulation.advance()
            found.append((simulation.joint_angles[0], simulation.joint_rates[0]))
        if scene.ground is None:
            assert abs(simulation.energy_excess) < 1e-7 * (1 + sum(map(abs, simulation.work)))
    return np.array(found)


def reference(stiffness, damping, most, target, duration, rate=0.0, until=math.inf, gravity=0.0):
    """Angle and rate at the end, by scipy. The block's motion changes them by MASS / HEAVY."""
    def f(t, y):
        moved, speed = (target + rate * min(t, until), rate if t < until else 0.0)
        torque = -stiffness * (y[0] - moved) - damping * (y[1] - speed)
        torque = min(max(torque, -most), most) - MASS * gravity * ARM * math.sin(y[0])
        return [y[1], torque / INERTIA]
    return solve_ivp(f, (0, duration), (0, 0), rtol=1e-10, atol=1e-12, max_step=1e-3).y[:, -1]


def test_the_inertia_that_hangs_on_a_joint():
    assert angle_inertias(pendulum().dolls[0].doll) == pytest.approx({'bar': INERTIA}, rel=1e-12)


def test_inertias_are_the_diagonal_of_mujocos_mass_matrix():
    """Of `man`, whose joints are hinges, universal and ball joints, in the bind pose."""
    mujoco = pytest.importorskip('mujoco')
    from ragdoll_ros.files.mjcf import to_mjcf
    scene = load_scene('man')
    doll = scene.dolls[0].doll
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    found = angle_inertias(doll)
    inertias = [matrix[model.jnt_dofadr[k], model.jnt_dofadr[k]]
                for k in range(model.njnt) if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_HINGE]
    assert sorted(found.values()) == pytest.approx(sorted(inertias), rel=1e-9)


def test_a_motor_within_its_limit_is_a_damped_oscillator():
    """Below critical damping; exact: within 1e-5 of the closed form, of an amplitude of 1."""
    frequency, ratio, duration = 2.0, 0.25, 0.7
    natural = 2 * math.pi * frequency
    damped = natural * math.sqrt(1 - ratio ** 2)
    found = angles(pendulum(frequency=frequency, damping_ratio=ratio), 1.0, 70)[-1, 0]
    decay = math.exp(-ratio * natural * duration)
    phase = damped * duration
    assert found == pytest.approx(1 - decay * (math.cos(phase) + ratio / math.sqrt(
        1 - ratio ** 2) * math.sin(phase)), abs=1e-4)


@pytest.mark.parametrize('accuracy, close', [('draft', 0.02), ('normal', 4e-3), ('exact', 1e-4)])
@pytest.mark.parametrize('strength', [1.0, 0.5])
def test_a_motor_at_its_limit_has_that_torque(accuracy, close, strength):
    """A far target with a small torque: constant acceleration at first, to rounding; then the
    spring, against an integrator.
    """
    most = 0.5 * strength
    scene = pendulum(stiffness=3.0, damping=0.4, max_torque=0.5)
    found = angles(scene, 1.5, 150, accuracy, strength=strength)
    times = 0.01 * np.arange(1, 31)
    assert found[:30, 0] == pytest.approx(most / INERTIA * times ** 2 / 2, rel=1e-4)
    wanted = reference(3.0 * strength, 0.4 * strength, most, 1.5, 1.5)
    assert found[-1] == pytest.approx(wanted, abs=close)


def test_a_target_moves_on_at_its_rate_for_a_fifth_of_a_second():
    scene = pendulum(stiffness=40.0, damping=4.0)
    found = angles(scene, 0.1, 50, rates={'bar': 2.0})
    # Second order in the steps of 1 ms: at a rate that decays in 0.1 s.
    assert found[18] == pytest.approx(reference(40, 4, math.inf, 0.1, 0.19, 2.0, 0.2), abs=5e-4)
    assert found[-1] == pytest.approx(reference(40, 4, math.inf, 0.1, 0.5, 2.0, 0.2), abs=5e-4)
    assert found[-1, 0] == pytest.approx(0.5, abs=0.1), 'the target has stopped'


def test_a_motor_holds_against_gravity_up_to_its_torque():
    """A bar that is to be level: with too little torque it swings to where the motor's work is that
    against gravity, 0.5 x = 1 - cos x, and back to 0.
    """
    weight = MASS * 9.8 * ARM
    far = angles(pendulum(9.8, frequency=8, max_torque=0.5 * weight), math.pi / 2, 600, 'normal')
    highest = brentq(lambda x: 0.5 * x - 1 + math.cos(x), 0.5, 2)
    assert far[:, 0].max() == pytest.approx(highest, abs=1e-3)
    assert far[100:, 0].min() == pytest.approx(0, abs=1e-3)
    near = angles(pendulum(9.8, frequency=8, max_torque=2 * weight), math.pi / 2, 600, 'normal')
    sag = weight / (INERTIA * (2 * math.pi * 8) ** 2)  # of a stiff spring
    assert near[-1, 0] == pytest.approx(math.pi / 2 - sag, abs=1e-3)


def test_the_velocity_of_an_orbit_on_a_saturated_motor():
    """Energy: the work of a constant torque is torque times angle."""
    scene = pendulum(9.8, stiffness=1e6, damping=0.0, max_torque=20.0)
    found = angles(scene, 3.0, 20, 'exact')
    moved, rate = found[-1]
    assert 0.3 < moved < 2.5
    assert INERTIA * rate ** 2 / 2 == pytest.approx(
        20.0 * moved - MASS * 9.8 * ARM * (1 - math.cos(moved)), rel=1e-4)


@pytest.mark.parametrize('name', ['doll', 'man'])
def test_without_strength_a_doll_is_limp_to_the_bit(name):
    scene = load_scene(name)
    limp, = scene.dolls
    rows = []
    for motors in (None, Motors(strength=0.0), Motors()):
        with Simulation(dataclasses.replace(
                scene, dolls=(dataclasses.replace(limp, motors=motors),))) as simulation:
            if motors and motors.strength:
                simulation.set_strength(0.0)
            rows.append(simulation.run(120).tobytes())
    assert rows[0] == rows[1] == rows[2]


def test_motors_hold_a_pose_in_the_air():
    """In free fall, after a push on a shin; what is left is the bend of a doll that spins."""
    scene = load_scene('drop')
    placement = dataclasses.replace(scene.dolls[0], position=(0, 0, 60), motors=Motors())
    with Simulation(dataclasses.replace(scene, dolls=(placement,))) as simulation:
        simulation.push(Push('left_shin', force=(300, 0, 0), duration=0.1))
        simulation.run(10)
        bent = abs(simulation.joint_angles).max()
        assert bent > 0.05
        simulation.run(150)
        assert abs(simulation.joint_angles).max() < 0.1 * bent
        assert simulation.energy_excess <= 1e-6 * simulation.work[0]


def random_run(seed):
    """Rise of energy from nothing, J, and scale, of a doll with random motors, targets, strengths
    and pushes.
    """
    rng = np.random.default_rng(seed)
    scene = load_scene(('doll', 'man', 'article', 'woman')[seed % 4])
    motors = Motors(frequency=rng.uniform(0, 20), damping_ratio=rng.uniform(0, 2),
                    max_torque=rng.choice([math.inf, 10 ** rng.uniform(0, 3)]),
                    strength=rng.uniform())
    doll = dataclasses.replace(scene.dolls[0], motors=motors)
    with Simulation(dataclasses.replace(scene, dolls=(doll,)),
                    accuracy=('draft', 'normal', 'exact')[seed % 3]) as simulation:
        names, bones = scene.angle_names, scene.bone_names
        limits = {name: span or (-1, 1) for joint in doll.doll.joints if not joint.is_free_ball
                  for name, span in zip(joint.angle_names, joint.angle_limits, strict=True)}
        for _ in range(6):
            some = [name for name in names if name in limits and rng.uniform() < 0.5]
            simulation.set_pose_target(
                {name: rng.uniform(*limits[name]) for name in some},
                {name: rng.normal() for name in some[::2]})
            simulation.set_strength(rng.uniform(), [bones[1 + rng.integers(len(bones) - 1)]])
            simulation.push(Push(bones[rng.integers(len(bones))], tuple(rng.normal(size=3) * 100),
                                 duration=0.1))
            simulation.run(10)
            assert np.isfinite(simulation.state.rows).all()
        scale = 1 + sum(map(abs, simulation.work)) + simulation.kinetic_energy
        # Past a limit, 0.2 degrees are promised at normal and exact.
        past = simulation.measures()['limit_overshoot_rad'] if seed % 3 else 0.0
        return simulation.energy_excess, scale, past


@pytest.mark.parametrize('seed', range(12))
def test_motors_take_energy_from_their_work_alone(seed):
    excess, scale, overshoot = random_run(seed)
    assert excess <= 1e-5 * scale and overshoot < math.radians(0.2)


@pytest.mark.slow
@pytest.mark.parametrize('first', range(100, 1100, 100))
def test_a_thousand_runs_take_energy_from_work_alone(first):
    for seed in range(first, first + 100):
        excess, scale, overshoot = random_run(seed)
        assert excess <= 1e-5 * scale and overshoot < math.radians(0.2), seed


def test_a_scene_keeps_its_motors(tmp_path):
    path = tmp_path / 'held.yaml'
    path.write_text("""ground: {}
dolls:
  - {doll: doll, position: [0, 0, 0.5], motors: {}}
  - doll: doll
    name: second
    position: [2, 0, 0.5]
    angles_deg: {left_shin: 40}
    motors: {frequency: 3, stiffness: {left_shin: 200}, max_torque: 50, strength: 0.5}
""")
    scene = load_scene(str(path))
    assert scene.dolls[0].motors == Motors()
    assert scene.dolls[1].motors == Motors(3, stiffness={'left_shin': 200.0}, max_torque=50,
                                           strength=0.5)
    save_scene(scene, str(tmp_path / 'again.yaml'))
    assert load_scene(str(tmp_path / 'again.yaml')).dolls == scene.dolls
    with Simulation(scene) as simulation:
        spring = {each.angle: each for each in simulation.holds}['second/left_shin']
        assert (spring.target, spring.stiffness, spring.max_torque, spring.strength) == (
            pytest.approx(math.radians(40)), 200, 50, 0.5)
        simulation.set_strength(0.2, 'second')
        assert {each.strength for each in simulation.holds} == {1.0, 0.2}
        simulation.go_limp('second')
        assert all(each.angle.startswith('doll/') for each in simulation.holds)
        simulation.reset()
        assert {each.strength for each in simulation.holds} == {1.0, 0.5}


@pytest.mark.parametrize('wrong, text', [
    ({'strength': 2}, 'strength'), ({'frequency': -1}, 'frequency'),
    ({'stiffness': {'nose': 5}}, 'nose'), ({'max_torque': {'left_shin': -5}}, 'left_shin'),
    ({'speed': 1}, 'speed'), ({'damping': 'much'}, 'damping')])
def test_a_wrong_entry_names_its_place(tmp_path, wrong, text):
    import yaml
    path = tmp_path / 'wrong.yaml'
    path.write_text(yaml.safe_dump({'dolls': [{'doll': 'doll', 'motors': wrong}]}))
    with pytest.raises(errors.ModelErrors) as raised:
        load_scene(str(path))
    assert 'dolls[0].motors' in str(raised.value) and text in str(raised.value)


def test_what_is_wrong_is_refused():
    with Simulation(load_scene('drop')) as simulation:
        with pytest.raises(errors.WrongForm, match='an angle with a spring'):
            simulation.set_pose_target({'left_shin': 1.0})
        with pytest.raises(errors.UnknownJoint, match='left_knee'):
            simulation.set_pose_target({'left_knee': 1.0})
        with pytest.raises(errors.OutOfRange, match='strength'):
            simulation.set_strength(1.5)
        with pytest.raises(errors.UnknownJoint, match='nose'):
            simulation.set_strength(0.5, ['nose'])
        with pytest.raises(errors.WrongForm, match='names'):
            simulation.set_strength({'left_shin': 0.5}, ['left_shin'])
        with pytest.raises(errors.UnknownDoll, match='nobody'):
            simulation.set_strength(0.5, 'nobody')
        simulation.hold('left_shin', 100, max_torque=10)
        with pytest.raises(errors.NotFinite, match='left_shin'):
            simulation.set_pose_target({'left_shin': math.nan})
        with pytest.raises(errors.OutOfRange, match='max_torque'):
            simulation.hold('left_shin', 100, max_torque=-1)


def test_events_repeat_motors_to_the_bit():
    from ragdoll_ros.physics.logged_simulation import LoggedSimulation, apply_event
    scene = load_scene('man')
    scene = dataclasses.replace(scene, dolls=(dataclasses.replace(
        scene.dolls[0], motors=Motors(frequency=3)),))
    log = []
    with LoggedSimulation(scene) as simulation:
        simulation.on_event = lambda name, arguments: log.append((tick, name, arguments))
        for tick in range(60):
            if tick % 20 == 5:
                simulation.set_pose_target({'l_knee': 0.1 * tick / 5}, {'l_knee': 0.5})
                simulation.set_strength(tick / 60, ['l_knee', 'head'])
                simulation.set_strength({'r_knee': tick / 60, 'left_thigh': 0.7})
                simulation.hold('r_knee', 50, 2, max_torque=3)
            simulation.advance()
        wanted = simulation.state.rows.tobytes()
    with Simulation(scene) as simulation:
        for tick in range(60):
            for _, name, arguments in [each for each in log if each[0] == tick]:
                apply_event(simulation, name, arguments)
            simulation.advance()
        assert simulation.state.rows.tobytes() == wanted


@pytest.fixture(scope='module')
def walker():
    """A character that walks by the animation of its file, in weightlessness, with stiff motors."""
    scene = load_scene('walker_faints')
    placement = dataclasses.replace(scene.dolls[0], motors=Motors(frequency=30),
                                    animation=dataclasses.replace(
        scene.dolls[0].animation, limp_at=1.5))
    return dataclasses.replace(scene, dolls=(placement,), ground=None, gravity=(0, 0, 0))


def test_motors_follow_an_animation(walker):
    """The lag of springs is acceleration over square of frequency: a quarter at twice of it."""
    placement = walker.dolls[0]
    motion, largest = placement.animation.motion, []
    for frequency in (30, 60):
        off = []
        powered = dataclasses.replace(placement, motors=Motors(frequency))
        with Simulation(dataclasses.replace(walker, dolls=(powered,))) as simulation:
            for _ in range(140):
                simulation.advance()
                phase = simulation.time / 1e9 % motion.duration
                due = motion.layout.joint_angles(motion.at(phase).q)
                off.append(simulation.joint_angles - due)
            assert simulation.animated == (placement.name,)
            assert np.ptp(simulation.state.positions[:, 0]) > 0.1
            simulation.run(20)
            assert not simulation.animated and not simulation.holds, 'it is limp at 1.5 s'
        largest.append(np.abs(off).max())
    assert largest[1] < 0.4 * largest[0] < 0.1


def test_without_strength_an_animated_doll_is_limp_from_the_start(walker):
    """To the bit that which starts limp in the animation's first instant; to rounding of angles to
    1e-9 degrees.
    """
    placement = dataclasses.replace(walker.dolls[0], motors=Motors(strength=0))
    limp = dataclasses.replace(placement.start, motors=None)
    ends = []
    for each in (placement, limp):
        with Simulation(dataclasses.replace(walker, dolls=(each,))) as simulation:
            ends.append(simulation.run(50)[-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


def test_a_doll_with_motors_comes_and_goes(walker):
    scene = load_scene('drop')
    with Simulation(scene) as simulation:
        simulation.hold('left_shin', 10)
        simulation.add(dataclasses.replace(scene.dolls[0], name='second', position=(3, 0, 1),
                                           motors=Motors()))
        assert len(simulation.holds) == 1 + len(scene.angle_names)
        simulation.go_limp(['second/right_shin'])
        simulation.add(dataclasses.replace(scene.dolls[0], name='third', position=(6, 0, 1),
                                           motors=Motors()))
        assert len(simulation.holds) == 2 * len(scene.angle_names)
        simulation.remove('third')
        assert 'second/right_shin' not in {each.angle for each in simulation.holds}
        simulation.remove('second')
        assert [each.angle for each in simulation.holds] == ['left_shin']

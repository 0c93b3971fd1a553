"""Dolls whose root is attached to the world: chains against MuJoCo and closed forms, contacts."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.follow import Follow
from ragdoll_ros.model.motors import Motors
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule, Sphere
from ragdoll_ros.model.static_body import StaticBody
from ragdoll_ros.physics.simulation import Simulation

COUNTS = (1, 2, 3, 5, 6, 8, 12, 40)
KINDS = ('hinge', 'universal', 'ball')
ACCURACIES = ('draft', 'normal', 'exact')


def chain(count, link=0.2, damping=0.0, kinds=KINDS, limits=((-3.0, 3.0),) * 3, start=(0, 0, 0)):
    """A fixed block with count - 1 capsules that hang on each other; their frames are turned."""
    bones, joints = [Bone('b0', Box((0.1, 0.12, 0.08)), 1.0, start)], []
    for k in range(1, count):
        top = np.array(start) - (0, 0, 0.05 + link * (k - 1))
        bones.append(Bone(f'b{k}', Capsule(0.02, link - 0.06), 0.3 + 0.1 * (k % 3),
                          tuple(top - (0, 0, link / 2)),
                          tuple(rotation.from_rpy(0.1 * k, 0.05, 0))))
        kind = kinds[k % len(kinds)]
        axes = {'hinge': ((0, 1, 0),), 'universal': ((1, 0, 0), (0, 1, 0)),
                'ball': ((0, 0, 1),)}[kind]
        joints.append(Joint(f'b{k - 1}', f'b{k}', kind, tuple(top), axes,
                            ((-1.4, 1.4), limits[0]) if kind == 'ball' else limits[:len(axes)],
                            damping=damping))
    return Ragdoll('chain', tuple(bones), tuple(joints))


def hung(doll, **placed):
    """The doll on its fixed root in a scene with gravity alone; nothing collides."""
    return Scene('hung', (Placement(doll, fixed_root=True, **placed),), None,
                 self_collision=False)


def some_angles(doll, spread, seed=3):
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-spread, spread)
            for joint in doll.joints for name in joint.angle_names}


def energy(simulation):
    """Kinetic energy, and that in gravity, J."""
    masses = np.array([bone.mass for bone in simulation.scene.bones])
    return simulation.kinetic_energy + 9.8 * masses @ simulation.state.positions[:, 2]


def assert_stays(state, before, bone=0):
    """The root is where it was and does not move; its quaternion is normalised to rounding."""
    assert np.array_equal(state.positions[bone], before[:3])
    assert np.abs(state.orientations[bone] - before[3:7]).max() < 1e-15
    assert not state.rows[bone, 7:].any()


def mujoco_positions(scene, duration, rates):
    """(n, 3) of all bones after ``duration`` s, by RK4 with steps of 0.1 ms."""
    mujoco = pytest.importorskip('mujoco')
    from ragdoll_ros.files.mjcf import to_mjcf
    model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    placement, = scene.dolls
    for values, where, at in ((placement.angles, data.qpos, model.jnt_qposadr),
                              (rates, data.qvel, model.jnt_dofadr)):
        for name, value in values.items():
            where[at[model.joint(name).id]] = value
    for _ in range(round(duration / 1e-4)):
        mujoco.mj_step(model, data)
    return np.array([data.body(name).xpos for name in scene.bone_names])


@pytest.mark.parametrize('count', COUNTS)
def test_a_chain_swings_as_in_mujoco(count):
    """From bent joints, for 0.3 s; a chain of 40 is chaotic, and starts nearer to its rest."""
    doll = chain(count)
    angles = some_angles(doll, 0.5 if count < 12 else 0.05)
    scene = hung(doll, position=(1, 2, 3), orientation=tuple(rotation.from_rpy(0.3, -0.4, 1)),
                 angles=angles)
    with Simulation(scene, accuracy='exact') as simulation:
        first = simulation.state.rows[0].copy()
        simulation.run(30)
        found = simulation.state
        excess = simulation.energy_excess
    assert_stays(found, first)
    # MuJoCo's RK4 at 0.1 ms has errors of 1e-9 here.
    assert np.abs(found.positions - mujoco_positions(scene, 0.3, {})).max() < 1e-7
    assert abs(excess) < 1e-8 * doll.mass * 9.8


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_large_swing_takes_the_closed_forms_period(accuracy):
    """A bar released level: 4 K(1/2) / omega, by the arithmetic-geometric mean."""
    length, mass = 0.8, 2.0
    bar = Bone('bar', Box((0.04, 0.04, length)), mass, (0, 0, -length / 2))
    doll = Ragdoll('pendulum', (Bone('pivot', Sphere(0.02), 1.0, (0, 0, 0)), bar),
                   (Joint('pivot', 'bar', 'hinge', (0, 0, 0), ((0, 1, 0),), ((-3, 3),)),))
    scene = dataclasses.replace(hung(doll, angles={'bar': math.pi / 2}), step=0.01)
    inertia = mass * (length ** 2 + 0.04 ** 2) / 12 + mass * length ** 2 / 4
    omega = math.sqrt(mass * 9.8 * length / 2 / inertia)
    a, b = 1.0, math.cos(math.pi / 4)
    for _ in range(8):
        a, b = (a + b) / 2, math.sqrt(a * b)
    period = 2 * math.pi / omega / a
    with Simulation(scene, accuracy=accuracy) as simulation:
        angles = [float(simulation.joint_angles[0])]
        for _ in range(round(period / 0.01)):
            simulation.advance()
            angles.append(float(simulation.joint_angles[0]))
        rate = float(simulation.joint_rates[0])
        # At the end of a period it turns: angle = pi/2 - w^2 t^2 / 2 about that instant.
        late = simulation.time * 1e-9 - period
    assert rate == pytest.approx(-omega ** 2 * late, abs=2e-3)
    assert angles[-1] == pytest.approx(math.pi / 2 - (omega * late) ** 2 / 2, abs=1e-4)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('restitution', [0.1, 0.5, 1.0])
def test_a_ball_strikes_a_hanging_bar(accuracy, restitution):
    """Without friction, at the bar's end: angular momentum about the pivot, and Newton's law."""
    length, mass, ball_mass, speed, radius = 1.0, 3.0, 2.0, 2.0, 0.05
    bar = Bone('bar', Box((0.04, 0.2, length)), mass, (0, 0, -length / 2))
    door = Ragdoll('door', (Bone('post', Sphere(0.02), 1.0, (0, 0, 0)), bar),
                   (Joint('post', 'bar', 'hinge', (0, 0, 0), ((0, 1, 0),), ((-3, 3),)),))
    ball = Ragdoll('ball', (Bone('ball', Sphere(radius), ball_mass, (0, 0, 0)),))
    down = 0.7
    scene = Scene('strike', (
        Placement(door, fixed_root=True),
        Placement(ball, position=(-0.02 - radius - 0.005, 0, -down), velocity=(speed, 0, 0))),
        None, gravity=(0, 0, 0), material=Material(friction=0, restitution=restitution))
    inertia = mass * (length ** 2 + 0.04 ** 2) / 12 + mass * length ** 2 / 4
    with Simulation(scene, accuracy=accuracy) as simulation:
        simulation.run(2)
        state, rate = simulation.state, -float(simulation.joint_rates[0])
        excess = simulation.energy_excess
    after = state.linear_velocities[2, 0]
    # (1 + e) m_eff v, m_eff = 1 / (1/m + r^2 / I)
    impulse = (1 + restitution) * speed / (1 / ball_mass + down ** 2 / inertia)
    assert after == pytest.approx(speed - impulse / ball_mass, abs=1e-6)
    assert rate == pytest.approx(impulse * down / inertia, rel=1e-6)
    assert excess < 1e-9
    assert not state.rows[0, 7:].any()


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('count', COUNTS)
def test_chains_that_are_hit_gain_no_energy_and_hold_their_roots(count, accuracy):
    """Boxes fall on chains with contacts among themselves; ground, friction, restitution."""
    doll = chain(count, damping=0.01, limits=((-2.0, 2.0),) * 3)
    box = Ragdoll('box', (Bone('box', Box((0.15, 0.1, 0.12)), 1.0, (0, 0, 0)),))
    height = 0.1 + 0.2 * count
    scene = Scene('hit', (
        Placement(doll, fixed_root=True, position=(0, 0, height)),
        *(Placement(box, f'box{k}', (0.03 * k, 0.02, height + 0.4 + 0.3 * k),
                    velocity=(0, 0, -3)) for k in range(4))),
        material=Material(friction=0.6, restitution=0.3))
    with Simulation(scene, accuracy=accuracy) as simulation:
        start, least = energy(simulation), math.inf
        root = simulation.state.rows[0].copy()
        for _ in range(100):
            simulation.advance()
            assert_stays(simulation.state, root)
            assert energy(simulation) - least < 1e-5 * start
            least = min(least, energy(simulation))
        assert np.isfinite(simulation.state.rows).all()


def test_pushes_and_hands_move_the_links_and_not_the_root():
    """Work of a force on the last link is the energy gained; a force on the root does none."""
    scene = hung(chain(3))
    with Simulation(scene, accuracy='exact') as simulation:
        root, start = simulation.state.rows[0].copy(), energy(simulation)
        simulation.push(Push('b0', (300.0, 0, 50.0), duration=0.1))
        simulation.run(10)
        assert simulation.work == (0, 0)
        simulation.push(Push('b2', (3.0, 1.0, 0), duration=0.2))
        simulation.run(20)
        pushes, _ = simulation.work
        assert pushes > 0.1
        assert energy(simulation) - start == pytest.approx(pushes, rel=1e-6)
        assert_stays(simulation.state, root)


def test_what_hangs_comes_to_rest_and_what_stands_on_its_hinge_falls():
    """Sleep: a lamp whose joint is damped sleeps; a bar that balances upright does not."""
    lamp = chain(2, damping=0.05, kinds=('hinge',))
    with Simulation(hung(lamp, angles={'b1': 0.4})) as simulation:
        for _ in range(3000):
            simulation.advance()
            if simulation.asleep:
                break
        assert simulation.asleep
        assert abs(simulation.joint_angles[0]) < 0.02
    upright = hung(lamp, orientation=(1.0, 0, 0, 0))
    with Simulation(upright) as simulation:
        simulation.run(1500)
        assert abs(simulation.joint_angles[0]) > 1


def test_between_a_fixed_root_and_what_never_moves_there_is_no_contact():
    """The root is inside the ground and a wall, and a body is driven through it."""
    with Simulation(inside()) as simulation:
        root = simulation.state.rows[0].copy()
        assert not simulation.initial_overlaps
        for _ in range(300):
            simulation.drive_body('cart', twist=(0.3, 0, 0, 0, 0, 0))
            simulation.advance()
        state = simulation.state
        assert_stays(state, root)
        assert np.isfinite(state.rows).all()
        assert simulation.energy_excess < 1e-6
        assert 0.02 - 1e-3 < state.positions[1, 2] < 0.15, 'the lever lies on ground or cart'


def inside():
    """A post half in the ground and half in a wall, with a lever; a cart drives through it."""
    post = Bone('post', Box((0.1, 0.1, 0.3)), 1.0, (0, 0, 0))
    lever = Bone('lever', Capsule(0.02, 0.14), 0.5, (-0.1, 0, 0.2), (0, math.sqrt(.5), 0,
                                                                     math.sqrt(.5)))
    doll = Ragdoll('gate', (post, lever), (
        Joint('post', 'lever', 'hinge', (0, 0, 0.2), ((0, 1, 0),), ((-1.2, 1.2),)),))
    box = Ragdoll('cart', (Bone('cart', Box((0.2, 0.2, 0.1)), 1.0, (0, 0, 0)),))
    cart = Placement(box, position=(-0.6, 0, 0.05), follow=Follow())
    wall = StaticBody('wall', Box((0.1, 1, 0.3)), position=(0.05, 0, 0))
    return Scene('inside', (Placement(doll, fixed_root=True), cart), Ground(),
                 Material(friction=0.5, restitution=0), bodies=(wall,))


def test_motors_turn_an_arm_on_its_fixed_root():
    """To second order in time it lags; held level, the torque is the weight's to 1e-6."""
    doll = chain(2, kinds=('hinge',))
    scene = hung(doll, motors=Motors(frequency=5))
    with Simulation(scene, accuracy='exact') as simulation:
        simulation.set_pose_target({'b1': 1.0})
        simulation.run(300)
        stiffness = Motors(frequency=5).of(doll)['b1'].stiffness
        bone = doll.bones[1]
        sag = bone.mass * 9.8 * 0.1 * math.sin(float(simulation.joint_angles[0])) / stiffness
        assert simulation.joint_angles[0] == pytest.approx(1.0 - sag, abs=1e-6)


def test_a_doll_with_a_fixed_root_comes_and_goes_and_is_set():
    scene = load_scene('drop')
    with Simulation(scene) as simulation:
        simulation.add(Placement(chain(3), 'lamp', (0, 1, 2), fixed_root=True))
        simulation.run(5)
        simulation.set_state('lamp', position=(0, 2, 2), joint_angles={'b1_1': 0.2})
        state = simulation.advance()
        assert state.positions[-3].tolist() == [0, 2, 2]
        with pytest.raises(errors.WrongForm, match=r'velocity.*root of lamp is fixed'):
            simulation.set_state('lamp', velocity=(0, 0, 1))
        simulation.remove('lamp')
        simulation.advance()


@pytest.mark.parametrize('given, match', [
    ({'velocity': (1, 0, 0)}, r'velocity.*root is fixed'),
    ({'spin': (0, 0, 1)}, r'spin.*root is fixed')])
def test_what_a_fixed_root_cannot_have_is_refused(given, match):
    with pytest.raises(errors.WrongForm, match=match):
        Placement(chain(2), fixed_root=True, **given)


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_refuse_fixed_roots(engine):
    pytest.importorskip('pybullet' if engine == 'bullet' else 'mujoco')
    with pytest.raises(errors.WrongForm, match='rigid, which holds roots that are fixed'):
        Simulation(hung(chain(2)), engine=engine)


def test_a_file_keeps_it(tmp_path):
    scene = hung(chain(3))
    save_scene(scene, tmp_path / 'hung.yaml')
    assert 'fixed_root: true' in (tmp_path / 'hung.yaml').read_text()
    assert load_scene(tmp_path / 'hung.yaml').dolls[0].fixed_root


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_an_arm_gives_way_at_its_torque(accuracy):
    """An arm is told to go through a fixed ball: it presses with the force of its torque over the
    lever, and no more.
    """
    arm = Bone('arm', Capsule(0.02, 0.3), 1.0, (0, 0, -0.2))
    doll = Ragdoll('arm', (Bone('post', Sphere(0.02), 1.0, (0, 0, 0)), arm), (
        Joint('post', 'arm', 'hinge', (0, 0, 0), ((0, 1, 0),), ((-3, 3),)),))
    ball = StaticBody('ball', Sphere(0.03), position=(-0.08, 0, -0.15))
    scene = Scene('press', (Placement(doll, fixed_root=True, motors=Motors(
        frequency=5, max_torque=1.2)),), None, Material(friction=0, restitution=0),
        gravity=(0, 0, 0), bodies=(ball,))
    with Simulation(scene, accuracy=accuracy) as simulation:
        simulation.set_pose_target({'arm': 1.5})
        simulation.run(100)
        contacts, angle = simulation.contacts, float(simulation.joint_angles[0])
    # The line of the capsule touches the ball where its distance from the ball's centre is that of
    # both radii; the lever is the distance of the foot of that perpendicular from the axis.
    distance = math.hypot(0.08, 0.15)
    assert angle == pytest.approx(math.atan2(0.08, 0.15) - math.asin(0.05 / distance), abs=1e-5)
    assert contacts.forces.sum() == pytest.approx(1.2 / math.sqrt(distance ** 2 - 0.05 ** 2),
                                                  rel=1e-3)


def test_what_is_pushed_first_is_no_fixed_root():
    scene = hung(chain(3))
    assert scene.first_pushed_bone == 'b1'
    assert dataclasses.replace(scene, dolls=(Placement(chain(3)),)).first_pushed_bone == 'b0'
    assert hung(chain(1)).first_pushed_bone == 'b0'


@pytest.mark.slow
@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_random_scenes_gain_no_energy(accuracy):
    """Chains on fixed roots, some with motors, dolls and boxes that fall on them, a push: a hundred
    scenes that begin without an overlap. 1e-5 of the potential energy of 2 m, as for free dolls.
    """
    made, seed = 0, 0
    while made < 100:
        scene, push = random_scene(np.random.default_rng(seed))
        seed += 1
        with Simulation(scene, accuracy=accuracy) as simulation:
            if simulation.initial_overlaps:
                continue
            made, least = made + 1, 0.0
            whole = 9.8 * 2 * sum(bone.mass for bone in scene.bones)
            roots = [own.start for own, each in zip(scene.bone_slices, scene.dolls, strict=True)
                     if each.fixed_root]
            before = simulation.state.positions[roots].copy()
            for tick in range(150):
                if tick == 40:
                    simulation.push(push)
                state = simulation.advance()
                assert np.isfinite(state.rows).all(), seed
                assert np.array_equal(state.positions[roots], before), seed
                assert simulation.energy_excess - least < 1e-5 * whole, seed
                least = min(least, simulation.energy_excess)


def random_scene(rng):
    """Up to three chains, up to three things that fall, and a push."""
    def turned():
        return tuple(rotation.normalized(rng.normal(size=4)))

    placements = []
    for number in range(rng.integers(1, 4)):
        doll = chain(int(rng.choice((2, 3, 5, 8))), damping=float(rng.choice((0, 0.02, 0.2))),
                     limits=((-1.5, 1.5),) * 3)
        motors = Motors(frequency=float(rng.uniform(0.5, 5)), max_torque=float(rng.uniform(1, 20)))
        placements.append(Placement(
            doll, f'chain{number}', (*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.6, 2)), turned(),
            fixed_root=True, motors=motors if rng.random() < 0.3 else None))
    box = Ragdoll('box', (Bone('box', Box((0.2, 0.15, 0.12)), float(rng.uniform(0.2, 20)),
                               (0, 0, 0)),))
    for number in range(rng.integers(1, 4)):
        doll = load_scene('drop').dolls[0].doll if rng.random() < 0.5 else box
        placements.append(Placement(
            doll, f'faller{number}', (*rng.uniform(-0.3, 0.3, 2), 2.4 + 1.2 * number), turned(),
            velocity=tuple(2 * rng.normal(size=3))))
    scene = Scene('random', tuple(placements), Ground(), Material(
        friction=float(rng.choice((0.3, 0.7, math.inf))),
        restitution=float(rng.choice((0, 0.3, 0.8)))))
    bone = scene.bone_names[int(rng.integers(len(scene.bone_names)))]
    return scene, Push(bone, tuple(100 * rng.normal(size=3)), duration=0.2)

"""Dolls that an animation moves until they go limp: poses, velocities and what is kept of them."""
from __future__ import annotations

import dataclasses
import json
import math
import runpy
import struct

import numpy as np
import pytest
from conftest import ROOT
from test_animations import MOVES, G, analytic, momenta, momenta_of_poses, twin

from ragdoll_ros import (
    Bone,
    Placement,
    Push,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
    load_doll,
    load_limits,
)
from ragdoll_ros.files.animation import load_animations
from ragdoll_ros.files.doll import save_doll
from ragdoll_ros.files.run_scene import read_run_scene, run_scene_text
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.dof_layout import DofLayout, GeneralizedState
from ragdoll_ros.model.drive import Drive
from ragdoll_ros.model.errors import UnknownDoll
from ragdoll_ros.model.motion_spline import MotionSpline
from ragdoll_ros.model.playback import Playback
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.scene import Ground
from ragdoll_ros.physics.logged_simulation import LoggedSimulation, apply_event

pytest.importorskip('numba')

ENGINES = ('rigid', 'bullet', 'mujoco')

FRAME = {'position': (1, 2, 3), 'orientation': tuple(rotation.normalized((0.1, 0.2, 0.3, 0.9)))}


@pytest.fixture(scope='module')
def doll(tmp_path_factory):
    return twin(tmp_path_factory.mktemp('twin'))


@pytest.fixture(scope='module')
def animations(doll):
    return load_animations(doll)


@pytest.fixture(params=ENGINES)
def engine(request):
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(request.param, request.param))
    return request.param


def scene(*placements, ground=None):
    return Scene('limp', placements, ground, gravity=(0, 0, -G))


def instants(count):
    """Random times s amid the samples of a motion, at which its splines are smooth."""
    rng = np.random.default_rng(3)
    return ((rng.integers(2, 50, count) + rng.uniform(0.3, 0.7, count)) / 60).tolist()


def ball(position, velocity=(0.0, 0.0, 0.0), mass=1.0):
    return Placement(Ragdoll('ball', (Bone('ball', Sphere(0.1), mass, (0, 0, 0)),)), 'ball',
                     position, velocity=velocity)


@pytest.mark.parametrize('name', [*MOVES, 'baked run'])
def test_velocities_are_those_of_the_motion_when_it_goes_limp(doll, animations, name, engine):
    for time in instants(3):
        start = animations[name].play(Placement(doll), start=time - 0.02, limp_at=0.02)
        with Simulation(scene(start), engine=engine) as simulation:
            assert simulation.advance() and simulation.animated == ('twin',)
            state = simulation.advance()
            assert simulation.animated == ()
        positions, velocities, spins = analytic(doll, name.removeprefix('baked '), time)
        np.testing.assert_allclose(state.positions, positions, atol=1e-5)
        np.testing.assert_allclose(state.linear_velocities, velocities, atol=1e-3)
        np.testing.assert_allclose(state.angular_velocities, spins, atol=1e-3)


@pytest.mark.parametrize('name', MOVES)
def test_momentum_and_energy_are_those_of_the_animation(doll, animations, name, engine):
    """Of the doll's bodies as they pass by."""
    here = Placement(doll, **FRAME)
    for time in instants(2):
        def poses(at):
            start = animations[name].play(here, start=at).start
            return [start.bone_pose(bone) for bone in doll.bones]

        start = animations[name].play(here, start=time - 0.01, limp_at=0.01)
        with Simulation(scene(start), engine=engine) as simulation:
            state = simulation.advance()
            assert not simulation.animated
        due = momenta_of_poses(doll, poses, time)
        found = momenta(doll, state.positions, state.orientations, state.linear_velocities,
                        state.angular_velocities)
        # Angles are rounded to 2e-11 rad, their differences to 1e-8 rad/s.
        for value, right in zip(found, due, strict=True):
            np.testing.assert_allclose(value, right, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize('limp_at', [0.1, 0.1037])
def test_a_jump_that_goes_limp_in_the_air_keeps_its_parabola(doll, animations, engine, limp_at):
    """On a tick, and between two."""
    start = animations['jump'].play(Placement(doll), start=0.2, limp_at=limp_at)
    with Simulation(scene(start), engine=engine) as simulation:
        for _ in range(30):
            state = simulation.advance()
        assert not simulation.animated
    # glTF's y is up, z forward, x left.
    left, up, forward = MOVES['jump']['Hips'](0.5)[0]
    # MuJoCo's semi-implicit Euler falls behind by g h t / 2, h being 1 ms.
    late = G * 0.001 * (0.3 - limp_at) / 2 if engine == 'mujoco' else 0.0
    center = np.average(state.positions, axis=0, weights=[bone.mass for bone in doll.bones])
    due = doll.mass_centre + np.array((forward, left, up - late))
    assert center == pytest.approx(due, abs=2e-5)


def test_it_goes_limp_at_the_instant_itself(doll, animations):
    """Between ticks: the same fall as with a tick there."""
    start = animations['run'].play(Placement(doll), limp_at=0.105)
    ends = []
    for step, ticks in ((0.01, 30), (0.005, 60)):
        with Simulation(scene(start), step) as simulation:
            for _ in range(ticks):
                state = simulation.advance()
        ends.append(state.positions)
    np.testing.assert_allclose(*ends, atol=1e-5)


def test_half_the_speed_has_half_the_velocities(doll, animations, engine):
    rows = []
    for speed, ticks in ((1.0, 10), (0.5, 20)):
        start = animations['run'].play(Placement(doll, **FRAME), start=0.1, speed=speed)
        with Simulation(scene(start), engine=engine) as simulation:
            rows.append(simulation.run(ticks)[-1])
    np.testing.assert_allclose(rows[1][:, :7], rows[0][:, :7], atol=1e-9)
    np.testing.assert_allclose(rows[1][:, 7:], rows[0][:, 7:] / 2, atol=1e-9)


def test_a_loop_begins_anew_and_the_frame_goes_on(doll, animations):
    duration = animations['swing'].duration
    start = animations['swing'].play(Placement(doll, velocity=(0.5, 0, 0)), start=0.95, loop=True)
    with Simulation(scene(start)) as simulation:
        rows = simulation.run(round(duration / 0.01) + 12)
    shift = np.zeros(13)
    shift[0] = 0.5 * duration
    np.testing.assert_allclose(rows[111], rows[11] + shift, atol=1e-9)
    # At the seam the state is that of the beginning.
    begin = animations['swing'].play(Placement(doll), start=0.0).start
    np.testing.assert_allclose(rows[4, 0, :3] - (0.025, 0, 0),
                               begin.bone_pose(doll.bones[0]).position, atol=1e-9)


def test_a_walk_goes_on_where_it_ended(doll, animations):
    """The jump moves 2 m forward and 0.3 m to the left, from where it begins again at z = 0."""
    jump = animations['jump']
    start = jump.play(Placement(doll, **FRAME), loop=True)
    period = round(jump.duration / 0.01)
    with Simulation(scene(start)) as simulation:
        rows = simulation.run(3 * period)
    shift = np.zeros(13)
    shift[:3] = rotation.rotate(FRAME['orientation'], (2.0, 0.3, 0.0))
    for later in (period, 2 * period):
        np.testing.assert_allclose(rows[later + 10], rows[10] + shift * later / period, atol=1e-6)


def test_a_walk_in_a_circle_closes():
    """A quarter of a circle around (1, 2), repeated: on the circle, and after four where it began;
    the height it gains, and loses at each loop, is not kept.
    """
    doll = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0, 0, 0)),))
    layout, times = DofLayout([doll]), np.linspace(0.0, 2.0, 41)
    states = []
    for time in times:
        angle = time * math.pi / 4
        q, v = np.zeros(7), np.zeros(6)
        q[:3] = 1 + math.cos(angle), 2 + math.sin(angle), 0.1 * time
        q[3:] = rotation.from_axis_angle((0, 0, 1), angle)
        v[layout.root_velocities[0]] = (*(math.pi / 4 * np.array([-math.sin(angle),
                                                                  math.cos(angle)])), 0.1)
        v[layout.root_angular_velocities[0]] = 0, 0, math.pi / 4
        states.append(GeneralizedState(q, v))
    walk = Playback('circle', MotionSpline.sampled(layout, times, states), start=0.5, loop=True)
    for elapsed in (0.0, 1.4, 1.6, 3.7, 7.5, 8.0, 21.3):
        state = walk.at(Pose(), np.zeros(3), elapsed)
        angle = (0.5 + elapsed) * math.pi / 4
        due = 1 + math.cos(angle), 2 + math.sin(angle), 0.1 * ((0.5 + elapsed) % 2)
        # Cubic splines through points 2 degrees apart: 4e-8 of the radius.
        assert state.q[:3] == pytest.approx(due, abs=1e-7)
        assert rotation.angle_between(
            state.q[3:], rotation.from_axis_angle((0, 0, 1), angle)) < 1e-7
        due = *(math.pi / 4 * np.array([-math.sin(angle), math.cos(angle)])), 0.1
        assert state.v[layout.root_velocities[0]] == pytest.approx(due, abs=1e-5)


def test_after_its_end_it_stands_until_it_is_told(doll, animations):
    start = animations['run'].play(Placement(doll, velocity=(1, 0, 0)), start=0.955)
    with Simulation(scene(start)) as simulation:
        rows = simulation.run(60)
        assert simulation.animated == ('twin',) and not simulation.asleep
        simulation.go_limp('twin')
        fallen = simulation.run(10)
    assert not rows[4:, :, 7:].any() and (rows[5:] == rows[5]).all()
    # All of the doll falls; its limbs may turn.
    masses = [bone.mass for bone in doll.bones]
    drop = np.average(fallen[-1, :, 2] - rows[-1, :, 2], weights=masses)
    assert drop == pytest.approx(-G * 0.1 ** 2 / 2, abs=1e-6)


def test_a_push_above_the_threshold_fells_it(doll, animations):
    start = animations['run'].play(Placement(doll), limp_above=100.0)
    with Simulation(scene(start)) as simulation:
        undisturbed = simulation.run(20)
        simulation.reset()
        simulation.push(Push('Hips', (0, 99, 0), duration=0.05))
        assert (simulation.run(10) == undisturbed[:10]).all()
        # From between two ticks on: 100.5 N, from which v = F t / m of the rest of the tick.
        simulation.push(Push('Hips', (0, 100.5, 0), duration=0.05, start=0.104))
        state = simulation.advance()
        assert simulation.animated == ()
        masses = np.array([bone.mass for bone in doll.bones])
        gained = masses @ (state.linear_velocities - undisturbed[10, :, 7:10])
        # Of a falling doll gravity and the push change the momentum, of a run what moves it.
        free = animations['run'].play(Placement(doll), start=0.104).start
        begun = doll.mass * np.array(free.velocity)
        end = masses @ state.linear_velocities
        assert end - begun == pytest.approx(
            (0, 100.5 * 0.006, -doll.mass * G * 0.006), abs=1e-6)
        assert abs(gained[1]) > 1e-3


@pytest.mark.parametrize(('limp_above', 'falls'), [(59.0, True), (61.0, False)])
def test_a_drive_fells_it_as_a_push_does(doll, animations, limp_above, falls):
    """100 N/(m/s) on who stands: 60 N at 0.6 m/s."""
    start = animations['swing'].play(Placement(doll), limp_above=limp_above)
    with Simulation(scene(start)) as simulation:
        simulation.push(Drive('Hips', (0.0, 0.6, 0.0), force_per_speed=100.0))
        simulation.run(2)
        assert (simulation.animated == ()) == falls


def test_a_hand_fells_who_walks_on(doll, animations):
    """When it pulls harder than 100 N; before, it changes nothing."""
    start = animations['run'].play(Placement(doll), limp_above=100.0)
    with Simulation(scene(start)) as simulation:
        undisturbed = simulation.run(30)
        simulation.reset()
        simulation.grab('right', 'Head')
        rows = simulation.run(30)
        assert simulation.animated == ()
    equal = (rows == undisturbed).all(axis=(1, 2))
    assert 0 < equal.sum() < 30 and not np.diff(equal.astype(int)).max() > 0


def test_what_it_meets_is_hit_and_does_not_disturb_it(doll, animations):
    """A runner, at 3.5 m/s, meets a ball that hangs there: the ball is thrown, with its work."""
    start = animations['run'].play(Placement(doll), limp_at=0.8)
    chest = next(bone for bone in doll.bones if 'Spine' in bone.name)
    thrown = ball((1.5, 0.0, float(chest.position[2])))
    free = Scene('air', (start, thrown), gravity=(0, 0, 0))
    with Simulation(dataclasses.replace(free, dolls=(start,))) as simulation:
        alone = simulation.run(75)
    with Simulation(free) as simulation:
        rows = simulation.run(75)
        excess, (work, _) = simulation.energy_excess, simulation.work
        kinetic = simulation.kinetic_energy
        assert not simulation.measures()['unsolved_total']
    assert (rows[:, :-1] == alone).all()
    assert rows[-1, -1, 7] > 3.5
    assert work > 6 and excess == pytest.approx(kinetic - work, abs=1e-9)
    # A wall at u gives a ball (1 + e) u, loses (1 - e^2) m u^2 / 2: with e = 1/2 a quarter of its
    # work. The chest turns, too.
    assert -excess / work == pytest.approx(0.25, abs=0.02)


def test_its_contacts_are_those_with_what_yields(doll, animations):
    """A ball is hit with its own mass; the ground under the feet bears nothing."""
    start = animations['run'].play(Placement(doll), limp_at=2)
    chest = next(bone for bone in doll.bones if 'Spine' in bone.name)
    scene = Scene('air', (start, ball((1.5, 0.0, float(chest.position[2])), mass=2.0)),
                  Ground(offset=0.3), gravity=(0, 0, 0))
    impacts, touched = [], set()
    with Simulation(scene) as simulation:
        simulation.record_impacts(load_limits())
        for _ in range(75):
            simulation.advance()
            impacts += simulation.impacts
            touched |= {*simulation.contacts.a.tolist(), *simulation.contacts.b.tolist()}
        impulses, velocity = simulation.contact_impulses, simulation.state.linear_velocities[-1]
    assert {impact.doll for impact in impacts} == {'ball', start.name}
    for impact in impacts:
        assert impact.effective_mass == pytest.approx(2, abs=1e-9)
        assert impact.impulse == pytest.approx((1 + 0.5) * 2 * impact.speed, rel=1e-9)
    assert -1 not in touched
    # Newton's third law, and the momentum of the ball.
    np.testing.assert_allclose(impulses[-1], 2 * velocity, atol=1e-9)
    np.testing.assert_allclose(impulses[:-1].sum(axis=0), -impulses[-1], atol=1e-9)


def test_a_falling_doll_lies_on_one_that_walks_and_both_fall(doll, animations):
    """Two animated ones pass through each other; what falls on them does not fail."""
    first = animations['run'].play(Placement(doll, 'a'), limp_at=0.6)
    second = animations['run'].play(Placement(doll, 'b', (0.1, 0, 0)), limp_at=0.9)
    above = Placement(load_doll('doll'), 'c', (0.6, 0, 1.2))
    with Simulation(scene(first, second, above, ground=Ground())) as simulation:
        rows = simulation.run(200)
        assert simulation.measures()['joint_gap_m'] < 1e-3
    assert np.isfinite(rows).all() and np.abs(rows[..., 7:10]).max() < 40
    assert rows[-1, :, 2].max() < 1.2


def test_a_reset_begins_anew_to_the_bit(doll, animations, engine):
    start = animations['run'].play(Placement(doll), limp_at=0.055)
    with Simulation(scene(start, ground=Ground()), engine=engine) as simulation:
        rows = simulation.run(20)
        simulation.reset()
        assert simulation.animated == ('twin',)
        assert (simulation.run(20) == rows).all()
        simulation.reset(keep_time=True)
        kept = simulation.run(20)
    np.testing.assert_allclose(kept[:5], rows[:5], atol=1e-9)


def test_a_run_is_repeated_from_its_log_to_the_bit(doll, animations):
    """Through JSON and the text of the scene, which names the character's file."""
    made = scene(animations['run'].play(Placement(doll, 'one'), speed=1.3, limp_above=80.0),
                 animations['jump'].play(Placement(doll, 'two', (0, 3, 0)), loop=True),
                 animations['swing'].play(Placement(doll, 'three', (0, 6, 0)), limp_at=0.123),
                 ground=Ground())
    lines, rows = [], []
    with LoggedSimulation(made) as simulation:
        simulation.on_event = lambda name, given: lines.append(
            json.dumps([len(rows), name, given]))
        for tick in range(40):
            if tick == 9:
                simulation.push(Push('one/Head', (0, 1000 / 3, 0), start=0.0951))
            if tick == 21:
                simulation.go_limp('two')
            if tick == 30:
                simulation.reset()
            rows.append(simulation.advance().rows.copy())
    events = [json.loads(line) for line in lines]
    assert [(tick, given) for tick, name, given in events if name == 'limp'] == [
        (9, {'dolls': ['one'], 'time': 0.0951, 'reason': 'limp_above'}),
        (12, {'dolls': ['three'], 'time': 0.123, 'reason': 'limp_at'}),
        (21, {'dolls': ['two'], 'time': 0.21, 'reason': 'go_limp'})]
    again, _ = read_run_scene(run_scene_text(made))
    assert again == made
    with Simulation(again) as simulation:
        for tick, row in enumerate(rows):
            for at, name, given in events:
                if at == tick and name != 'limp':
                    apply_event(simulation, name, given)
            assert (simulation.advance().rows == row).all(), tick


def test_a_scene_has_all_of_it(tmp_path, doll, animations):
    save_doll(doll, tmp_path / 'twin.yaml')
    path = tmp_path / 'scene.yaml'
    path.write_text('dolls:\n  - {doll: twin.yaml, position: [1, 0, 0], velocity: [0, 1, 0], '
                    'animation: {name: run, start: 0.2, speed: 0.5, loop: true, limp_at: 2, '
                    'limp_above: 50}}\n')
    made = load_scene(str(path))
    due = animations['run'].play(
        Placement(made.dolls[0].doll, position=(1, 0, 0), velocity=(0, 1, 0)), 0.2, 0.5, True, 2.0,
        50.0)
    assert made.dolls[0] == due
    save_scene(made, tmp_path / 'saved.yaml')
    assert load_scene(str(tmp_path / 'saved.yaml')) == made


def test_what_is_set_ends_the_animation(doll, animations):
    start = animations['run'].play(Placement(doll), loop=True)
    with Simulation(scene(start)) as simulation:
        simulation.run(3)
        simulation.set_state('twin', velocity=(0, 0, 1))
        assert simulation.animated == ()
        assert simulation.state.linear_velocities[0] == pytest.approx((0, 0, 1))
        simulation.reset()
        assert simulation.animated == ('twin',)
        simulation.place(simulation.coordinates)
        assert simulation.animated == ()
        simulation.reset()
        assert simulation.animated == ()


def test_dolls_come_and_go_while_others_walk(doll, animations):
    start = animations['run'].play(Placement(doll, 'walker'), loop=True)
    with Simulation(scene(start)) as simulation:
        undisturbed = simulation.run(30)
        simulation.reset()
        simulation.run(5)
        simulation.add(animations['run'].play(Placement(doll, 'other', (0, 5, 0)), limp_at=0.1))
        simulation.add(ball((9, 9, 9)))
        rows = simulation.run(5)
        assert simulation.animated == ('walker', 'other')
        assert (rows[:, :len(doll.bones)] == undisturbed[5:10]).all()
        # An animation begins when its doll comes: at 0.05 s.
        simulation.run(5)
        assert simulation.animated == ('walker',)
        simulation.remove('ball')
        simulation.remove('other')
        np.testing.assert_allclose(simulation.run(15), undisturbed[15:30], atol=1e-12)


def test_after_a_bad_state_it_walks_on(doll, animations, engine):
    """Also if it went limp in the tick that is repeated."""
    start = animations['run'].play(Placement(doll), limp_at=0.065)
    with Simulation(scene(start), engine=engine) as simulation:
        undisturbed = simulation.run(10)
        simulation.reset()
        simulation.run(5)
        saved = simulation.checkpoint()
        simulation.run(2)
        assert simulation.animated == ()
        simulation.go_back(saved)
        assert simulation.animated == ('twin',)
        np.testing.assert_allclose(simulation.run(5), undisturbed[5:], atol=1e-9)


def test_the_shipped_walker_is_what_its_script_writes():
    """Apart from the last digits of sines, which depend on the processor."""
    (made, numbers), (shipped, same) = (
        split_glb(glb) for glb in (runpy.run_path(str(ROOT / 'docs/walker.py'))['document']().glb(),
                                   (ROOT / 'config/walker.glb').read_bytes()))
    assert_alike(made, shipped)
    # Of floats in [-2, 2], a few last digits; what is no float differs by more if it differs.
    assert len(numbers) == len(same)
    differs = numbers != same
    np.testing.assert_allclose(numbers[differs].view(np.float32), same[differs].view(np.float32),
                               rtol=0, atol=1e-6)


def split_glb(glb):
    """The JSON of a GLB, and its buffer as words of 4 bytes."""
    length, = struct.unpack_from('<I', glb, 12)
    return json.loads(glb[20:20 + length]), np.frombuffer(glb[28 + length:], np.uint32)


def assert_alike(a, b):
    """Equal values of JSON, and numbers that are equal but for rounding."""
    assert type(a) is type(b) or {type(a), type(b)} == {int, float}
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_alike(a[key], b[key])
    elif isinstance(a, list):
        assert len(a) == len(b)
        for pair in zip(a, b, strict=True):
            assert_alike(*pair)
    else:
        assert a == (pytest.approx(b, abs=1e-6) if isinstance(a, float) else b)


def test_an_unknown_doll_is_named(doll, animations):
    with Simulation(scene(animations['run'].play(Placement(doll)))) as simulation:
        with pytest.raises(UnknownDoll, match='twin'):
            simulation.go_limp('nobody')
        simulation.go_limp()
        assert simulation.animated == ()


def test_a_motion_stays_within_the_limits_of_its_joints(doll, animations):
    motion = animations['run'].motion
    for time in np.linspace(0, motion.duration, 301):
        state = motion.at(float(time))
        assert motion.layout.limit_violations(state.q).max() <= 0
        assert math.isfinite(np.abs(state.v).max())

"""Dolls that take over from an animation of their character's file: where they are, how fast."""
from __future__ import annotations

import dataclasses
import functools
import math
import re
from pathlib import Path

import animated_rigs
import fit_rigs
import numpy as np
import pytest
from animated_rigs import rate, worlds_at
from test_fit_rigid import PERSON, parts

from ragdoll_ros import Placement, Scene, Simulation, load_scene, save_scene
from ragdoll_ros.files.animation import load_animations
from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.files.gltf.nodes import TO_ROS
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.pipeline import FitOptions, fit_character, fit_characters
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelErrors, OutOfRange, RagdollError, WrongForm

RIG = dataclasses.replace(fit_rigs.RIGS['cmu'], name='twin')

W = 2 * math.pi * 1.2
"""rad/s, of strides and of swinging arms."""

G = 9.8

STILL = np.zeros(3)


def swing(axis, size, phase=0.0, middle=0.0):
    """A bone that swings about an axis: x to its left, y up, z forward."""
    def move(time):
        return STILL, np.array(axis) * (middle + size * math.sin(W * time + phase))
    return move


MOVES = {
    'swing': {'LeftArm': swing((0.8, 0.6, 0), 0.4), 'RightArm': swing((0.8, -0.6, 0), 0.4, 1.0)},
    'jump': {'Hips': lambda time: (np.array((0.3 * time, 3 * time - G * time ** 2 / 2, 2 * time)),
                                   STILL)},
    'run': {'Hips': lambda time: (np.array((0, 0.05 * math.sin(2 * W * time), 3.5 * time)),
                                  np.array((0.05, 0.1 * math.sin(W * time), 0))),
            'LeftUpLeg': swing((1, 0, 0), 0.5), 'RightUpLeg': swing((1, 0, 0), 0.5, math.pi),
            'LeftLeg': swing((1, 0, 0), 0.4, 1.0, 0.5),
            'RightLeg': swing((1, 0, 0), 0.4, 1.0 + math.pi, 0.5),
            'LeftArm': swing((1, 0, 0), 0.5, math.pi), 'RightArm': swing((1, 0, 0), 0.5)}}

TIME = 0.51
"""s, amid two keys: 60 a second."""


def twin(folder):
    """The doll of a character with all animations, as splines and baked to LINEAR keys."""
    made, times = animated_rigs.document(RIG), np.arange(61) / 60
    for name, moves in MOVES.items():
        animated_rigs.animate(made, RIG, moves, times, name=name)
        animated_rigs.animate(made, RIG, moves, times, 'LINEAR', f'baked {name}')
    path = folder / 'twin.glb'
    path.write_bytes(made.glb())
    fitted = fit_character(read_character(path), FitOptions(smallest=0.1)).doll
    # A hip of the fit is where the skins meet; a bone of the file turns about its head.
    heads = {bone.name: tuple(TO_ROS @ bone.head) for bone in RIG.bones}
    joints = tuple(dataclasses.replace(joint, anchor=heads[joint.child])
                   for joint in fitted.joints)
    return dataclasses.replace(fitted, joints=joints, model=str(path))


@pytest.fixture(scope='module')
def doll(tmp_path_factory):
    return twin(tmp_path_factory.mktemp('twin'))


@pytest.fixture(scope='module')
def animations(doll):
    return load_animations(doll)


def analytic(doll, name, time):
    """Position (n, 3), velocity (n, 3) and spin (n, 3) of the doll's bodies by the functions of
    time, as if each were fixed to its bone.
    """
    index = {bone.name: k for k, bone in enumerate(RIG.bones)}
    own = [index[bone.name] for bone in doll.bones]
    bind = np.array(worlds_at(RIG, {}, 0.0))[own]
    centers = np.array([[*(TO_ROS.T @ bone.position), 1.0] for bone in doll.bones])
    local = np.einsum('nij,nj->ni', np.linalg.inv(bind), centers)

    def worlds(at):
        return np.array(worlds_at(RIG, MOVES[name], at))[own]

    here, change = worlds(time), rate(worlds, time)
    across = TO_ROS @ change[:, :3, :3] @ np.swapaxes(here[:, :3, :3], 1, 2) @ TO_ROS.T
    return (*(np.einsum('nij,nj->ni', each, local)[:, :3] @ TO_ROS.T for each in (here, change)),
            np.stack([across[:, 2, 1], across[:, 0, 2], across[:, 1, 0]], axis=1))


def started(placement, engine='rigid'):
    """The first state of a doll in free fall."""
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    with Simulation(Scene('start', (placement,)), engine=engine) as simulation:
        return simulation.state


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('name', [*MOVES, 'baked swing', 'baked run'])
def test_bodies_are_where_the_bones_are_and_as_fast(doll, animations, name, engine):
    state = started(animations[name].place(Placement(doll), TIME), engine)
    positions, velocities, spins = analytic(doll, name.removeprefix('baked '), TIME)
    # Of a spline with 60 keys a second, which are float32.
    np.testing.assert_allclose(state.positions, positions, atol=1e-5)
    np.testing.assert_allclose(state.linear_velocities, velocities, atol=1e-3)
    np.testing.assert_allclose(state.angular_velocities, spins, atol=1e-3)


def momenta_of_poses(doll, poses, time):
    """Momenta and energy of bodies that pass by at ``poses(time)``: by differences of order 4."""
    h, here = 2e-3, poses(time)
    orientations = np.array([pose.orientation for pose in here])
    turns = rate(lambda at: [rotation.matrix(pose.orientation) for pose in poses(at)], time, h)
    across = turns @ np.swapaxes(rotation.matrix(orientations), 1, 2)
    return momenta(doll, np.array([pose.position for pose in here]), orientations,
                   rate(lambda at: [pose.position for pose in poses(at)], time, h),
                   np.stack([across[:, 2, 1], across[:, 0, 2], across[:, 1, 0]], axis=1))


def momenta(doll, positions, orientations, velocities, spins):
    """Momentum, angular momentum about the centre of mass and kinetic energy, by the textbook."""
    masses = np.array([bone.mass for bone in doll.bones])[:, None]
    turned = rotation.rotate(orientations, np.array([bone.inertia for bone in doll.bones])
                             * rotation.rotate(rotation.inverse(orientations), spins))
    center, mean = (np.sum(masses * each, axis=0) / doll.mass for each in (positions, velocities))
    angular = np.sum(masses * np.cross(positions - center, velocities - mean) + turned, axis=0)
    energy = np.sum(masses * velocities ** 2) / 2 + np.sum(spins * turned) / 2
    return doll.mass * mean, angular, energy


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('name', MOVES)
def test_momentum_and_energy_are_those_of_the_animation(doll, animations, name, engine):
    """Of the doll's bodies as they pass by, at their placed poses."""
    here = Placement(doll, '', (1, 2, 3), tuple(rotation.normalized((0.1, 0.2, 0.3, 0.9))))
    state = started(animations[name].place(here, TIME), engine)

    @functools.cache
    def poses(time):
        placement = animations[name].place(here, time)
        return [placement.bone_pose(bone) for bone in doll.bones]

    due = momenta_of_poses(doll, poses, TIME)
    found = momenta(doll, state.positions, state.orientations, state.linear_velocities,
                    state.angular_velocities)
    # Angles are rounded to 2e-11 rad, their differences to 1e-8 rad/s.
    for value, right in zip(found, due, strict=True):
        np.testing.assert_allclose(value, right, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('name', ['jump', 'baked jump'])
def test_a_jump_that_goes_limp_keeps_its_parabola(doll, animations, name, engine):
    """The centre of mass."""
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    masses = [bone.mass for bone in doll.bones]
    scene = Scene('jump', (animations[name].place(Placement(doll), TIME),), gravity=(0, 0, -G))
    with Simulation(scene, engine=engine) as simulation:
        for _ in range(30):
            state = simulation.advance()
    # glTF's y is up, z forward, x left.
    left, up, forward = MOVES['jump']['Hips'](TIME + 0.3)[0]
    center = np.average(state.positions, axis=0, weights=masses)
    # MuJoCo's semi-implicit Euler falls behind by g h t / 2, h being 1 ms.
    late = G * 0.001 * 0.3 / 2 if engine == 'mujoco' else 0.0
    due = doll.mass_centre + np.array((forward, left, up - late))
    assert center == pytest.approx(due, abs=1e-5)


def scene_file(tmp_path, doll, **entry):
    save_doll(doll, tmp_path / 'twin.yaml')
    fields = ', '.join(f'{key}: {value}' for key, value in entry.items())
    path = tmp_path / 'scene.yaml'
    path.write_text(f'dolls:\n  - {{doll: twin.yaml, {fields}}}\n')
    return str(path)


def test_a_scene_starts_within_an_animation(tmp_path, doll, animations):
    """It is plain angles and velocities from then on, which are written."""
    turn = tuple(rotation.from_axis_angle((0, 0, 1), 1.0).tolist())
    scene = load_scene(scene_file(
        tmp_path, doll, animation=f'{{name: run, time: {TIME}}}', position=[1, 2, 0.5],
        orientation=list(turn), velocity=[0.5, 0, 0]))
    due = animations['run'].place(
        Placement(scene.dolls[0].doll, '', (1, 2, 0.5), turn, (0.5, 0, 0)), TIME)
    assert scene.dolls[0] == due
    along = rotation.rotate(turn, (3.5, 0, 0)) + np.array((0.5, 0, 0))
    assert due.velocity[:2] == pytest.approx(along[:2], abs=0.3)
    save_scene(scene, tmp_path / 'saved.yaml')
    assert load_scene(str(tmp_path / 'saved.yaml')) == scene


def test_copies_run_where_each_is_turned(tmp_path, doll):
    scene = load_scene(scene_file(tmp_path, doll, animation='{name: run, time: 0}',
                                  repeat='{count: 3, grid: [2, 2, 0], turned: yaw, seed: 4}'))
    headings = {round(math.degrees(math.atan2(copy.velocity[1], copy.velocity[0])))
                for copy in scene.dolls}
    assert len(headings) == 3
    for copy in scene.dolls:
        within = rotation.rotate(rotation.inverse(copy.orientation), copy.velocity)
        assert within == pytest.approx(rotation.rotate(rotation.inverse(
            scene.dolls[0].orientation), scene.dolls[0].velocity), abs=1e-9)


@pytest.mark.parametrize('start', [f'time: {TIME}', f'start: {TIME}', f'speed: 2, start: {TIME}'])
def test_copies_are_turned_about_the_centre_of_mass_that_the_animation_has(tmp_path, doll, start):
    """`run` has moved 2 m by then. Whichever way the copies face, their centres form a grid."""
    copies = load_scene(scene_file(
        tmp_path, doll, animation=f'{{name: run, {start}}}', position=[1, 2, 0.5],
        orientation=[0.1, 0.2, 0.3, 0.9], velocity=[0.5, 0, 0],
        repeat='{count: 4, grid: [2, 3, 0], turned: yaw, seed: 4}')).dolls
    centers = []
    for copy in copies:
        weights = [bone.mass for bone in copy.doll.bones]
        places = [copy.bone_pose(bone).position for bone in copy.doll.bones]
        centers.append(np.average(places, axis=0, weights=weights))
    assert np.array(centers) - centers[0] == pytest.approx(
        np.array([(0, 0, 0), (2, 0, 0), (0, 3, 0), (2, 3, 0)]), abs=1e-9)


@pytest.mark.parametrize(('entry', 'place', 'words'), [
    ({'animation': '{name: walk}'}, 'animation.name',
     'UnknownAnimation: .walk.; expected one of swing, baked swing, jump, baked jump, run'),
    ({'animation': '{name: run, time: 1.5}'}, 'animation.time', 'OutOfRange: 1.5; expected 0 to 1'),
    ({'animation': '{name: run, time: -1}'}, 'animation.time', 'expected 0 or more'),
    ({'animation': '{name: run, time: .nan}'}, 'animation.time', 'OutOfRange: nan'),
    ({'animation': '{time: 0.1}'}, 'animation', 'expected the missing name'),
    ({'animation': '{name: run, begin: 0.1}'}, 'animation', 'expected only name, time, start'),
    ({'animation': '{name: run, start: 1.5}'}, 'animation.start',
     'OutOfRange: 1.5; expected 0 to 1'),
    ({'animation': '{name: run, speed: 0}'}, 'animation.speed', 'NotPositive: 0'),
    ({'animation': '{name: run, time: 0, loop: true}'}, 'animation.time', 'either time, to start'),
    ({'animation': '{name: run, speed: 100, loop: true}'}, 'animation.loop', 'lasts 0.02 s'),
    ({'animation': '{name: run, limp_at: -1}'}, 'animation.limp_at', 'OutOfRange: -1'),
    ({'animation': '{name: run}', 'follow': 'exact'}, 'follow', 'a body, or a doll of one bone'),
    ({'animation': 'run'}, 'animation', 'expected a mapping'),
    ({'animation': '{name: run}', 'spin': [0, 0, 1]}, 'spin', 'none: the animation has its own'),
    ({'animation': '{name: run}', 'angles_deg': '{LeftLeg: 20}'}, 'angles_deg', 'none: the'),
    ({'animation': '{name: run}', 'rates_deg_s': '{LeftLeg: 20}'}, 'rates_deg_s', 'none: the')])
def test_a_wrong_entry_is_named(tmp_path, doll, entry, place, words):
    with pytest.raises(ModelErrors, match=words) as caught:
        load_scene(scene_file(tmp_path, doll, **entry))
    assert [error.path for error in caught.value.errors] == [f'dolls[0].{place}']


@pytest.mark.parametrize(('change', 'words'), [
    ({'model': None}, 'doll.model: WrongForm: None; expected the .glb'),
    ({'model': '/nowhere/twin.glb'}, r'animation.\(twin.glb\): Unreadable: .*; expected a file'),
    ({'riders': ()}, 'doll.model: WrongForm: .*; expected the .glb')])
def test_a_doll_without_its_file_is_named(tmp_path, doll, change, words):
    with pytest.raises(ModelErrors, match=r'dolls\[0\].' + words):
        load_scene(scene_file(tmp_path, dataclasses.replace(doll, **change),
                              animation='{name: run}'))


def test_a_doll_of_another_file_is_refused(doll, tmp_path):
    other = fit_rigs.write(fit_rigs.RIGS['star'], tmp_path)
    animated = animated_rigs.document(fit_rigs.RIGS['star'])
    animated_rigs.animate(animated, fit_rigs.RIGS['star'], {'middle': swing((1, 0, 0), 1)}, (0, 1))
    other.write_bytes(animated.glb())
    with pytest.raises(RagdollError, match='riders: UnknownBone'):
        load_animations(dataclasses.replace(doll, model=str(other)))


def test_a_placement_with_angles_of_its_own_is_refused(doll, animations):
    with pytest.raises(WrongForm, match='angles'):
        animations['run'].place(Placement(doll, angles={'LeftLeg': 0.1}), 0.0)
    with pytest.raises(OutOfRange, match='time'):
        animations['run'].at(2.0)
    with pytest.raises(WrongForm, match='a doll with the bone'):
        animations['run'].place(Placement(fit_rigs.fitted('star').doll), 0.0)


def swinging(rig, folder, document=animated_rigs.document):
    """The doll of a rig amid a motion, in its own frame."""
    front = np.array((-1, 1, -1)) if rig.name == 'faces_backwards' else 1
    moves = {f'mixamorig:{key}': lambda time, move=move: tuple(front * move(time))
             for key, move in (MOVES['swing'] | {'Hips': MOVES['run']['Hips']}).items()}
    made = document(rig)
    animated_rigs.animate(made, rig, moves, np.arange(31) / 30)
    path = folder / f'{rig.name}.glb'
    path.write_bytes(made.glb())
    doll = fit_character(read_character(path), FitOptions(smallest=0.2)).doll
    return load_animations(dataclasses.replace(doll, model=str(path)))['move'].at(TIME)


@pytest.fixture(scope='module')
def plain(tmp_path_factory):
    return swinging(dataclasses.replace(fit_rigs.RIGS['centimetres'], name='plain', unit=1.0),
                    tmp_path_factory.mktemp('plain'))


@pytest.mark.parametrize('name', ['centimetres', 'turned_scaled_moved', 'faces_backwards',
                                  'no_binds', 'scaled_nodes'])
def test_units_axes_and_armatures_make_no_difference(tmp_path, plain, name):
    """The same motion in every one of them: the same angles and speeds, in the doll's own frame."""
    found = swinging(fit_rigs.RIGS[name], tmp_path)
    for key, tolerance in (('angles', 1e-5), ('rates', 1e-4), ('velocity', 1e-4), ('spin', 1e-4)):
        assert getattr(found, key) == pytest.approx(getattr(plain, key), abs=tolerance)


@pytest.mark.parametrize('name', ['one_bone', 'spider', 'four_legs_unnamed_centimetres'])
@pytest.mark.parametrize('unit', [1.0, 100.0])
def test_an_animation_that_stands_still_is_the_bind_pose(tmp_path, name, unit):
    rig = dataclasses.replace(fit_rigs.RIGS[name], unit=unit)
    made = animated_rigs.document(rig)
    animated_rigs.animate(made, rig, {rig.bones[0].name: lambda time: (STILL, STILL)}, (0, 1))
    path = tmp_path / 'still.glb'
    path.write_bytes(made.glb())
    fit = fit_character(read_character(path, 1 / unit), FitOptions(smallest=0.2))
    assert_bind_pose(load_animations(fit.placed(str(path)).doll)['move'].at(0.5))


@pytest.mark.parametrize('pivots', [False, True])
def test_rigid_parts_without_a_skin_are_moved_too(tmp_path, pivots):
    """An arm of a robot of meshes: 0.4 rad about the axis across it."""
    made, arm = parts(pivots), 'J_Bip_L_UpperArm'
    animated_rigs.animate(made, PERSON, {arm: lambda time: (STILL, np.array((0, 0, -0.4 * time)))},
                          (0, 1))
    path = tmp_path / 'robot.glb'
    path.write_bytes(made.glb())
    fit = fit_character(read_character(path), FitOptions(smallest=0.2))
    animation = load_animations(fit.placed(str(path)).doll)['move']
    assert_bind_pose(animation.at(0.0))
    found = animation.at(1.0)
    angles = {name: angle for name, angle in found.angles.items() if abs(angle) > 1e-6}
    assert angles == {f'{arm}_x': pytest.approx(-0.4, abs=1e-6)}
    assert max(found.distances.values()) < 1e-6


def assert_bind_pose(motion):
    """To within the rounding of bones to float32."""
    assert motion.pose.position == pytest.approx((0, 0, 0), abs=1e-6)
    assert rotation.angle_between(motion.pose.orientation, rotation.IDENTITY) < 1e-6
    assert max(map(abs, motion.angles.values()), default=0) < 1e-6
    assert max(motion.distances.values()) < 1e-6


def with_track(tmp_path, path, values):
    """The doll's motion at the middle of a track of two keys of its left arm."""
    made = animated_rigs.document(RIG)
    clock = made.accessor([[0.0], [1.0]], 'f4', 'SCALAR')
    output = made.accessor(values, 'f4', f'VEC{len(values[0])}')
    node = 2 + [bone.name for bone in RIG.bones].index('LeftArm')
    made.data['animations'] = [{
        'samplers': [{'input': clock, 'output': output}],
        'channels': [{'sampler': 0, 'target': {'node': node, 'path': path}}]}]
    file = tmp_path / 'track.glb'
    file.write_bytes(made.glb())
    fit = fit_character(read_character(file), FitOptions(smallest=0.2))
    return load_animations(fit.placed(str(file)).doll)['animation_0'].at(0.5)


@pytest.mark.parametrize('size', [0.0, 1e-30, 1e-3])
def test_a_bone_that_is_scaled_to_nothing_can_be_placed(tmp_path, size):
    """As games hide a hand."""
    found = with_track(tmp_path, 'scale', [(size,) * 3] * 2)
    assert np.isfinite([*found.angles.values(), *found.rates.values(), *found.velocity]).all()


def test_a_bind_pose_without_a_size_is_refused(tmp_path):
    made = animated_rigs.document(dataclasses.replace(RIG, binds=False))
    animated_rigs.animate(made, RIG, MOVES['swing'], (0, 1))
    file = tmp_path / 'twin.glb'
    file.write_bytes(made.glb())
    doll = fit_character(read_character(file), FitOptions(smallest=0.2)).doll
    hand = 2 + [bone.name for bone in RIG.bones].index('LeftArm')
    made.data['nodes'][hand]['scale'] = [0, 0, 0]
    file.write_bytes(made.glb())
    with pytest.raises(WrongForm, match=r'riders: .*LeftArm.*; expected a bone with a scale'):
        load_animations(dataclasses.replace(doll, model=str(file)))


def test_a_bone_beyond_all_numbers_is_refused(tmp_path):
    with pytest.raises(OutOfRange, match=r'LeftArm.*; expected transforms of'):
        with_track(tmp_path, 'scale', [(3e38,) * 3] * 2)


def test_nodes_with_a_matrix_are_animated_too(tmp_path, plain):
    """Against the specification, but programs draw them."""
    rig = dataclasses.replace(fit_rigs.RIGS['centimetres'], name='matrices', unit=1.0)
    found = swinging(rig, tmp_path, fit_rigs.document)
    assert found.angles == pytest.approx(plain.angles, abs=1e-6)
    assert found.rates == pytest.approx(plain.rates, abs=1e-5)


def test_each_character_of_a_file_moves_in_its_own_frame(tmp_path):
    """Two of them, one turned and aside: an animation that stands still is the bind pose."""
    aside = dataclasses.replace(RIG, root=fit_rigs.matrix((0, fit_rigs.HALF, 0, fit_rigs.HALF),
                                                          move=(3, 0, 1)))
    made = fit_rigs.beside(animated_rigs.document(RIG), animated_rigs.document(aside))
    animated_rigs.animate(made, RIG, {'Head': lambda time: (STILL, STILL)}, (0, 1))
    path = tmp_path / 'two.glb'
    path.write_bytes(made.glb())
    fits = fit_characters(read_character(path), FitOptions(smallest=0.2))
    assert len(fits) == 2
    for fit in fits:
        assert_bind_pose(load_animations(fit.placed(str(path)).doll)['move'].at(0.5))


def test_the_report_of_a_fit_names_the_animations(tmp_path, capsys):
    """With their durations, the farthest bone and what exceeds its range: a broken elbow."""
    made = animated_rigs.document(RIG)
    animated_rigs.animate(made, RIG, MOVES['jump'], (0.0, 0.25), name='hop')
    animated_rigs.animate(made, RIG, {'LeftForeArm': swing((0, 1, 0), 1.0)}, (0.0, 0.1, 0.2),
                          name='wrong elbow')
    (tmp_path / 'twin.glb').write_bytes(made.glb())
    assert main([str(tmp_path / 'twin.glb'), '-o', str(tmp_path / 'twin.yaml')]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if 'animation' in line]
    assert lines[0] == 'animation hop: 0.25 s; followed to within 1 mm'
    # The wrist bends back as far as it can, or the hand would be 306 mm off.
    assert lines[1] == ('animation wrong elbow: 0.2 s; followed to within 278 mm (LeftHand); '
                        'beyond their limits: LeftForeArm, LeftHand_2')
    fitted = load_doll(str(tmp_path / 'twin.yaml'))
    scene = load_scene(scene_file(tmp_path, fitted,
                                  animation='{name: hop, time: 0.125}'))
    assert scene.dolls[0].velocity == pytest.approx((2, 0.3, 3 - G * 0.125), abs=1e-4)


def test_a_broken_animation_is_a_warning_of_the_fit(tmp_path, capsys):
    made = animated_rigs.document(RIG)
    animated_rigs.animate(made, RIG, MOVES['jump'], (0.5, 0.25), name='back in time')
    (tmp_path / 'twin.glb').write_bytes(made.glb())
    assert main([str(tmp_path / 'twin.glb')]) == 0
    assert ('warning: animation back in time: animations[0].samplers[0].input: WrongForm: '
            in capsys.readouterr().out)


def test_python_of_the_fit_page_walks_and_falls(capsys):
    """1.3 m in 1.3 s; where the hips lie then is printed. Parabolas: test_limp.py."""
    page = (Path(__file__).resolve().parent.parent / 'docs/fit.md').read_text()
    code = next(block for block in re.findall(r'^```python\n(.*?)^```', page, re.M | re.S)
                if 'load_animations' in block)
    names = {}
    exec(code, names)
    x, y, z = map(float, capsys.readouterr().out.strip('[] \n').split())
    assert abs(x - 1.3) < 1.0 and abs(y) < 1.0 and 0.05 < z < 0.4
    with Simulation(Scene('walk', (names['start'],))) as simulation:
        walked = simulation.run(130)[-1, 0, :3]
    assert walked[:2] == pytest.approx((1.3, 0), abs=0.05) and walked[2] > 0.9

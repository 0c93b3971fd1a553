"""Several characters in one file, in one skin or several: each becomes a doll in its place."""
from dataclasses import replace

import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import Rig
from test_fit_fall import energy, gaps

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.judging.verdict import judge
from ragdoll_ros.fit.pipeline import FitOptions, fit_character, fit_characters
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.skin import skin_of
from ragdoll_ros.model import errors
from ragdoll_ros.model.ragdoll import SkeletonFrame
from ragdoll_ros.model.scene import all_above_ground, height
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.editor.scene_folder import SceneFolder

SMALL = 0.8
"""Size of the second person, of the first."""


def person(prefix='', size=1.0, x=0.0, z=0.0, turn=1, bones=None):
    """A person ``size`` times as tall, at x m to the left and z m ahead; ``turn`` -1: facing -z."""
    def put(point):
        return (turn * size * point[0] + x, size * point[1], turn * size * point[2] + z)
    return [replace(bone, name=prefix + bone.name, head=put(bone.head), tail=put(bone.tail),
                    radius=size * bone.radius) for bone in bones or wild_rigs.person()]


def together(first, second):
    return [*first, *(replace(bone, parent=bone.parent + len(first) if bone.parent >= 0 else -1)
                      for bone in second)]


def write_two(folder, first, second, skins):
    """Both in one file, in one skin or two; gives its path."""
    if skins == 1:
        return fit_rigs.write(Rig('two', together(first, second)), folder)
    path = folder / 'two.glb'
    documents = [fit_rigs.document(Rig('two', bones)) for bones in (first, second)]
    path.write_bytes(fit_rigs.beside(*documents).glb())
    return path


def fit_alone(bones, folder):
    return fit_character(read_character(fit_rigs.write(Rig('alone', bones), folder)))


@pytest.mark.slow
@pytest.mark.parametrize('skin', wild_rigs.SKINS)
@pytest.mark.parametrize('place', [(0, 1.2), (2.6, 0)], ids=['ahead', 'side by side'])
def test_two_in_any_kind_of_skin_are_split(tmp_path, skin, place):
    """Side by side each is the other's mirror image, whose hips are no halves of one pelvis."""
    first, second = person(), person('other ', x=place[0], z=place[1])
    wild = wild_rigs.Wild(Rig('two', together(first, second)), skin, {}, ())
    made = fit_characters(read_character(wild_rigs.write(wild, tmp_path)))
    alone = wild_rigs.Wild(Rig('one', first), skin, {}, ())
    one = fit_character(read_character(wild_rigs.write(alone, tmp_path)))
    for fit, prefix in zip(made, ('', 'other '), strict=True):
        assert [bone.name for bone in fit.doll.bones] == [
            prefix + bone.name for bone in one.doll.bones]
        assert [(j.parent, j.child, j.kind) for j in fit.doll.joints] == [
            (prefix + j.parent, prefix + j.child, j.kind) for j in one.doll.joints]
        assert len(fit.doll.riders) == 22
        # The other's skin and size count for nothing; the file has 32 bits, and the second stands
        # otherwise on the grid of which a skin of little squares is made.
        assert fit.doll.mass == pytest.approx(one.doll.mass, rel=1e-6 if not prefix else 0.03)
        assert judge(fit.doll, fit, falls=False).word == judge(one.doll, one, falls=False).word
    assert made[0].frame.position == pytest.approx((0, 0, 0), abs=1e-6)
    # glTF's left is +x and ahead is +z; REP 103's ahead is x and left is y.
    assert made[1].frame.position == pytest.approx((place[1], place[0], 0), abs=1e-6)


@pytest.mark.parametrize('skins', [1, 2])
@pytest.mark.parametrize('names', ['', 'other '], ids=['same names', 'other names'])
def test_two_people_are_two_dolls_each_as_if_alone(tmp_path, skins, names):
    """A person and a smaller one, who looks at the first: as heavy as the cube of the sizes."""
    first, second = person(), person(names, SMALL, z=2, turn=-1)
    fits = fit_characters(read_character(write_two(tmp_path, first, second, skins)))
    alone = fit_alone(first, tmp_path)
    assert [fit.doll.name for fit in fits] == ['two_1', 'two_2']
    assert [fit.doll.mass for fit in fits] == pytest.approx(
        [alone.doll.mass, SMALL ** 3 * alone.doll.mass], rel=1e-5)
    for fit in fits:
        assert 'Hips' in fit.doll.root.name
        assert [(j.kind, [bone.name for bone in fit.doll.bones].index(j.parent))
                for j in fit.doll.joints] == [
            (j.kind, [bone.name for bone in alone.doll.bones].index(j.parent))
            for j in alone.doll.joints]
        assert judge(fit.doll, fit, falls=False).word == 'good'
    # The second has turned about: ahead of it is where the file's -x is.
    small = fits[1].placed()
    foot = next(bone for bone in fits[1].doll.bones if 'LeftFoot' in bone.name)
    assert foot.position[1] > 0
    assert small.bone_pose(foot).position[1] < 0
    assert small.position == pytest.approx((2, 0, 0), abs=1e-6)


@pytest.mark.parametrize('skins', [1, pytest.param(2, marks=pytest.mark.slow)])
def test_one_command_makes_a_scene_of_both_in_which_they_fall(tmp_path, capsys, skins):
    glb = write_two(tmp_path, person(), person('', SMALL, x=2), skins)
    out = tmp_path / 'scene.yaml'
    assert main([str(glb), '-o', str(out), '--strict', '--urdf', str(tmp_path / 'doll.urdf')]) == 0
    printed = capsys.readouterr().out
    assert printed.count('verdict: good') == 2
    assert 'two_1, character 1 of 2:' in printed and 'two_2, character 2 of 2:' in printed
    assert sorted(path.name for path in tmp_path.glob('*.urdf')) == ['doll_1.urdf', 'doll_2.urdf']
    scene = load_scene(str(out))
    assert [placement.name for placement in scene.dolls] == ['two_1', 'two_2']
    # Where they stood: 2 m to the left, feet on one level, the lowest 0.4 m up.
    first, second = scene.dolls
    assert np.subtract(second.position, first.position) == pytest.approx((0, 2, 0), abs=1e-6)
    lowest = min(height(bone, *each.bone_pose(bone), scene.ground)
                 for each in scene.dolls for bone in each.doll.bones)
    assert lowest == pytest.approx(0.4, abs=1e-9)
    with Simulation(scene) as simulation:
        energies = []
        for _ in range(round(5 / scene.step)):
            state = simulation.advance()
            energies.append([energy(each.doll, State.of(state.rows[own]), 9.8)
                             for each, own in zip(scene.dolls, scene.bone_slices, strict=True)])
    energies = np.array(energies)
    # They fall away from each other's reach, so each has its own account; to the engine's 0.1 %.
    assert (energies.max(axis=0) < 1.001 * energies[0]).all()
    for each, own in zip(scene.dolls, scene.bone_slices, strict=True):
        last = State.of(state.rows[own])
        assert gaps(each.doll, last).max() < 1e-9
        assert last.positions[:, 2].max() < 0.5


@pytest.mark.parametrize('skins', [1, 2])
def test_each_wears_its_own_skin_and_no_other(tmp_path, skins):
    glb = write_two(tmp_path, person(), person('', SMALL, x=2), skins)
    fits = fit_characters(read_character(glb))
    worn = [skin_of(fit.placed(str(glb)).doll) for fit in fits]
    file = read_character(glb)
    assert sum(len(skin.vertices) for skin in worn) == len(file.vertices)
    assert sum(len(skin.triangles) for skin in worn) == len(file.triangles)
    # As drawn: bound to the bodies where they are now, it is where it was in the file.
    for fit, skin, middle in zip(fits, worn, (0, 2), strict=True):
        placed = fit.placed()
        poses = [placed.bone_pose(fit.doll.bones[index]) for index in skin.bones]
        assert np.allclose([pose.position for pose in poses], skin.positions, atol=1e-6)
        low, high = skin.vertices[:, 1].min(), skin.vertices[:, 1].max()
        assert (low + high) / 2 == pytest.approx(middle, abs=1e-5)
        assert high - low < 2


def test_the_page_takes_both_and_judges_each(tmp_path):
    glb = write_two(tmp_path, person(), person('', SMALL, x=2), 1)
    (tmp_path / 'kept').mkdir()
    scene, verdicts = SceneFolder(tmp_path / 'kept').fit(
        'two.glb', glb.read_bytes(), lambda *_: None)
    assert [placement.name for placement in scene.dolls] == ['two_1', 'two_2']
    assert [verdict.word for verdict in verdicts] == ['good', 'good']
    assert all(skin_of(placement.doll) is not None for placement in scene.dolls)


def test_what_is_bound_to_another_doll_is_refused(tmp_path):
    """A rider less, whose bone moves skin that others of the doll's move too."""
    fit = fit_rigs.fitted('mixamo')
    path = fit_rigs.write(fit_rigs.RIGS['mixamo'], tmp_path)
    riders = tuple(rider for rider in fit.doll.riders if rider.name != 'mixamorig:LeftHand')
    with pytest.raises(errors.UnknownBone, match=r'riders.*LeftHand.*fitted to'):
        skin_of(replace(fit.doll, riders=riders, model=str(path)))
    strange = (SkeletonFrame('strange', fit.doll.root.name, (0, 0, 0)),)
    with pytest.raises(errors.UnknownBone, match='riders'):
        skin_of(replace(fit.doll, riders=strange, model=str(path)))


@pytest.mark.slow
def test_those_whose_skins_join_stay_one(tmp_path):
    """Hand in hand: one island of skin has no place where the one ends and the other begins."""
    first = person()
    second = person('other ', x=1.62)
    wild = wild_rigs.Wild(Rig('two', together(first, second)), 'smooth', {}, ())
    assert len(fit_characters(read_character(wild_rigs.write(wild, tmp_path)))) == 1


def test_a_dog_a_bird_and_a_person_are_three(tmp_path):
    """Nothing of it goes by their being people."""
    herd = together(person(bones=fit_rigs.quadruped()),
                    person('x', 1.4, x=2, bones=fit_rigs.bird()))
    herd = together(herd, person('y', x=-2))
    fits = fit_characters(read_character(fit_rigs.write(Rig('herd', herd), tmp_path)))
    assert [fit.doll.name for fit in fits] == ['herd_1', 'herd_2', 'herd_3']
    scene = all_above_ground('herd', [fit.placed() for fit in fits])
    assert [placement.position[1] for placement in scene.dolls] == pytest.approx([0, 2, -2])


def test_a_forced_body_is_one_of_the_character_that_has_the_bone(tmp_path):
    first, second = (person(name, x=x, bones=fit_rigs.humanoid('unreal', fingers=True))
                     for name, x in (('', 0), ('other ', 2.5)))
    character = read_character(write_two(tmp_path, first, second, 1))
    fits = fit_characters(character, FitOptions(keep=('other index_01_l',)))
    assert [sum('index' in bone.name for bone in fit.doll.bones) for fit in fits] == [0, 1]
    with pytest.raises(errors.UnknownBone, match='keep'):
        fit_characters(character, FitOptions(keep=('nobody',)))

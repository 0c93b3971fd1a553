"""The verdict on dolls of which it is known whether they are right: the rigs and broken twins."""
import dataclasses
import re

import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import RIGS, fitted
from test_fit_many import hairy

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.fit.judging.drop_test import run_drop_test
from ragdoll_ros.fit.judging.verdict import judge
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model.shapes import Sphere

PEOPLE = ('mixamo', 'unreal', 'vrm', 'cmu', 'makehuman', 'centimetres', 'z_up')
LEGGED = (*PEOPLE, 'unnamed', 'four_legs', 'four_legs_unnamed_centimetres', 'bird', 'spider')


def with_joint(doll, child, **changes):
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, **changes) if joint.child == child else joint
        for joint in doll.joints))


def joint_of(doll, child):
    return next(joint for joint in doll.joints if joint.child == child)


def leaf(doll):
    """The end of a limb that is two joints or more off the root, left of the middle if any is."""
    inner = {joint.parent for joint in doll.joints}
    ends = [joint.child for joint in doll.joints
            if joint.child not in inner and joint.parent != doll.root.name]
    return max(ends, key=lambda name: doll.bone(name).position[1])


def end_on_the_root(doll):
    """A foot on the trunk: its joint is where it was, but to another body."""
    return with_joint(doll, leaf(doll), parent=doll.root.name)


def rooted_in_a_limb(doll):
    """A limb's first body is the root, and the joints above it are turned round."""
    above = {joint.child: joint for joint in doll.joints}
    name, turned = leaf(doll), {}
    name = above[name].parent
    root, step = name, name
    while step in above:
        joint = above[step]
        turned[step] = dataclasses.replace(joint, parent=step, child=joint.parent)
        step = joint.parent
    assert root != doll.root.name
    return dataclasses.replace(doll, joints=tuple(turned.get(joint.child, joint)
                                                  for joint in doll.joints))


def heavy_end(doll):
    name = leaf(doll)
    return doll.replace_bone(name, mass=10 * doll.bone(name).mass)


def end_of_another_kind(doll):
    joint = joint_of(doll, leaf(doll))
    return with_joint(doll, joint.child, kind='fixed', axes=(), limits=())


def end_of_another_size(doll):
    name = leaf(doll)
    return doll.replace_bone(name, shape=Sphere(2.5 * max(doll.bone(name).shape.half_extents)))


def joint_a_metre_off(doll):
    joint = joint_of(doll, leaf(doll))
    return with_joint(doll, joint.child, anchor=np.add(joint.anchor, (1.0, 0, 0)))


def body_half_a_metre_off(doll):
    name = leaf(doll)
    return doll.replace_bone(name, position=np.add(doll.bone(name).position, (0, 0.5, 0.0)))


def half_uncovered(doll):
    """Every second body is a ball in the middle of its skin."""
    for bone in doll.bones[::2]:
        doll = doll.replace_bone(bone.name, shape=Sphere(0.4 * min(bone.shape.half_extents)))
    return doll


def in_centimetres(doll):
    def shape(given):
        return type(given)(**{key: tuple(100 * v for v in value) if isinstance(value, tuple)
                              else 100 * value for key, value in vars(given).items()})

    return dataclasses.replace(doll, bones=tuple(
        dataclasses.replace(bone, shape=shape(bone.shape), position=100 * np.array(bone.position))
        for bone in doll.bones), joints=tuple(
        dataclasses.replace(joint, anchor=100 * np.array(joint.anchor)) for joint in doll.joints))


def one_knee_the_other_way(doll):
    joint = next(joint for joint in doll.joints if joint.kind == 'hinge')
    low, high = joint.limits[0]
    return with_joint(doll, joint.child, limits=((-high, -low),))


def a_giants_mass(doll):
    """133 kg on 1.4 m is 68 kg/m^2, which is 220 kg here."""
    factor = 220 / doll.mass
    return dataclasses.replace(doll, bones=tuple(
        dataclasses.replace(bone, mass=factor * bone.mass) for bone in doll.bones))


def heavy_head(doll):
    """A third of all mass."""
    name = next(bone.name for bone in doll.bones if 'ead' in bone.name)
    return doll.replace_bone(name, mass=0.5 * doll.mass)


BREAKS = {
    end_on_the_root: LEGGED, rooted_in_a_limb: LEGGED, heavy_end: LEGGED,
    end_of_another_size: LEGGED, joint_a_metre_off: LEGGED, body_half_a_metre_off: LEGGED,
    half_uncovered: LEGGED, in_centimetres: LEGGED,
    end_of_another_kind: LEGGED, one_knee_the_other_way: PEOPLE, a_giants_mass: LEGGED,
    heavy_head: PEOPLE}


FIGURES = dict.fromkeys(
    (end_on_the_root, rooted_in_a_limb, heavy_end, end_of_another_size, joint_a_metre_off,
     body_half_a_metre_off, half_uncovered, in_centimetres, end_of_another_kind),
    ('chibi-smooth', 'chibi-islands', 'monster_of_one_head-smooth', 'hopper-sharp'))
"""Breaks of figures without a person's proportions, and their rigs in wild_rigs."""


def test_right_dolls_are_called_good():
    """The rigs as they are: none is wrong but one in twenty, none doubtful but one more."""
    words = {name: judge(fitted(name).doll, fitted(name), falls=False).word for name in RIGS}
    told = {name: word for name, word in words.items() if word != 'good'}
    assert list(told.values()).count('wrong') <= 0.05 * len(words), told
    assert len(told) <= 0.1 * len(words), told


@pytest.mark.parametrize(('broken', 'name'), [
    (broken, name) for broken, names in BREAKS.items() for name in names],
    ids=lambda value: getattr(value, '__name__', value))
def test_a_broken_twin_is_not_called_good(broken, name):
    fit = fitted(name)
    twin = broken(fit.doll)
    assert twin != fit.doll
    verdict = judge(twin, fit, falls=False)
    assert verdict.word != 'good'


@pytest.mark.parametrize(('broken', 'name'), [
    (broken, name) for broken, names in FIGURES.items() for name in names],
    ids=lambda value: getattr(value, '__name__', value))
def test_a_broken_figure_is_not_called_good(broken, name):
    fit = wild_rigs.fitted(name)
    twin = broken(fit.doll)
    assert judge(fit.doll, fit, falls=False).word == 'good'
    assert twin != fit.doll and judge(twin, fit, falls=False).word != 'good'


@pytest.mark.slow
def test_falls_call_no_right_doll_wrong():
    words = [judge(fitted(name).doll, fitted(name)).word for name in RIGS]
    assert words.count('wrong') <= 0.05 * len(words)


@pytest.mark.parametrize(('broken', 'words'), [
    (end_on_the_root, 'is 0.* m outside mixamorig:Hips, .* % of the size'),
    (rooted_in_a_limb, 'the root is mixamorig:LeftForeArm, a bone of the limbs'),
    (heavy_end, 'LeftHand has 10 times the mass of mixamorig:RightHand'),
    (end_of_another_kind, 'LeftHand has a fixed joint, and mixamorig:RightHand a universal one'),
    (half_uncovered, 'covers [0-9]+ % of its skin'),
    (one_knee_the_other_way, 'the ranges of .* differ by 135 degrees'),
    (a_giants_mass, '220 kg: [67][0-9] kg/m'),
    (heavy_head, "head has .* % of the mass, where a person's has 6.94 %")])
def test_each_fault_is_named(broken, words):
    fit = fitted('mixamo')
    text = str(judge(broken(fit.doll), fit, falls=False))
    assert re.search(words, text), text


def test_the_mannequin_is_good(tmp_path):
    """A real body from PyPI."""
    pytest.importorskip('mannequin')
    path = tmp_path / 'mannequin.glb'
    path.write_bytes(fit_rigs.mannequin().glb())
    fit = fit_character(read_character(path))
    assert str(judge(fit.doll, fit)) == 'verdict: good'


def test_hair_is_no_uncovered_skin_of_the_head(tmp_path):
    """Swings move it: a person with long hair is as good as one without."""
    for strands in (1, 40):
        fit = fit_character(read_character(
            fit_rigs.write(hairy('hair', strands=strands, radius=.03), tmp_path)))
        assert fit.doll.swings
        assert str(judge(fit.doll, fit, falls=False)) == 'verdict: good'


def test_the_shipped_doll_has_the_articles_masses_and_no_other_fault():
    """They are its own: 5 kg for a forearm."""
    sentences = [finding.sentence for finding in judge(load_doll('doll')).findings]
    assert any('the left forearm has 9.1 % of the mass' in sentence for sentence in sentences)
    assert all('a density of' in sentence or '% of the mass' in sentence for sentence in sentences)


def test_a_robots_bodies_are_where_its_file_says():
    fit = fitted('mixamo')
    twin = end_on_the_root(fit.doll)
    assert judge(twin, falls=False).word == 'wrong'
    assert judge(twin, falls=False, measured=True).word == 'good'


def test_a_robot_may_be_of_steel():
    doll = fitted('chain').doll
    name = doll.bones[0].name
    for density, words in ((7800, ('doubtful', 'good')), (9000, ('doubtful', 'doubtful')),
                           (30_000, ('wrong', 'doubtful'))):
        twin = doll.replace_bone(name, mass=density * doll.bone(name).shape.volume)
        assert tuple(judge(twin, falls=False, measured=measured).word
                     for measured in (False, True)) == words


def test_the_drop_test_finds_a_joint_past_its_limits():
    """Bound 57 degrees outside its range."""
    doll = fitted('mixamo').doll
    assert run_drop_test(doll, 1.8) == []
    foot = joint_of(doll, 'mixamorig:LeftFoot')
    twin = with_joint(doll, foot.child, limits=((1.0, 1.2), foot.limits[1]))
    finding, = run_drop_test(twin, 1.8)
    assert '57 degrees past its limits' in finding.sentence and finding.wrong

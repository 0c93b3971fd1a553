"""Legs fold as an animal's do: bent or straight, named or not, in front or behind."""
import dataclasses
import math

import fit_rigs
import numpy as np
import pytest
from fit_rigs import Rig, limb

from ragdoll_ros.fit.judging.verdict import judge
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation

BENT = {'front': [(.55, .33), (.33, .25), (.1, .33), (0, .36)],
        'hind': [(.55, -.38), (.35, -.3), (.15, -.45), (0, -.4)]}
STRAIGHT = {'front': [(.55, .33), (.36, .33), (.17, .33), (0, .33)],
            'hind': [(.55, -.38), (.36, -.38), (.17, -.38), (0, -.38)]}
"""Joints of a leg from the hip to the toes: height and how far in front, m."""

NAMES = {'arms': {'front': ('UpperArm', 'ForeArm', 'Hand'), 'hind': ('Thigh', 'Shin', 'Foot')},
         'legs': {'front': ('FrontThigh', 'FrontShin', 'FrontFoot'),
                  'hind': ('BackThigh', 'BackShin', 'BackFoot')},
         'anatomy': {'front': ('Humerus', 'Radius', 'Carpus'),
                     'hind': ('Femur', 'Stifle', 'Hock')},
         'unknown': {'front': ('a', 'b', 'c'), 'hind': ('d', 'e', 'f')}}

TOWARD = {('front', 1): 1, ('front', 2): -1, ('hind', 1): -1, ('hind', 2): 1}
"""Which way along x the end of a leg goes by its first and its second inner joint."""


def animal(folder, points, names):
    bones = []
    chest = limb(bones, -1, ['hips', 'spine', 'chest'],
                 [(0, .6, -.4), (0, .62, -.1), (0, .62, .15), (0, .62, .4)], [.13, .13, .14])
    limb(bones, chest, ['neck', 'head'], [(0, .65, .4), (0, .82, .55), (0, .85, .8)], [.07, .09])
    for x, side in ((.1, 'Left'), (-.1, 'Right')):
        for end, parent in (('front', chest), ('hind', 0)):
            limb(bones, parent, [f'{side}{name}' for name in NAMES[names][end]],
                 [(x, *point) for point in points[end]], [.06, .04, .03])
    rig = Rig('animal', bones)
    return fit_character(read_character(fit_rigs.write(rig, folder)))


def goes(joint, doll):
    """Way along x, -1 or 1, that the middle of its range takes what hangs on the joint."""
    turn = rotation.from_axis_angle(joint.axes[0], sum(joint.limits[0]) / 2)
    arm = np.subtract(doll.bone(joint.child).position, joint.anchor)
    return np.sign((rotation.rotate(turn, arm) - arm)[0])


@pytest.mark.parametrize('names', NAMES)
@pytest.mark.parametrize('points', [BENT, STRAIGHT], ids=['bent', 'straight'])
def test_knees_hocks_elbows_and_wrists(tmp_path, points, names):
    fit = animal(tmp_path, points, names)
    joints = {joint.child: joint for joint in fit.doll.joints}
    for (end, order), way in TOWARD.items():
        for side in ('Left', 'Right'):
            joint = joints[side + NAMES[names][end][order]]
            assert joint.kind == 'hinge', joint.child
            assert goes(joint, fit.doll) == way, joint.child
            low, high = joint.limits[0]
            # It straightens from where it is bound, and folds far.
            assert low <= 0 and high > 1.2
    guessed = [note for note in fit.notes if 'neither name nor bend' in note]
    if names == 'unknown' and points is STRAIGHT:
        assert 'Lefte' in guessed[0] and 'that of legs in their place' in guessed[0]
    elif points is STRAIGHT:
        assert guessed == []
    assert judge(fit.doll, fit, falls=False).word == 'good'


def test_a_hock_that_folds_the_other_way_is_not_good(tmp_path):
    fit = animal(tmp_path, BENT, 'unknown')
    twin = dataclasses.replace(fit.doll, joints=tuple(
        dataclasses.replace(joint, limits=tuple((-high, -low) for low, high in joint.limits))
        if joint.child.endswith('f') else joint for joint in fit.doll.joints))
    verdict = judge(twin, fit, falls=False)
    assert verdict.word != 'good'
    assert 'Leftf: a limb that goes 3' in str(verdict) and 'past straight' in str(verdict)


@pytest.mark.parametrize('points', [BENT, STRAIGHT], ids=['bent', 'straight'])
@pytest.mark.parametrize(('bone', 'part'), [
    ('Stifle', 'a knee'), ('Hock', 'a hock'), ('Radius', 'an elbow'), ('Carpus', 'a wrist')])
def test_a_named_leg_that_folds_the_other_way_is_wrong(tmp_path, points, bone, part):
    """Also where the bind pose is straight and both sides are alike: nothing else shows it."""
    fit = animal(tmp_path, points, 'anatomy')
    twin = dataclasses.replace(fit.doll, joints=tuple(
        dataclasses.replace(joint, limits=tuple((-high, -low) for low, high in joint.limits))
        if joint.child.endswith(bone) else joint for joint in fit.doll.joints))
    verdict = judge(twin, fit, falls=False)
    assert verdict.word == 'wrong'
    said = str(verdict)
    assert f'Left{bone}: {part} that folds the wrong way' in said or (
        points is BENT and f'Left{bone}: a limb that goes' in said), said


PASTERNS = {'straight': [(.08, .33), (0, .33)], 'sloping': [(.06, .39), (0, .42)]}
"""Where hoof and ground are below the cannon of a front leg, at 0.17 m: height and x."""


@pytest.mark.parametrize('slope', PASTERNS)
def test_a_fetlock_folds_backwards(tmp_path, slope):
    """That of a horse, whose pastern stands straight or slopes forwards, in front and behind."""
    shift = {'front': 0, 'hind': -.71}
    points = {end: [(.8, .33 + x), (.55, .33 + x), (.3, .33 + x), (.17, .33 + x),
                    *((z, at + x) for z, at in PASTERNS[slope])] for end, x in shift.items()}
    names = {'front': ('Humerus', 'Radius', 'Carpus', 'Pastern', 'Hoof'),
             'hind': ('Femur', 'Gaskin', 'Hock', 'BackPastern', 'BackHoof')}
    bones = []
    chest = limb(bones, -1, ['hips', 'spine', 'chest'],
                 [(0, .85, -.4), (0, .87, -.1), (0, .87, .15), (0, .87, .4)], [.13, .13, .14])
    limb(bones, chest, ['neck', 'head'], [(0, .9, .4), (0, 1.1, .55), (0, 1.15, .8)], [.07, .09])
    for x, side in ((.1, 'Left'), (-.1, 'Right')):
        for end, parent in (('front', chest), ('hind', 0)):
            limb(bones, parent, [f'{side}{name}' for name in names[end]],
                 [(x, *point) for point in points[end]], [.06, .045, .035, .03, .03])
    character = read_character(fit_rigs.write(Rig('horse', bones), tmp_path))
    fit = fit_character(character, FitOptions(keep=('*Pastern',)))
    joints = {joint.child: joint for joint in fit.doll.joints}
    for name in ('LeftPastern', 'RightPastern', 'LeftBackPastern', 'RightBackPastern'):
        joint = joints[name]
        assert joint.kind == 'hinge'
        assert goes(joint, fit.doll) == -1, name
        low, high = joint.limits[0]
        assert low == pytest.approx(-math.radians(25)) and high == pytest.approx(math.radians(80))
    assert judge(fit.doll, fit, falls=False).word == 'good'


def test_limbs_without_name_or_bend_get_a_note():
    notes = fit_rigs.fitted('star').notes
    assert any('ball joints are used' in note for note in notes)


def test_legs_of_a_spider_fold_in_their_own_planes():
    """They stand sideways: a bend across the walk is no leg's that is bound past straight."""
    for joint in fit_rigs.fitted('spider').doll.joints:
        if joint.kind == 'hinge':
            # Level, to 3 degrees.
            assert abs(joint.axes[0][2]) < 0.05

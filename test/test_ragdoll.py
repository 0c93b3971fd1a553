"""What a doll may be, and the named error for all that it may not be."""
import dataclasses
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from specimens import HANDLE, HEAD, SPECIMENS

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.urdf import scene_to_urdf
from ragdoll_ros.model import errors
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll, joint_axes
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere
from ragdoll_ros.model.swing import Swing, strand

BALL = Sphere(0.1)


def bone(name, **changes):
    return Bone(name, **{'shape': BALL, 'mass': 1, 'position': (0, 0, 0), **changes})


def hinge(parent, child, **changes):
    return Joint(parent, child, **{'kind': 'hinge', 'anchor': (0, 0, 0), 'axes': ((0, 0, 1),),
                                   **changes})


def in_hammer(x, y, z):
    """Its parts have 74 % and 26 % of its volume: a capsule along x on top of a box."""
    share = HEAD.volume / (HEAD.volume + HANDLE.volume)
    top, bottom = 0.2 * (1 - share), -0.2 * share
    head = np.maximum(0, np.abs(x) - 0.1) ** 2 + y * y + (z - top) ** 2 < 0.05 ** 2
    return head | ((np.abs(x) < 0.02) & (np.abs(y) < 0.03) & (np.abs(z - bottom) < 0.15))


@pytest.mark.parametrize('shape', SPECIMENS.values(), ids=SPECIMENS)
def test_volume_and_inertia_are_those_of_the_uniform_solid(shape):
    """Against sums over a million random points of the bounding box: 1 % is four sigma."""
    rng = np.random.default_rng(0)
    half = np.array(shape.half_extents)
    points = rng.uniform(-half, half, (1_000_000, 3))
    x, y, z = points.T
    if shape.kind == 'compound':
        inside = in_hammer(x, y, z)
    elif shape.kind == 'sphere':
        inside = (points ** 2).sum(axis=1) < shape.radius ** 2
    elif shape.kind == 'box':
        inside = np.full(len(points), True)
    else:
        over = np.maximum(0, np.abs(z) - shape.length / 2) if shape.kind == 'capsule' else 0 * z
        inside = x * x + y * y + over * over < shape.radius ** 2
    assert shape.volume == pytest.approx(np.prod(2 * half) * inside.mean(), rel=0.01)
    x, y, z = points[inside].T
    moments = [(y * y + z * z).mean(), (x * x + z * z).mean(), (x * x + y * y).mean()]
    assert shape.inertia(2.0) == pytest.approx(2 * np.array(moments), rel=0.01)
    for axis in (*np.eye(3), np.array([1, 2, -3]) / math.sqrt(14)):
        farthest = (points[inside] @ axis).max()
        # Random points come within 2 % of the surface, and never beyond it.
        assert farthest <= shape.support(axis) + 1e-12
        assert shape.support(axis) == pytest.approx(farthest, rel=0.06)


@pytest.mark.parametrize(('make', 'error'), [
    (lambda: Sphere(0), errors.NotPositive),
    (lambda: Box((1, -1, 1)), errors.NotPositive),
    (lambda: Cylinder(math.nan, 1), errors.NotFinite),
    (lambda: Capsule(1, math.inf), errors.NotFinite),
    (lambda: bone('a', mass=0), errors.NotPositive),
    (lambda: bone('world'), errors.DuplicateName),
    (lambda: bone('a', moments=(1, 1)), errors.WrongForm),
    (lambda: bone('a', moments=(1, 1, math.nan)), errors.NotFinite),
    (lambda: bone('a', moments=(1, 1, 0)), errors.NotPositive),
    (lambda: bone('a', moments=(3, 1, 1)), errors.OutOfRange),
    (lambda: Compound(()), errors.WrongForm),
    (lambda: Part(Compound((Part(BALL),))), errors.WrongForm),
    (lambda: Part(BALL, (0, 0)), errors.WrongForm),
    (lambda: Part(BALL, orientation=(0, 0, 0, 0)), errors.NotUnit),
    (lambda: bone('a', position=(0, math.nan, 0)), errors.NotFinite),
    (lambda: bone('a', orientation=(0, 0, 0, 0)), errors.NotUnit),
    (lambda: hinge('a', 'b', limits=((1, -1),)), errors.LimitsReversed),
    (lambda: hinge('a', 'b', limits=((0, math.inf),)), errors.NotFinite),
    (lambda: hinge('a', 'b', axes=()), errors.WrongAxes),
    (lambda: hinge('a', 'b', axes=((0, 0, 0),)), errors.NotUnit),
    (lambda: hinge('a', 'b', kind='slider'), errors.WrongAxes),
    (lambda: hinge('a', 'b', damping=-1), errors.OutOfRange),
    (lambda: Joint('a', 'b', 'universal', (0, 0, 0), ((1, 0, 0), (1, 1, 0))), errors.WrongAxes),
    (lambda: Joint('a', 'b', 'ball', (0, 0, 0), ((1, 0, 0),), ((-2, 2), None)), errors.OutOfRange),
    (lambda: Ragdoll('d', ()), errors.Detached),
    (lambda: Ragdoll('d', (bone('a'), bone('a'))), errors.DuplicateName),
    (lambda: Ragdoll('d', (bone('a'), bone('b'))), errors.Detached),
    (lambda: Ragdoll('d', (bone('a'),), (hinge('a', 'x'),)), errors.UnknownBone),
    (lambda: Ragdoll('d', (bone('a'), bone('b'), bone('c')),
                     (hinge('a', 'c'), hinge('b', 'c'))), errors.ConnectedTwice),
    (lambda: Ragdoll('d', (bone('a'), bone('b')),
                     (hinge('a', 'b'), hinge('b', 'a'))), errors.JointCycle),
])
def test_each_error_has_a_name(make, error):
    with pytest.raises(error) as caught:
        make()
    assert caught.value.path and caught.value.expected


@pytest.mark.parametrize(('field', 'value'), [
    ('friction', -1), ('friction', math.nan), ('rolling_friction', -0.1), ('restitution', 1.5),
    ('color', (1, 0, 0, 2))])
def test_a_bones_surface_is_checked_too(field, value):
    with pytest.raises(errors.OutOfRange) as caught:
        bone('b', **{field: value})
    assert caught.value.path == field


def test_limits_in_degrees_survive_radians_to_the_bit():
    for degrees in (-126, 33.3, 0.1, 89.999999):
        joint = hinge('a', 'b', limits=((math.radians(degrees), math.radians(100)),))
        again = hinge('a', 'b', limits=joint.limits)
        assert joint == again
        assert round(math.degrees(joint.limits[0][0]), 9) == degrees


def test_a_ball_with_two_axes_has_three_ranges_of_its_own():
    limits = ((-0.2, 2.5), (-1.0, 0.3), (-0.4, 0.9))
    ball = Joint('a', 'b', 'ball', (0, 0, 0), ((0, 0, 2), (0, 1, 0)), limits)
    assert ball.dof == 3 and not ball.is_free_ball
    assert np.allclose(ball.angle_limits, limits)
    # The first about the axis across, the last the twist, the second about twist times across.
    assert np.allclose(joint_axes(ball), [(0, 1, 0), (-1, 0, 0), (0, 0, 1)])
    for axes, wrong in ((((0, 0, 1), (0, 1, 1)), limits), (((0, 0, 1), (0, 1, 0)), limits[:2]),
                        (((0, 0, 1), (0, 1, 0)), (limits[0], (-1.5, 1.5), limits[2])),
                        (((0, 0, 1), (0, 1, 0)), (limits[0], None, limits[2])),
                        (((0, 0, 1), (0, 1, 0)), ())):
        with pytest.raises(errors.ModelError):
            Joint('a', 'b', 'ball', (0, 0, 0), axes, wrong)


def test_what_hangs_on_bones_is_renamed_with_them():
    """So that a character, and a doll with hair, stand in a scene of several dolls."""
    tail = Swing('tail', 'head', (0, 0, 1.6), (-1, 0, 0), strand(2, 0.3))
    doll = dataclasses.replace(load_doll('doll'), swings=(tail,))
    for each in (load_doll('character'), doll):
        renamed = each.renamed('a_'.__add__)
        for before, after in zip((*each.riders, *each.swings),
                                 (*renamed.riders, *renamed.swings), strict=True):
            assert after == dataclasses.replace(before, bone=f'a_{before.bone}')
        scene_to_urdf(Scene('two', (Placement(each, 'a'), Placement(each, 'b'))))


def test_joints_of_several_dolls_have_the_names_of_the_scene_s_angles():
    """Those, too, that have names of their own, as persons' have: a URDF's joints are unique."""
    scene = Scene('two', (Placement(load_doll('man'), 'a'), Placement(load_doll('woman'), 'b')))
    joints = ElementTree.fromstring(scene_to_urdf(scene)).findall('joint')
    names = [joint.get('name') for joint in joints
             if joint.get('type') not in ('floating', 'fixed')]
    assert sorted(names) == sorted(scene.angle_names)

"""Simulation.initial_overlaps: depths against closed forms; reading them changes no bit."""
from __future__ import annotations

import math

import numpy as np
import pytest

from ragdoll_ros import (
    Bone,
    Box,
    Capsule,
    Cylinder,
    Ground,
    Joint,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
    StaticBody,
    load_scene,
)
from ragdoll_ros.files.config import scene_names
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import WrongForm

pytest.importorskip('numba')

TILT = rotation.from_axis_angle((0.0, 1.0, 0.0), 0.3)
HALF_EDGE = 0.5


def loose(name, shape, **start):
    return Placement(Ragdoll(name, (Bone(name, shape, 1.0, (0, 0, 0)),)), **start)


def overlaps(dolls, bodies=(), ground=None):
    with Simulation(Scene('world', tuple(dolls), ground, bodies=tuple(bodies))) as simulation:
        return simulation.initial_overlaps


BLOCK = StaticBody('block', Box((1.0, 1.0, 1.0)), orientation=TILT)


def above(depth):
    """Position of a point ``depth`` m below the block's upper face, world frame."""
    return tuple(rotation.rotate(TILT, np.array((0.1, 0.0, HALF_EDGE - depth))))


@pytest.mark.parametrize('shape', [Sphere(0.1), Box((0.4, 0.3, 0.2)), Capsule(0.1, 0.2),
                                   Cylinder(0.1, 0.2)])
def test_the_depth_in_a_tilted_body_is_known(shape):
    """Each shape reaches 0.1 m, the capsule 0.2 m, along the normal of the face."""
    reach = 0.2 if shape.kind == 'capsule' else 0.1
    for depth in (0.002, 0.03):
        doll = loose('ball', shape, position=above(depth - reach), orientation=TILT)
        found, = overlaps([doll], [BLOCK])
        assert (found.bone, found.other) == ('ball', 'block')
        assert found.depth == pytest.approx(depth, abs=1e-9)
    assert overlaps([loose('ball', shape, position=above(0.0005 - reach), orientation=TILT)],
                    [BLOCK]) == (), 'less than 1 mm is a contact'


def test_dolls_in_each_other_and_in_the_ground_are_found_deepest_first():
    balls = [loose('low', Sphere(0.2), position=(0, 0, 0.18)),
             loose('high', Sphere(0.1), position=(0.12, 0.16, 0.18)),
             loose('far', Sphere(0.1), position=(3, 0, 0.1))]
    found = overlaps(balls, ground=Ground())
    assert [(one.bone, one.other) for one in found] == [('low/low', 'high/high'),
                                                        ('low/low', 'ground')]
    # The centres are 0.2 m apart, the radii sum up to 0.3 m.
    assert [one.depth for one in found] == pytest.approx([0.1, 0.02])
    assert str(found[1]) == 'low/low is 20.0 mm deep in ground'


def elbow(angle):
    """Three capsules in a row, whose two joints turn by ``angle`` rad."""
    bones = tuple(Bone(name, Capsule(0.05, 0.2), 1.0, (x, 0, 0), rotation.from_rpy(
        0, math.pi / 2, 0)) for name, x in (('upper', 0.0), ('middle', 0.3), ('lower', 0.6)))
    joints = tuple(Joint(parent, child, 'hinge', (x, 0, 0), ((0, 0, 1),), names=(child,))
                   for parent, child, x in (('upper', 'middle', 0.15), ('middle', 'lower', 0.45)))
    return Placement(Ragdoll('arm', bones, joints), angles={'middle': angle, 'lower': angle})


def test_angles_that_fold_a_doll_into_itself_are_found():
    assert overlaps([elbow(0.0)]) == ()
    # An equilateral triangle of sides 0.3 m: the ends of the first and the third meet.
    found, = overlaps([elbow(2 * math.pi / 3)])
    assert {found.bone, found.other} == {'upper', 'lower'}
    # Axes of 0.2 m whose lines cross at 60 degrees, 0.05 m before each end.
    assert found.depth == pytest.approx(0.1 - 0.05, abs=1e-6)


def test_what_a_doll_overlaps_by_itself_is_no_overlap_of_the_scene():
    """Hands of a person are in its thighs when it stands."""
    assert overlaps(load_scene('man').dolls) == ()


@pytest.mark.parametrize('name', [name for name in scene_names() if name != 'field'])
def test_shipped_scenes_begin_free(name):
    with Simulation(load_scene(name)) as simulation:
        assert simulation.initial_overlaps == ()


def test_the_scene_may_be_deep_in_many_bodies():
    """One entry for each body, not for each of its shapes or points."""
    found = overlaps([loose('ball', Box((2, 2, 0.2)))], [
        StaticBody('one', Sphere(0.1), (0.5, 0, 0.1)), StaticBody('two', Box((0.1, 0.1, 1)))])
    assert [(one.bone, one.other) for one in found] == [('ball', 'two'), ('ball', 'one')]
    # The shortest way out of the plank is up or down for the column too: half of both heights.
    assert [one.depth for one in found] == pytest.approx([0.6, 0.1])


def test_reading_changes_no_bit():
    scene = load_scene('table')
    states = []
    for reads in (False, True):
        with Simulation(scene) as simulation:
            rows = [simulation.run(30)]
            if reads:
                assert simulation.initial_overlaps is simulation.initial_overlaps == ()
            states.append(np.concatenate([*rows, simulation.run(30)]))
            measures = simulation.measures()
            assert measures['error_estimate_m'] > 0
    assert states[0].tobytes() == states[1].tobytes()


def test_a_new_start_has_its_own_overlaps():
    with Simulation(Scene('world', (loose('ball', Sphere(0.1), position=(0, 0, 1)),),
                          bodies=(BLOCK,))) as simulation:
        assert simulation.initial_overlaps == ()
        coordinates = simulation.coordinates
        coordinates.q[2] = 0.0
        simulation.place(coordinates)
        found, = simulation.initial_overlaps
        assert found.depth == pytest.approx(HALF_EDGE + 0.1)
        simulation.reset()
        assert simulation.initial_overlaps == (found,)


def test_other_engines_do_not_know():
    with (Simulation(load_scene('drop'), engine='bullet') as simulation,
          pytest.raises(WrongForm, match='rigid')):
        _ = simulation.initial_overlaps

"""Heights of all bones at once: as model.scene.height tells of each, and corners of meshes do."""
import dataclasses

import numpy as np
import pytest
from samples import PLATE, every_kind, random_state, scene_of
from specimens import HAMMER, SPECIMENS

from ragdoll_ros import Bone, Ground, Placement, Ragdoll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import height
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.rigid_body import GroundHeights

LEVEL, TILTED = Ground(), Ground((0.3, -0.5, 0.8), -1.7)
GROUNDS = pytest.mark.parametrize('ground', [LEVEL, TILTED, None], ids=['level', 'tilted', 'none'])

SHAPES = [Ragdoll(kind, (Bone('bone', shape, 2.0, (0, 0, 0)),))
          for kind, shape in SPECIMENS.items()]


@GROUNDS
def test_each_is_that_of_its_bone(ground):
    """Dolls of one and of many bones, of one part and of several, equal ones and others mixed."""
    doll = every_kind()
    scene = scene_of(doll, *SHAPES, PLATE, doll, *SHAPES, ground=ground)
    state = random_state(scene, seed=1, height=2.0)
    found = GroundHeights(scene)(state)
    if ground is None:
        assert (found == np.inf).all() and len(found) == len(scene.bones)
        return
    expected = [height(bone, position, orientation, ground) for bone, position, orientation in zip(
        scene.bones, state.positions, state.orientations, strict=True)]
    assert found == pytest.approx(np.array(expected), abs=1e-14)


@pytest.mark.parametrize('ground', [LEVEL, TILTED], ids=['level', 'tilted'])
@pytest.mark.parametrize('kind', SPECIMENS)
def test_no_point_of_the_surface_is_lower(kind, ground):
    """Corners of the shape's mesh lie on its surface: none is lower, the lowest is as low to what
    a circle of 20 corners leaves out, 1 - cos(9 degrees) of a radius and as much of a profile.
    """
    shape = SPECIMENS[kind]
    scene = scene_of(*[Ragdoll(kind, (Bone('bone', shape, 2.0, (0, 0, 0)),))] * 40, ground=ground)
    state = random_state(scene, seed=2)
    corners = np.array([position + rotation.rotate(orientation, shape.mesh()[0]) for
                        position, orientation in zip(state.positions, state.orientations,
                                                     strict=True)])
    lowest = (corners @ np.array(ground.normal) - ground.offset).min(axis=1)
    missed = lowest - GroundHeights(scene)(state)
    assert missed.min() > -1e-12
    assert missed.max() < 0.03 * max(shape.half_extents)


def test_a_hammer_on_its_head_and_on_its_handle():
    """By hand: the head lies across the handle's top, 0.05 m round; the handle ends 0.15 m below
    its middle.
    """
    head, handle = (part.position[2] for part in HAMMER.parts)
    scene = scene_of(*[Ragdoll('hammer', (Bone('bone', HAMMER, 1.0, (0, 0, 0)),))] * 2,
                     ground=Ground(offset=-1.0))
    state = random_state(scene, seed=3)
    state.rows[:, :7] = (0, 0, 0.5, 0, 0, 0, 1), (0, 0, 0.5, 1, 0, 0, 0)
    assert GroundHeights(scene)(state) == pytest.approx([1.5 + handle - 0.15, 1.5 - head - 0.05])


def test_equal_dolls_share_what_is_read_of_them(monkeypatch):
    """However many there are, each of a doll's shapes is read once."""
    read, support = [], Sphere.support_terms
    monkeypatch.setattr(Sphere, 'support_terms', property(
        lambda shape: (read.append(shape), support.fget(shape))[1]))
    doll = Ragdoll('ball', (Bone('ball', Sphere(0.1), 1.0, (0, 0, 0)),))
    scene = scene_of(doll, ground=LEVEL)
    GroundHeights(dataclasses.replace(scene, dolls=tuple(
        Placement(doll, f'doll_{k}') for k in range(1000))))
    assert len(read) == 1

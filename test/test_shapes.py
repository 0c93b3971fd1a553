"""Every kind of shape in every place that must know it: files, engines, kernels, editor, page."""
import dataclasses

import numpy as np
import pytest
from specimens import SPECIMENS

from ragdoll_ros import Bone, Ground, Placement, Ragdoll, Scene, Simulation, load_doll, save_doll
from ragdoll_ros.files.robots.urdf_tree import parse_urdf
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.shapes import SHAPES, SIZES, Sphere

TURN = tuple(rotation.normalized((.1, .5, -.3, .8)))


@pytest.fixture(params=SPECIMENS)
def shape(request):
    return SPECIMENS[request.param]


def alone(shape, **placed):
    doll = Ragdoll('alone', (Bone('bone', shape, 2.0, (0, 0, 0), TURN),))
    return Scene('alone', (Placement(doll, **placed),), Ground())


def test_every_kind_has_a_specimen():
    assert set(SPECIMENS) == {*SHAPES, Compound.kind}
    assert set(SHAPES) == set(SIZES)


def test_a_file_reads_back_to_the_same_shape(shape, tmp_path):
    doll = alone(shape).dolls[0].doll
    save_doll(doll, tmp_path / 'doll.yaml')
    assert load_doll(str(tmp_path / 'doll.yaml')).bones == doll.bones


def test_a_urdf_reads_back_to_the_same_surface(shape):
    """As one shape or as several: the farthest point along any direction is the same."""
    link = parse_urdf(to_urdf(alone(shape).dolls[0].doll)).links['bone']
    directions = rotation.normalized(np.random.default_rng(0).normal(size=(50, 3)))
    found = np.max([directions @ pose.position + part.support(
        rotation.rotate(rotation.inverse(pose.orientation), directions))
        for part, pose in link.shapes], axis=0)
    back = rotation.inverse(np.array(TURN))
    assert found == pytest.approx(shape.support(rotation.rotate(back, directions)), abs=1e-9)


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_it_comes_to_lie_on_its_surface(shape, engine):
    """Dropped by 1 cm: after 3 s its lowest point is at the ground, to 5 mm."""
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    down = rotation.rotate(rotation.inverse(np.array(TURN)), np.array((0, 0, -1.0)))
    lowest = shape.support(down)
    scene = alone(shape, position=(0, 0, float(lowest) + 0.01))
    with Simulation(scene, engine=engine) as simulation:
        for _ in range(300):
            state = simulation.advance()
    down = rotation.rotate(rotation.inverse(state.orientations[0]), np.array((0, 0, -1.0)))
    assert state.positions[0, 2] - shape.support(down) == pytest.approx(0, abs=5e-3)


def test_its_primitives_reach_as_far_as_it_does(shape):
    """What is drawn, box, cylinder and sphere alone, fills the shape's own surface."""
    directions = rotation.normalized(np.random.default_rng(2).normal(size=(50, 3)))
    assert {part.kind for part in shape.primitives} <= {'box', 'cylinder', 'sphere'}
    found = np.max([directions @ np.array(part.position) + part.shape.support(
        rotation.rotate(rotation.inverse(part.orientation), directions))
        for part in shape.primitives], axis=0)
    assert found == pytest.approx(shape.support(directions), abs=1e-12)


def test_the_editor_makes_each_kind_of_each_other(shape):
    """And what the sheet shows of it, applied as it is, changes nothing."""
    pytest.importorskip('viser')
    from ragdoll_ros.viewer.editor import bone_form, changes
    scene = alone(shape)
    for kind in SHAPES:
        changed = changes.set_shape(scene, 'bone', kind)
        assert changed.bones[0].shape.kind == kind
        values = bone_form.read_bone(changed, 'bone')
        assert bone_form.apply_values(changed, 'bone', values) == changed
    assert bone_form.apply_values(scene, 'bone', bone_form.read_bone(scene, 'bone')) == scene


@pytest.mark.parametrize('number', [np.float64(0.1), np.float32(0.5), 1])
def test_sizes_are_plain_floats(number):
    """Else YAML has no word for them."""
    assert type(Sphere(number).radius) is float


@pytest.mark.parametrize(('make', 'path'), [
    (lambda: SHAPES['box']((1, 1)), 'box'), (lambda: Ground((0, 1)), 'normal'),
    (lambda: dataclasses.replace(alone(Sphere(1)), gravity=(0, -9.8)), 'gravity'),
    (lambda: Placement(alone(Sphere(1)).dolls[0].doll, position=(0, 1)), 'position'),
    (lambda: Placement(alone(Sphere(1)).dolls[0].doll, orientation=(0, 0, 1)), 'orientation'),
    (lambda: Bone('a', Sphere(1), 1, (0, 0)), 'position')])
def test_vectors_of_another_length_are_refused_with_their_name(make, path):
    with pytest.raises(errors.WrongForm) as caught:
        make()
    assert caught.value.path == path

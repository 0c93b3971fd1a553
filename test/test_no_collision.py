"""Bones that a doll's no_collision names pass through each other, by every engine."""
import pytest

from ragdoll_ros.files.doll import doll_data, load_doll, save_doll
from ragdoll_ros.model.errors import ModelErrors
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.simulation import Simulation


def two_rods(*pairs):
    """A heavy box on the ground with two rods upright on it that lean towards each other."""
    balls = [Bone(name, Sphere(0.06), 1.0, (0, side * 0.15, 0.7))
             for name, side in (('left', 1), ('right', -1))]
    hinges = [Joint('box', name, 'hinge', (0, side * 0.25, 0.2), ((1, 0, 0),), (None,))
              for name, side in (('left', 1), ('right', -1))]
    return Ragdoll('rods', (Bone('box', Box((1, 1, 0.2)), 100.0, (0, 0, 0.1)), *balls),
                   tuple(hinges), no_collision=pairs)


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('through', [False, True])
def test_the_two_pass_through_each_other_only_where_it_says_so(engine, through):
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    doll = two_rods(*[('left', 'right')] * through)
    scene = Scene('rods', (Placement(doll),), Ground())
    with Simulation(scene, engine=engine) as simulation:
        # The rods lean over by 0.2 rad and fall flat within 0.6 s.
        lefts = [simulation.advance().positions[1, 1] for _ in range(round(0.6 / scene.step))]
    assert (min(lefts) < -0.1) == through


def test_a_file_keeps_it(tmp_path):
    doll = two_rods(('left', 'right'))
    save_doll(doll, tmp_path / 'rods.yaml')
    assert load_doll(str(tmp_path / 'rods.yaml')) == doll
    assert 'no_collision' not in doll_data(two_rods())


def test_what_is_no_pair_of_two_bones_is_told(tmp_path):
    path = tmp_path / 'rods.yaml'
    save_doll(two_rods(('left', 'right')), path)
    text = path.read_text()
    for wrong in ('[left, rihgt]', '[left, left]', '[left]', 'left'):
        path.write_text(text.replace('[left, right]', wrong))
        with pytest.raises(ModelErrors, match='no_collision'):
            load_doll(str(path))


def test_renamed_and_cut_off_bones_take_it_along():
    from ragdoll_ros.viewer.editor.changes import remove_limb
    doll = two_rods(('left', 'right'))
    assert doll.renamed(str.upper).no_collision == (('LEFT', 'RIGHT'),)
    scene = remove_limb(Scene('rods', (Placement(doll),), Ground()), 'left')
    assert scene.dolls[0].doll.no_collision == ()

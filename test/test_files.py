"""Scenes and dolls as files: the shipped ones, a round trip, and all errors at once."""
import dataclasses
import math

import pytest
import yaml

from ragdoll_ros.files.config import scene_names
from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine

FIVE = """
gravity: [0, 0, -9.8]
step: -1
dolls:
  - doll:
      bones:
        - {name: a, shape: {sphere: {radius: 0.1}}, mass: 0, position: [0, 0, 0]}
        - {name: b, shape: {sphere: {radius: 0.1}}, mass: 1, position: [0, 0, .nan]}
      joints:
        - {parent: a, child: b, kind: hinge, anchor: [0, 0, 0], axes: [[0, 0, 1]],
           limits_deg: [[30, 10]]}
        - {parent: a, child: c, kind: fixed, anchor: [0, 0, 0]}
"""


def test_the_shipped_scenes_load():
    assert {'drop', 'article', 'flight', 'crowd', 'field', 'pile', 'doll', 'article_doll'} <= set(
        scene_names())
    for name in scene_names():
        load_scene(name)
    assert load_scene('article').pace == 0.6
    assert load_scene('flight').ground is None and not any(load_scene('flight').gravity)
    assert len(load_scene('crowd').dolls) == 10


def test_the_crowd_does_not_overlap():
    engine = BulletEngine(load_scene('crowd'), NORMAL)
    assert not engine.contacts()
    engine.close()


def test_a_dolls_file_alone_is_that_doll_above_the_ground(tmp_path):
    ball = Ragdoll('ball', (Bone('b', Sphere(0.1), 1, (0, 0, -5)),))
    save_doll(ball, tmp_path / 'ball.yaml')
    scene = load_scene(str(tmp_path / 'ball.yaml'))
    position, _ = scene.dolls[0].bone_pose(ball.root)
    assert scene.ground is not None
    assert position[2] - 0.1 == pytest.approx(0.4, abs=1e-9)


def test_what_is_saved_is_loaded(tmp_path):
    doll = Ragdoll('all kinds', (
        Bone('a', Box((0.1, 0.2, 1 / 3)), 1.1, (0.1, 0.2, 0.3), friction=math.inf),
        Bone('b: x', Capsule(0.1, 0.2), 1e-3, (0, 0, 1e-9), (0.1, 0.2, 0.3, 0.4),
             color=(1, 0, 0, 1)),
        Bone('c', Cylinder(0.1, 0.2), 2, (1, 2, 3), restitution=0.25),
        Bone('d', Sphere(0.1), 2, (1, 2, 4), moments=(0.1, 1 / 3, 0.3)),
        Bone('e', Compound((Part(Box((0.1, 0.2, 1 / 3)), (1 / 3, 0, 0), (0.1, 0.2, 0.3, 0.4)),
                            Part(Sphere(0.1)))), 1, (1, 2, 5), moments=(1, 1, 2))), (
        Joint('a', 'b: x', 'ball', (0, 0, 0), ((1, 2, 3),), ((-0.7, 0.7), (-0.123, 0.123)), 0.1),
        Joint('a', 'c', 'universal', (1, 0, 0), ((1, 0, 0), (0, 1, 0)), ((-1, 0.3), None)),
        Joint('c', 'd', 'fixed', (1, 1, 1)), Joint('d', 'e', 'fixed', (1, 1, 1))))
    save_doll(doll, tmp_path / 'doll.yaml')
    assert load_doll(str(tmp_path / 'doll.yaml')) == doll
    scene = dataclasses.replace(load_scene('crowd'), step=1 / 240, self_collision=False)
    save_scene(scene, tmp_path / 'scene.yaml')
    assert load_scene(str(tmp_path / 'scene.yaml')) == scene


def test_the_path_of_a_character_is_seen_from_its_dolls_file(tmp_path):
    ball = Ragdoll('ball', (Bone('b', Sphere(0.1), 1, (0, 0, 0)),),
                   model=str(tmp_path / 'characters' / 'ball.glb'))
    (tmp_path / 'dolls').mkdir()
    save_doll(ball, tmp_path / 'dolls' / 'ball.yaml')
    text = (tmp_path / 'dolls' / 'ball.yaml').read_text()
    assert yaml.safe_load(text)['model'] == '../characters/ball.glb'
    assert load_doll(str(tmp_path / 'dolls' / 'ball.yaml')) == ball
    # From a scene in another folder: by the doll's own file, then in the scene's.
    (tmp_path / 'scene.yaml').write_text('dolls: [{doll: dolls/ball.yaml}]')
    scene = load_scene(str(tmp_path / 'scene.yaml'))
    assert scene.dolls[0].doll == ball
    save_scene(scene, tmp_path / 'saved.yaml')
    assert load_scene(str(tmp_path / 'saved.yaml')).dolls[0].doll == ball
    moved = tmp_path / 'elsewhere'
    (tmp_path / 'dolls').rename(moved)
    assert load_doll(str(moved / 'ball.yaml')) == ball


def test_a_bone_may_not_be_called_as_the_world(tmp_path):
    """A push in the frame `world` could be meant for either."""
    path = tmp_path / 'doll.yaml'
    path.write_text('bones: [{name: world, mass: 1, position: [0, 0, 0], '
                    'shape: {sphere: {radius: 0.1}}}]')
    with pytest.raises(errors.ModelErrors,
                       match=r'bones\[0\].name: DuplicateName: .world.; expected'):
        load_scene(str(path))


def test_bones_of_masses_far_apart_are_refused(tmp_path):
    """At 1e8 they run; beyond it the error names the bone, its mass and the lightest. Who builds a
    doll in Python may do otherwise, and waits.
    """
    path = tmp_path / 'doll.yaml'
    for mass, fits in ((5e8, True), (1e9, False)):
        bones = (Bone('light', Sphere(0.1), 5.0, (0, 0, 0)),
                 Bone('heavy', Sphere(0.1), mass, (1, 0, 0)))
        joints = (Joint('light', 'heavy', 'ball', (0.5, 0, 0), ((1, 0, 0),)),)
        save_doll(Ragdoll('doll', bones, joints), path)
        if fits:
            assert load_doll(str(path)).mass == 5e8 + 5
            continue
        with pytest.raises(errors.ModelErrors,
                           match=r'bones\[1\].mass.*1000000000.0.*light with 5 kg'):
            load_doll(str(path))


def test_all_errors_come_at_once_with_their_places(tmp_path):
    path = tmp_path / 'five.yaml'
    path.write_text(FIVE)
    with pytest.raises(errors.ModelErrors) as caught:
        load_scene(str(path))
    found = {error.path: type(error) for error in caught.value.errors}
    assert found == {
        'step': errors.OutOfRange,
        'dolls[0].doll.bones[0].mass': errors.NotPositive,
        'dolls[0].doll.bones[1].position': errors.NotFinite,
        'dolls[0].doll.joints[0].limits_deg[0]': errors.LimitsReversed,
        'dolls[0].doll.joints[1].child': errors.UnknownBone}
    assert str(path) in str(caught.value) and '5 errors' in str(caught.value)


@pytest.mark.parametrize('text', ['', '[1, 2', '\x00', '{a: &a [*a]}', '7', '- x', 'dolls: 3',
                                  'dolls: [{doll: {bones: []}}]', 'dolls: [{doll: 5}]',
                                  'bones: [{name: 3}]', 'dolls: [{doll: ../../etc/passwd}]'])
def test_rubbish_is_refused_in_words(tmp_path, text):
    path = tmp_path / 'rubbish.yaml'
    path.write_text(text)
    with pytest.raises(errors.ModelErrors):
        load_scene(str(path))


@pytest.mark.parametrize('use', ['[{}]', '{{<<: [{}]}}'])
def test_aliases_of_aliases_do_not_fill_the_memory(tmp_path, use):
    """Followed, ten lines are 9^9 values."""
    first, *others = 'abcdefghij'
    text = f'{first}: &{first} {{k: 0}}\n'
    for name in others:
        text += f'{name}: &{name} ' + use.format(', '.join([f'*{first}'] * 9)) + '\n'
        first = name
    path = tmp_path / 'bomb.yaml'
    path.write_text(text + f'bones: [*{first}]\n')
    with pytest.raises(errors.ModelErrors, match='aliases'):
        load_scene(str(path))


@pytest.mark.parametrize('text', ['[' * 100_000, '- ' * 100_000, '{a: ' * 100_000,
                                  'bones: ' + '[' * 5000 + ']' * 5000])
def test_what_is_nested_too_deeply_does_not_end_the_process(tmp_path, text):
    (tmp_path / 'deep.yaml').write_text(text)
    with pytest.raises(errors.ModelErrors, match='nested too deeply'):
        load_scene(str(tmp_path / 'deep.yaml'))


def test_a_missing_file_names_the_ones_there_are():
    with pytest.raises(errors.ModelErrors, match='drop'):
        load_scene('no such scene')


def test_a_misspelled_key_is_named(tmp_path):
    """And nothing else of what stands beside it."""
    path = tmp_path / 'ball.yaml'
    path.write_text('bones: [{name: b, shape: {sphere: {radius: 1}}, mass: 1, position: [0, 0, 0], '
                    'colour: [1, 0, 0, 1], masss: 2}]')
    with pytest.raises(errors.ModelErrors) as caught:
        load_scene(str(path))
    error, = caught.value.errors
    assert (error.path, error.value) == ('bones[0]', 'colour, masss')
    assert 'only name, shape, mass' in error.expected


@pytest.mark.parametrize(('text', 'path', 'words'), [
    ('', '', 'exactly one of shape, shapes'),
    ('shape: {sphere: {radius: 1}}, shapes: [{sphere: {radius: 1}}]', '',
     'exactly one of shape, shapes'),
    ('shapes: []', '.shapes', 'at least 1'), ('shapes: [3]', '.shapes[0]', 'mapping'),
    ('shapes: [{sphere: {radius: 1}, box: {size: [1, 1, 1]}}]', '.shapes[0]', 'exactly one of'),
    ('shapes: [{sphere: {radius: 1}}, {sphere: {radius: .inf}}]', '.shapes[1].sphere', 'finite'),
    ('shapes: [{sphere: {radius: 1}, position: [0, 0.5, 0]}]', '.shapes', 'centre of mass'),
    ('shape: {sphere: {radius: 1}}, inertia: [1, 1]', '.inertia', '3'),
    ('shape: {sphere: {radius: 1}}, inertia: [1, 1, 0]', '.inertia[2]', 'above 0'),
    ('shape: {sphere: {radius: 1}}, inertia: [1, 1, 2.1]', '.inertia', 'sum of the other two')])
def test_what_is_wrong_with_shapes_and_inertia_is_told_in_its_place(tmp_path, text, path, words):
    (tmp_path / 'doll.yaml').write_text(
        f'bones: [{{name: b, mass: 1, position: [0, 0, 0], {text}}}]')
    with pytest.raises(errors.ModelErrors) as caught:
        load_doll(str(tmp_path / 'doll.yaml'))
    error, = caught.value.errors
    assert error.path == 'bones[0]' + path and words in error.expected


def test_numbers_may_be_written_as_1e3(tmp_path):
    data = {'dolls': [{'doll': 'doll.yaml'}]}
    path = tmp_path / 'scene.yaml'
    path.write_text(yaml.safe_dump(data) + 'ground: {offset: -1e3}\n')
    assert load_scene(str(path)).ground.offset == -1000.0

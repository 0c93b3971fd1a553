"""The standard's services: what can be told without its messages; then with them, over DDS."""
from __future__ import annotations

import importlib.util
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import ROOT
from message_packages import build
from samples import FLAIL_SDF, TWO_FLAILS_SDF, random_coordinates
from simulation_interfaces_types import VERSION_1, VERSION_2

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.model import rotation, shapes
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.physics.engine.capabilities import Capability
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.simulation_interfaces import servers
from ragdoll_ros.ros.simulation_interfaces.bounds import Kind, Volume, bounding_box, own_box
from ragdoll_ros.ros.simulation_interfaces.codes import Refusal
from ragdoll_ros.ros.simulation_interfaces.entities import Category, Entities
from ragdoll_ros.ros.simulation_interfaces.entity_services import EntityServices
from ragdoll_ros.ros.simulation_interfaces.filters import Filters
from ragdoll_ros.ros.simulation_interfaces.pattern import Pattern
from ragdoll_ros.ros.simulation_interfaces.resources.dolls import doll_of
from ragdoll_ros.ros.simulation_interfaces.resources.spawnables import shipped, spawnables
from ragdoll_ros.ros.simulation_interfaces.simulation_services import SimulationServices, features
from ragdoll_ros.ros.simulation_interfaces.spawning import SpawnServices, at_root_pose

DOCS = (ROOT / 'docs/simulation_interfaces.md').read_text()


def expression(chance, depth):
    """A random expression that means the same to POSIX and to Python, but for captures."""
    kinds = ['a', 'b', '.', '[ab]', '[^a]', '^', '$']
    if depth and chance.random() < 0.7:
        inner = [expression(chance, depth - 1) for _ in range(2)]
        return chance.choice([f'{inner[0]}{inner[1]}', f'({inner[0]}|{inner[1]})',
                              f'({inner[0]}){chance.choice(["*", "+", "?", "{1,2}", "{2}"])}'])
    return chance.choice(kinds)


def test_expressions_match_as_in_grep():
    """Python's re finds a match if there is one, as POSIX does; which one is no question here."""
    chance = random.Random(5)
    texts = ['', 'a', 'b', 'ab', 'ba', 'aab', 'abba', 'cab', 'bbbb']
    for _ in range(300):
        text = expression(chance, 3)
        ours, theirs = Pattern(text), re.compile(text)
        for each in texts:
            assert ours.is_in(each) == bool(theirs.search(each)), (text, each)
    for text, inside, outside in (('[[:digit:]]{2,}', 'doll_10', 'doll_1'), ('[]x]', 'a]', 'a['),
                                  ('\\.', 'a.b', 'ab'), ('^doll_(1|2)$', 'doll_2', 'doll_21'),
                                  ('[a-c-]', '-', 'd')):
        assert Pattern(text).is_in(inside) and not Pattern(text).is_in(outside)


@pytest.mark.parametrize('wrong', [
    '(', ')', '*a', '+', 'a{', 'a{2,1}', 'a{999}', '[', '[a', '[[:x:]]', '\\', 'a|*', 'a' * 201,
    '(' * 60 + ')' * 60])
def test_an_expression_that_is_none_is_refused(wrong):
    with pytest.raises(Refusal, match='filter'):
        Pattern(wrong)


def test_no_expression_takes_long():
    """Those on which a matcher that tries one after the other takes years."""
    begin = time.process_time()
    for text in ('((((.+)+)+)+)+~', '(.|.)*(.|.)*~', '(((.{0,255}){0,255}){0,255}){255}~',
                 '.*' * 90 + '~', '(.?){255}' * 20 + '~', '(' * 30 + '.{0,9}' + '){9}' * 30 + '~',
                 'a' + '*' * 198 + '~', '(' * 30 + '(^|$|.?){9}' + '){2}' * 30 + '~'):
        pattern = Pattern(text)
        try:
            assert not any(pattern.is_in('a' * length) for length in range(300))
        except Refusal as refused:
            assert 'takes too long' in str(refused)
    assert time.process_time() - begin < 20  # .2 s each; a busy machine


@pytest.fixture(scope='module')
def stairs():
    """A man and eleven stairs, in a random posture."""
    scene = load_scene('stairs')
    with Simulation(scene) as simulation:
        simulation.place(random_coordinates(scene, 3))
        yield simulation


def selected(simulation, **filters):
    return [entity.name for entity in Filters(**filters).select(
        Entities(simulation.scene), simulation.scene, simulation.state)]


def test_entities_have_the_category_of_what_they_are(stairs):
    entities = Entities(stairs.scene)
    kinds = {entity.name: entities.info(entity).category for entity in entities}
    assert kinds.pop('man') == Category.HUMAN
    assert set(kinds.values()) == {Category.STATIC_OBJECT} and len(kinds) == 11
    for name in ('drop', 'woman', 'article', 'character'):
        assert next(iter(Entities(load_scene(name)))).info.category == Category.HUMAN
    ball = Bone('ball', shapes.Sphere(0.1), 1.0, (0, 0, 0))
    alone = Scene('one', (Placement(Ragdoll('ball', (ball,), ())),))
    assert next(iter(Entities(alone))).info.category == Category.OBJECT
    assert entities.find('man/head').root == stairs.scene.bone_index('head')
    with pytest.raises(Refusal, match=r"'man/tail'; expected one of man, .*, or doll/bone"):
        entities.find('man/tail')


def test_a_sphere_selects_what_it_reaches(stairs):
    """By the distance of each bone's mesh from its centre; round shapes are a little larger."""
    scene, state = stairs.scene, stairs.state
    man = np.concatenate([state.poses(index).apply(bone.shape.mesh()[0])
                          for index, bone in enumerate(scene.bones)])
    far = man.mean(axis=0) + np.array([0, 0, 3])
    near = np.linalg.norm(man - far, axis=1).min()
    for radius, reached in ((near + 1e-3, True), (near - 0.05, False)):
        volume = Volume.of(Kind.SPHERE, [far, (radius, 0, 0)])
        assert ('man' in selected(stairs, volume=volume)) == reached


def test_a_box_selects_what_its_boxes_meet(stairs):
    head = stairs.scene.bone_index('head')
    lower, upper = own_box(Entities(stairs.scene).find('man/head'), stairs.scene, stairs.state)
    assert (upper - lower > 0.1).all()
    centre = stairs.state.positions[head]
    assert 'man' in selected(stairs, volume=Volume.of(Kind.BOX, [centre, centre]))
    high = [(9, 9, 99), (-9, -9, 90)]
    assert selected(stairs, volume=Volume.of(Kind.BOX, high)) == []
    everything = Volume.of(Kind.BOX, [(-99, -99, -99), (99, 99, 99)])
    assert selected(stairs, volume=everything) == selected(stairs)
    assert selected(stairs, volume=everything, name='^man$', categories=[2]) == ['man']


@pytest.mark.parametrize(('kind', 'points'), [
    (Kind.CONVEX_HULL, [(0, 0, 0)] * 4), (7, []), (Kind.BOX, [(0, 0, 0)]),
    (Kind.SPHERE, [(0, 0, 0), (-1, 0, 0)]), (Kind.SPHERE, [(0, 0, np.nan), (1, 0, 0)])])
def test_a_volume_that_is_none_is_refused(kind, points):
    with pytest.raises(Refusal, match='bounds'):
        Volume.of(kind, points)
    assert Volume.of(Kind.EMPTY, points) is None


def test_the_box_of_a_turned_shape_is_tight():
    """A rod of .1 by 1 m at 45 degrees about y: half (1 + .1) / sqrt 2 along x and z."""
    turn = Pose(np.array([1.0, 2, 3]), np.array([0, np.sin(np.pi / 8), 0, np.cos(np.pi / 8)]))
    lower, upper = bounding_box([(shapes.Box((0.1, 0.2, 1)), turn)])
    half, centre = np.array([1.1 / 8 ** 0.5, 0.1, 1.1 / 8 ** 0.5]), np.array([1, 2, 3])
    np.testing.assert_allclose([lower, upper], [centre - half, centre + half], atol=1e-12)


def test_a_resource_is_one_doll_with_its_root_where_it_is_to_be():
    """Whatever its axes are, and with joint angles of its own."""
    text = ROOT.joinpath('config/drop.yaml').read_text()
    turn = rotation.normalized(np.array([0.1, -0.2, 0.3, 0.9]))
    robot = ROOT.joinpath('config/robot.urdf')
    for placement, _ in (
            doll_of('woman', ''), doll_of('', text), doll_of('slope', ''),
            doll_of((ROOT / 'config/man.yaml').as_uri(), 'ignored'), doll_of(str(robot), ''),
            doll_of('', robot.read_text()), doll_of((ROOT / 'config/character.glb').as_uri(), '')):
        placed = at_root_pose(placement, Pose(np.array([1.0, 2, 3]), turn))
        with Simulation(Scene('one', (placed,))) as simulation:
            root = simulation.state.poses(simulation.scene.bone_index(placed.doll.root.name))
            np.testing.assert_allclose(root.position, [1, 2, 3], atol=1e-12)
            assert rotation.angle_between(root.orientation, turn) < 1e-7


def test_a_robot_and_a_character_are_what_the_fit_makes_of_them():
    robot = doll_of('', to_urdf(load_doll('doll'))).placement.doll
    assert {bone.name for bone in robot.bones} == {bone.name for bone in load_doll('doll').bones}
    assert robot.mass == pytest.approx(load_doll('doll').mass, rel=1e-9)
    character = doll_of(str(ROOT / 'config/character.glb'), '').placement.doll
    assert {bone.name for bone in character.bones} == {
        bone.name for bone in load_doll('character').bones}
    assert 'no mass' in doll_of(str(ROOT / 'config/robot.urdf'), '').notes[0]
    assert character.model == str(ROOT / 'config/character.glb')


def test_a_robot_in_sdf_is_its_links_and_joints(tmp_path):
    path = tmp_path / 'flail.sdf'
    path.write_text(FLAIL_SDF)
    for found in (doll_of('', FLAIL_SDF), doll_of(path.as_uri(), ''),
                  doll_of(str(path), 'ignored')):
        doll = found.placement.doll
        assert [(bone.name, bone.mass) for bone in doll.bones] == [('handle', 2), ('head', 3)]
        joint, = doll.joints
        assert joint.kind == 'ball'
        assert np.subtract(joint.anchor, doll.root.position) == pytest.approx([0, 0, 0.55])
        assert any('ground_plane' in note and 'static' in note for note in found.notes)
        placed = at_root_pose(found.placement, Pose(np.array([1.0, 2, 3]), rotation.IDENTITY))
        with Simulation(Scene('one', (placed,))) as simulation:
            np.testing.assert_allclose(simulation.state.positions, [[1, 2, 3], [1, 2, 3.8]],
                                       atol=1e-12)
    with pytest.raises(Refusal, match='2 dolls; expected of one') as refused:
        doll_of('', TWO_FLAILS_SDF)
    assert refused.value.code == 108


def test_spawnables_are_the_dolls_in_config_and_what_folders_hold(tmp_path):
    assert {each.uri for each in shipped()} == {
        'article_doll', 'character', 'doll', 'man', 'walker', 'woman'}
    heights = {each.uri: np.ptp(each.box, axis=0)[2] for each in shipped()}
    assert 1.5 < heights['woman'] < heights['man'] < 1.9
    for name in ('a robot.urdf', 'b.GLB', 'c.sdf', 'notes.txt'):
        tmp_path.joinpath(name).write_text('')
    found, message = spawnables([tmp_path.as_uri(), str(tmp_path / 'nothing'), 'model://x'])
    assert [each.uri for each in found[len(shipped()):]] == [
        (tmp_path / name).as_uri() for name in ('a robot.urdf', 'b.GLB', 'c.sdf')]
    assert str(tmp_path / 'nothing')[:50] in message and 'model://x' in message


@pytest.mark.parametrize(('uri', 'text', 'code'), [
    ('', ' ', 104), ('nowhere', '', 2), ('scene.mjcf', '', 103), ('', '<mujoco/>', 103),
    ('nowhere.sdf', '', 2), ('', '<sdf/>', 106), ('', '<sdf name="hunter2"', 106),
    ('SECRET.sdf', '', 106),
    ('nowhere.urdf', '', 2), ('', '<robot/>', 106), ('', '<robot name="hunter2"', 106),
    ('SECRET.urdf', '', 106), ('SECRET.glb', '', 106), ('SECRET.gltf', '', 106),
    ('crowd', '', 108), ('', 'password: hunter2', 106), ('', 'dolls: [{doll: nobody}]', 106),
    ('node', '', 106)])
def test_a_resource_that_is_none_is_refused_with_the_standard_s_code(uri, text, code, tmp_path):
    if uri.startswith('SECRET'):
        uri = str(tmp_path / uri)
        Path(uri).write_text('password: hunter2')
    with pytest.raises(Refusal) as refused:
        doll_of(uri, text)
    assert refused.value.code == code
    assert 'hunter2' not in str(refused.value) or 'hunter2' in text


@pytest.mark.skipif(servers.srv is not None, reason='simulation_interfaces is installed')
def test_a_node_without_the_package_says_what_is_missing(make_node):
    node = make_node()
    assert "No module named 'simulation_interfaces'" in node.simulation_interfaces.status
    assert not [name for name, _ in node.get_service_names_and_types() if 'simulation' in name]


def test_the_lines_of_the_documentation_have_the_fields_of_the_services():
    """And its table has all services and features."""
    lines = re.findall(r"^ros2 (?:service call|action send_goal --feedback) /ragdoll/(\w+) "
                       r"simulation_interfaces/(srv|action)/(\w+)(?: '(.*)')?$", DOCS, re.MULTILINE)
    assert len(lines) == DOCS.count('ros2 service call') + DOCS.count('ros2 action')
    for topic, kind, name, text in lines:
        assert topic == servers.snake_case(name)
        fields = yaml.safe_load(text or '{}')
        request = VERSION_2[f'{kind}/{name}.{kind}'].split('---')[0]
        assert set(fields) <= set(re.findall(r'^\S+ (\w+)', request, re.MULTILINE)), name
    served = {*SimulationServices.FEATURES, *EntityServices.FEATURES, *SpawnServices.FEATURES}
    rows = [line.split('|') for line in DOCS.split('```sh')[0].splitlines() if line[:3] == '| `']
    assert {name for row in rows for name in re.findall(r'`([a-z_]+)`', row[1])} == {
        servers.snake_case(name) for name in served} | {'simulate_steps'}
    assert sorted({int(number) for row in rows for number in re.findall(r'\d+', row[2])}) == (
        features(served, Capability))
    assert {f'srv/{name}.srv' for name in served} <= set(VERSION_1)


@pytest.mark.slow
@pytest.mark.parametrize('package', ['simulation_interfaces', 'simulation_interfaces 1'])
def test_services_with_the_messages_of_both_versions(tmp_path, package):
    """In a process of its own, with messages that are built for it or installed."""
    places = {} if importlib.util.find_spec('simulation_interfaces') else build(tmp_path, package)
    environment = {**os.environ, **{
        name: os.pathsep.join(filter(None, [path, str(ROOT) if name == 'PYTHONPATH' else '',
                                            os.environ.get(name)]))
        for name, path in places.items()}}
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
         *(str(Path(__file__).with_name(f'simulation_interfaces_{part}.py'))
           for part in ('served', 'changes'))],
        env=environment, cwd=ROOT, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout + done.stderr

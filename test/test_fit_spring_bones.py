"""Spring bones of a VRM file become swings that move as VRM's own recipe does at 60 Hz."""
import fit_rigs
import numpy as np
import pytest
from fit_rigs import HALF, Rig, document, humanoid, limb, matrix

from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.reading.spring_bones import SpringBone, SpringJoint
from ragdoll_ros.fit.reading.spring_to_swing import swing_from_spring
from ragdoll_ros.fit.report import fit_report
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.model.state import State
from ragdoll_ros.model.swing_mount import SwingMount
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.physics.swing.swings import Swings

POINTS = [(0, 1.7, -.1), (0, 1.68, -.25), (.05, 1.5, -.3), (.05, 1.25, -.3)]
FIRST = 2 + len(humanoid())
HEAD = 'mixamorig:Head'


def rig(**changes):
    bones = humanoid()
    head = next(k for k, bone in enumerate(bones) if bone.name == HEAD)
    limb(bones, head, ['tail0', 'tail1', 'tail2'], POINTS, [.05, .05, .04])
    return Rig('ponytail', bones, **changes)


def new(data, **settings):
    """Add VRM 1.0's extension; the tail's end is a node that no skin knows."""
    data['nodes'].append({'name': 'end', 'translation': [0, 0, .25]})
    end = len(data['nodes']) - 1
    data['nodes'][FIRST + 2]['children'] = [end]
    joints = [{'node': node, 'stiffness': 1.5, 'dragForce': .4, 'gravityPower': .2, **settings}
              for node in (FIRST, FIRST + 1, FIRST + 2, end)]
    data['extensions'] = {'VRMC_springBone': {'springs': [{'name': 'ponytail', 'joints': joints}]}}


def old(data):
    group = {'stiffiness': 1.5, 'dragForce': .4, 'gravityPower': .2, 'bones': [FIRST],
             'gravityDir': {'x': 0, 'y': -1, 'z': 0}}
    data['extensions'] = {'VRM': {'secondaryAnimation': {'boneGroups': [group]}}}


def written(folder, change, made=None):
    made = document(made or rig())
    change(made.data)
    path = folder / 'ponytail.glb'
    path.write_bytes(made.glb())
    return path


@pytest.fixture(scope='module')
def fit(tmp_path_factory):
    return fit_character(read_character(written(tmp_path_factory.mktemp('vrm'), new)))


def in_ros(points):
    return np.array(points, float)[:, [2, 0, 1]]


def check_chain(swing, points, links=3):
    steps = np.diff(in_ros(points), axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    # The file's numbers are float32 at places of the order of 1 m.
    assert np.abs(swing.root - in_ros(points)[0]).max() < 1e-6
    assert np.abs([link.length for link in swing.links[:links]] - lengths).max() < 1e-6
    assert np.abs(swing.directions()[:links] - steps / lengths[:, None]).max() < 1e-5


def test_the_ponytail_hangs_from_the_head(fit):
    [swing] = fit.doll.swings
    assert (swing.name, swing.bone) == ('ponytail', HEAD)
    assert len(swing.links) == 3
    check_chain(swing, POINTS)
    assert not {'tail0', 'tail1', 'tail2'} & {bone.name for bone in fit.doll.bones}
    assert 'spring bones that became swings: 1, with 3 links' in fit_report(fit)


def test_the_head_is_no_larger_for_it(fit):
    """The rest of the doll is what the same character without a tail gives."""
    bare = fit_rigs.fitted('mixamo').doll.bone(HEAD).shape
    assert fit.doll.bone(HEAD).shape.volume == pytest.approx(bare.volume, rel=.05)


def test_turned_and_in_centimetres(tmp_path):
    """Axes and units of the file change no place, no stiffness."""
    turned = rig(unit=100, root=matrix((-HALF, 0, 0, HALF), .01))
    path = written(tmp_path, old, turned)
    [swing] = fit_character(read_character(path)).doll.swings
    [plain] = fit_character(read_character(written(tmp_path, old))).doll.swings
    for key in ('stiffness', 'damping'):
        assert [getattr(link, key) for link in swing.links] == pytest.approx(
            [getattr(link, key) for link in plain.links], rel=1e-5)
    check_chain(swing, POINTS[:3], 2)
    assert len(swing.links) == 3 and swing.links[2].length == pytest.approx(.07, rel=1e-6)


def test_without_springs_nothing_changes(tmp_path):
    texts = []
    for change in (lambda data: None, set_all([], 'VRMC_springBone', 'springs')):
        path = written(tmp_path, lambda data, change=change: (
            change(data), data['nodes'][FIRST + 2].pop('children', None)), rig())
        fit = fit_character(read_character(path))
        save_doll(fit.doll, tmp_path / 'doll.yaml', fit_report(fit))
        texts.append((tmp_path / 'doll.yaml').read_bytes())
    assert texts[0] == texts[1] and b'swing' not in texts[0]


def test_load_of_save_is_equal(tmp_path, fit):
    save_doll(fit.doll, tmp_path / 'doll.yaml', fit_report(fit))
    assert load_doll(str(tmp_path / 'doll.yaml')) == fit.doll


def test_it_falls_and_swings(fit):
    scene = above_ground(fit.doll)
    with Simulation(scene) as simulation:
        start = simulation.swings.directions.copy()
        for _ in range(round(1 / scene.step)):
            simulation.advance()
        now = simulation.swings
    # The rods keep their lengths, to the rounding of places some metres off.
    lengths = [link.length for link in fit.doll.swings[0].links]
    assert np.linalg.norm(np.diff(now.positions, axis=0), axis=1) == pytest.approx(
        lengths[1:], abs=1e-12)
    assert np.abs(now.directions - start).max() > .05


def vrm_frames(rod, length, angle, gravity_way, count):
    """Run VRM's recipe as its specification words it, plane, rest along x; angles (count,)."""
    last = now = length * np.array([np.cos(angle), np.sin(angle)])
    angles = []
    for _ in range(count):
        angles.append(np.arctan2(now[1], now[0]))
        then = (now + (now - last) * (1 - rod.drag) + np.array([1, 0]) * rod.stiffness / 60
                + np.array(gravity_way) * rod.gravity / 60)
        last, now = now, then / np.linalg.norm(then) * length
    return np.array(angles)


def still(swing):
    frame = State(np.zeros((1, 3)), np.array([rotation.IDENTITY]), *np.zeros((2, 1, 3)))
    mount = SwingMount(swing, 0, swing.name, np.zeros(3), np.array(swing.directions()))
    return Swings([mount], (0, 0, -9.8), lambda time: frame)


def single(rod, length=.12):
    spring = SpringBone('s', (0, 1), (rod,), np.array([[0.0, 0, 0], [length, 0, 0]]))
    return swing_from_spring(spring, 'b', 1.0)[0]


@pytest.mark.parametrize(('stiffness', 'drag'), [(1, .4), (4, .1), (.3, .7), (1, .05)])
def test_it_moves_as_vrm_at_60_frames(stiffness, drag):
    rod = SpringJoint(stiffness, 0.0, drag)
    expected = vrm_frames(rod, .12, .02, (0, 0), 40)
    swings = still(single(rod))
    # The recipe's second frame is its first step from rest: it starts with the speed of the roots.
    rate = start_rate(expected)
    swings.begin(0.0, np.array([[np.cos(.02), np.sin(.02), 0]]),
                 rate * np.array([[-np.sin(.02), np.cos(.02), 0]]))
    found = []
    for index in range(40):
        way = swings.evaluate(index / 60).directions[0]
        found.append(np.arctan2(way[1], way[0]))
    # Small angles: the recipe's own terms of third order are 0.02^2 of the angle.
    assert np.abs(np.array(found) - expected).max() < 1e-3 * .02


def start_rate(angles):
    """Rate at the first frame of the motion a exp(x t) + b exp(y t) through all frames."""
    p, q = np.linalg.lstsq(np.stack([angles[1:-1], angles[:-2]], axis=1), angles[2:], rcond=None)[0]
    z = np.roots([1, -p, -q]).astype(complex)
    parts = np.linalg.solve(np.stack([np.ones(2), z]), angles[:2])
    return float((parts * 60 * np.log(z)).sum().real)


@pytest.mark.parametrize(('stiffness', 'gravity'), [(1, .1), (4, 1.0), (2, .5)])
def test_it_sags_as_far_as_vrm(stiffness, gravity):
    """A level rod comes to rest where stiffness sin(a) = gravity cos(a)."""
    rod = SpringJoint(stiffness, gravity, .5)
    # What is left of the way there shrinks by a third a frame or more: 180 of them leave nothing.
    expected = vrm_frames(rod, .12, 0.0, (0, -1), 180)[-1]
    swings = still(single(rod))
    swings.begin(0.0)
    way = swings.evaluate(3.0).directions[0]
    # A swing's spring goes by the angle, the recipe's by its sine: 1 - a^2/6 at these angles.
    assert np.arctan2(way[2], way[0]) == pytest.approx(expected, rel=expected ** 2 / 3)


def set_joint(number, key, value):
    def change(data):
        new(data)
        data['extensions']['VRMC_springBone']['springs'][0]['joints'][number][key] = value
    return change


def set_all(value, *keys):
    def change(data):
        new(data)
        place = data['extensions']
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value
    return change


def set_old(key, value):
    def change(data):
        old(data)
        data['extensions']['VRM']['secondaryAnimation']['boneGroups'][0][key] = value
    return change


BROKEN = {
    'node outside': set_joint(1, 'node', 999), 'node negative': set_joint(1, 'node', -1),
    'node text': set_joint(1, 'node', 'tail'), 'node true': set_joint(0, 'node', True),
    'cycle': set_joint(2, 'node', FIRST), 'twice': set_joint(1, 'node', FIRST),
    'stiffness text': set_joint(0, 'stiffness', 'much'),
    'stiffness negative': set_joint(0, 'stiffness', -1), 'drag 2': set_joint(0, 'dragForce', 2),
    'gravity NaN': set_joint(0, 'gravityPower', float('nan')),
    'gravity way': set_joint(0, 'gravityDir', [0, 'down', 0]),
    'extension list': set_all([], 'VRMC_springBone'),
    'springs number': set_all(3, 'VRMC_springBone', 'springs'),
    'spring number': set_all([3], 'VRMC_springBone', 'springs'),
    'joints missing': set_all([{}], 'VRMC_springBone', 'springs'),
    'joints empty': set_all([{'joints': []}], 'VRMC_springBone', 'springs'),
    'joint number': set_all([{'joints': [1]}], 'VRMC_springBone', 'springs'),
    'old bones': set_old('bones', [999]), 'old stiffness': set_old('stiffiness', None),
    'old way': set_old('gravityDir', {'x': 0})}


@pytest.mark.parametrize('name', BROKEN)
def test_broken_springs_end_in_one_sentence(tmp_path, capsys, name):
    assert main([str(written(tmp_path, BROKEN[name]))]) == 2
    error = capsys.readouterr().err
    assert error.startswith('ragdoll_fit: ') and error.count('\n') == 1
    assert 'extensions.VRM' in error


def test_a_spring_of_one_node_is_ignored_with_a_note(tmp_path):
    change = set_all([{'joints': [{'node': FIRST}]}], 'VRMC_springBone', 'springs')
    fit = fit_character(read_character(written(tmp_path, change)))
    assert not fit.doll.swings
    assert any('one node' in note for note in fit.notes)

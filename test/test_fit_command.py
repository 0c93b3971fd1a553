"""ragdoll_fit as a user calls it."""
import dataclasses
import re
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.judging.fall_cost import FallCost, costs_report
from ragdoll_ros.model.scene import Placement, above_ground, all_above_ground
from ragdoll_ros.physics.simulation import Simulation

BOTH = {'link0', 'link1', 'link1/1', 'link1/2'}
"""Links of two bones with a ball joint between them."""


@pytest.fixture
def glb(tmp_path):
    return fit_rigs.write(RIGS['two_bones'], tmp_path)


def test_one_command_makes_a_scene_that_loads(tmp_path, capsys):
    glb, out = fit_rigs.write(RIGS['unreal'], tmp_path), tmp_path / 'doll.yaml'
    assert main([str(glb), '-o', str(out)]) == 0
    scene = load_scene(str(out))
    assert len(scene.bones) == len(load_doll(str(out)).bones) == 20
    printed = capsys.readouterr().out
    head = [line for line in out.read_text().splitlines() if line.startswith('#')]
    # The report stands in the file's head too, word for word.
    for line in printed.splitlines():
        assert f'# {line}'.rstrip() in head
    assert load_doll(str(out)).model == str(glb)
    assert f'model: {glb.name}' in out.read_text().splitlines()
    for words in ('thigh_l', 'vertices', 'mass, kg', '% of', 'shared', '20 bodies for 52 bones'):
        assert words in printed


def test_the_report_states_what_a_fall_costs(tmp_path, capsys):
    glb, out = fit_rigs.write(RIGS['unreal'], tmp_path), tmp_path / 'doll.yaml'
    assert main([str(glb), '-o', str(out)]) == 0
    line, = [line for line in capsys.readouterr().out.splitlines() if line.startswith('cost here')]
    assert f'# {line}' in out.read_text().splitlines()
    found = re.fullmatch(r'cost here, ms per tick of 10 ms, median: (\S+) at normal \(95 %: (\S+)\)'
                         r', (\S+) at draft \(95 %: (\S+)\); (\d+) and (\d+) ticks', line)
    medians, highest = map(float, found.group(1, 3)), map(float, found.group(2, 4))
    for median, high, accuracy, said in zip(medians, highest, ('normal', 'draft'),
                                            found.group(5, 6), strict=True):
        assert 0 < median <= high
        with Simulation(above_ground(load_doll(str(out))), accuracy=accuracy) as simulation:
            costs = []
            while len(costs) < 200 and not simulation.asleep:
                begun = time.process_time()
                simulation.advance()
                costs.append(1e3 * (time.process_time() - begun))
        # The first tick is left out; on a slow machine the fall ends early, after 0.4 s.
        assert int(said) == len(costs) - 1 or int(said) * median > 10
        # Two measurements, perhaps of a busy machine: the order of magnitude is the same.
        assert 0.1 < median / np.median(costs) < 10


def test_the_report_states_one_cost_of_several_dolls(tmp_path, capsys):
    scene = tmp_path / 'two.yaml'
    dolls = (load_doll('doll'), load_doll('man'))
    save_scene(all_above_ground('two', [Placement(doll, position=(3 * index, 0, 0))
                                        for index, doll in enumerate(dolls)]), scene)
    assert main([str(scene)]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith('cost here') and printed.count('cost here') == 1
    assert printed.count('verdict: ') == 2


def test_a_slow_doll_is_told_what_touches_most():
    contacts = Counter({('thigh', 'calf'): 30, ('calf', 'ground'): 10})
    costs = [FallCost(accuracy, 0.01, np.full(20, ms), contacts)
             for accuracy, ms in (('normal', 9.0), ('draft', 3.0))]
    assert ' '.join(' '.join(costs_report(costs)).split()) == (
        'cost here, ms per tick of 10 ms, median: 9 at normal (95 %: 9), 3 at draft (95 %: 3); '
        "20 and 20 ticks slow: fewer bodies cost less, and so do pairs in the doll's no_collision; "
        'most of its contacts are those of thigh and calf (75 %), calf and ground (25 %)')
    assert len(costs_report(costs[1:])) == 1 and costs_report([]) == []


def test_urdf_and_picture(glb, tmp_path, capsys):
    from xml.etree import ElementTree

    from matplotlib import image
    assert main([str(glb), '--urdf', str(tmp_path / 'doll.urdf'),
                 '--picture', str(tmp_path / 'doll.png')]) == 0
    names = {link.get('name') for link in ElementTree.parse(tmp_path / 'doll.urdf').iter('link')}
    assert names == BOTH
    pixels = image.imread(tmp_path / 'doll.png')[:, :, :3]
    # Skin, both, bodies and joints side by side: something is drawn in each, colours in the third.
    quarters = np.array_split(pixels, 4, axis=1)
    for quarter in quarters:
        assert (quarter.min(axis=2) < 0.9).mean() > 0.02
    assert (np.ptp(quarters[2], axis=2) > 0.2).mean() > 0.01
    # The joint between the two: a black dot, and a ball's three angles in red, green and blue.
    joints = quarters[3]
    assert (joints.max(axis=2) < 0.1).sum() > 20
    for color in range(3):
        others = np.delete(joints, color, axis=2).max(axis=2)
        assert (joints[:, :, color] > others + 0.15).sum() > 20


def test_a_fitted_doll_loads_in_yourdfpy_and_pybullet(glb, tmp_path, capsys):
    import pybullet
    yourdfpy = pytest.importorskip('yourdfpy')
    path = tmp_path / 'doll.urdf'
    assert main([str(glb), '--urdf', str(path)]) == 0
    robot = yourdfpy.URDF.load(str(path), load_meshes=False)
    assert set(robot.link_map) == BOTH
    assert main([str(glb), '--urdf', str(path), '--dialect', 'bullet']) == 0
    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet.loadURDF(str(path), physicsClientId=client)
    mass = sum(pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0]
               for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)))
    pybullet.disconnect(client)
    main([str(glb), '-o', str(tmp_path / 'doll.yaml')])
    assert mass == pytest.approx(load_doll(str(tmp_path / 'doll.yaml')).mass, rel=1e-6)


def test_a_robot_goes_limp(glb, tmp_path, capsys):
    main([str(glb), '--urdf', str(tmp_path / 'a.urdf'), '-o', str(tmp_path / 'fitted.yaml')])
    assert main([str(tmp_path / 'a.urdf'), '-o', str(tmp_path / 'a.yaml')]) == 0
    fitted, limp = (load_doll(str(tmp_path / f'{name}.yaml')) for name in ('fitted', 'a'))
    assert [bone.shape for bone in limp.bones] == [bone.shape for bone in fitted.bones]
    assert [joint.limits for joint in limp.joints] == [joint.limits for joint in fitted.joints]


def test_strict_ends_with_3_where_the_doll_is_not_good(glb, capsys):
    assert main([str(glb), '--strict']) == 0
    assert capsys.readouterr().out.splitlines()[-1] == 'verdict: good'
    assert main(['article_doll.yaml', '--strict']) == 3
    assert capsys.readouterr().out.splitlines()[-1] == 'verdict: doubtful'


def test_each_doll_of_a_scene_is_checked_once(tmp_path, capsys):
    scene = dataclasses.replace(load_scene('crowd'), dolls=(
        *load_scene('crowd').dolls[:2], Placement(load_doll('article_doll'), 'third', (5, 0, 2))))
    save_scene(scene, str(tmp_path / 'three.yaml'))
    assert main([str(tmp_path / 'three.yaml'), '--strict']) == 3
    said = capsys.readouterr().out
    assert 'doll 1 of 2:' in said and 'doll 2 of 2:' in said and said.count('verdict: ') == 2
    assert main([str(tmp_path / 'three.yaml'), '-o', str(tmp_path / 'one.yaml')]) == 2
    assert 'holds 2' in capsys.readouterr().err


def test_a_doll_is_checked(capsys):
    assert main(['article_doll.yaml']) == 0
    assert 'density of 10000' in capsys.readouterr().out


@pytest.mark.parametrize('arguments', [
    ['--mass', '-3'], ['--mass', 'nan'], ['--scale', '0'], ['--weight', '2'], ['--smallest', '-1'],
    ['-o', '/nowhere/at/all.yaml'], ['--picture', '/nowhere/at/all.png'],
    ['--picture', '{folder}/x.nothing']])
def test_wrong_options_end_with_2_and_a_sentence(glb, tmp_path, capsys, arguments):
    assert main([str(glb), *(text.format(folder=tmp_path) for text in arguments)]) == 2
    error = capsys.readouterr().err
    assert error.startswith('ragdoll_fit: ')
    assert error.count('\n') == 1


@pytest.mark.parametrize('option', [
    ['--mass', '3'], ['--masses', 'proportions'], ['--scale', '2'], ['--shape', 'box'],
    ['--orientation', 'bone'], ['--weight', '0.3'], ['--smallest', '0.1']])
@pytest.mark.parametrize('name', ['article_doll.yaml', 'robot.urdf'])
def test_options_of_a_fit_are_refused_where_nothing_is_fitted(capsys, name, option):
    assert main([name, *option]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f'ragdoll_fit: {option[0]}: WrongForm: ') and option[1] in error
    assert 'a .glb or .gltf to fit' in error


@pytest.mark.parametrize(('name', 'why'), [
    ('no_such.glb', 'no such file'), ('no_such.urdf', 'no such file'),
    ('folder.glb', 'not a regular file'), ('folder.urdf', 'not a regular file')])
def test_what_is_no_file_is_refused_with_the_reason(tmp_path, capsys, name, why):
    (tmp_path / 'folder.glb').mkdir()
    (tmp_path / 'folder.urdf').mkdir()
    assert main([str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert name in said and why in said


def test_help_has_an_example():
    root = Path(__file__).parent.parent
    done = subprocess.run([sys.executable, '-m', 'ragdoll_ros.fit.command', '--help'], cwd=root,
                          capture_output=True, text=True, check=True, timeout=30)
    assert 'ragdoll_fit character.glb -o doll.yaml' in done.stdout
    assert '--orientation' in done.stdout


@pytest.mark.slow
def test_a_large_character_takes_less_than_a_second(tmp_path, capsys):
    """60 bones and more than 25 000 vertices, from file to doll; the best of three runs."""
    from ragdoll_ros.fit.pipeline import fit_character
    from ragdoll_ros.fit.reading.character import read_character
    rig = RIGS['chain_60']
    path = tmp_path / 'large.glb'
    mesh = fit_rigs.skin(rig.bones, around=24, rings=18)
    path.write_bytes(fit_rigs.document(rig, mesh).glb())
    assert len(mesh[0]) > 25_000
    times = []
    for _ in range(3):
        start = time.process_time()
        fit_character(read_character(path))
        times.append(time.process_time() - start)
    assert min(times) < 1

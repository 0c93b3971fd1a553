"""BVH files: read as SciPy and bvhio have them, and what is wrong with one is named."""
from __future__ import annotations

import numpy as np
import pytest
from bvh_files import CMU, FRAME_TIME, bvh

from ragdoll_ros.files.bvh.bvh_file import parse_bvh, read_bvh
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelError, ModelErrors

RNG = np.random.default_rng(5)

ARM = {'base': ('', (0, 0, 0)), 'upper': ('base', (1, 2, 3)), 'lower': ('upper', (4, -1, 2))}
"""Three joints."""


def random_turns(skeleton):
    """A constant rotation of each joint."""
    transform = pytest.importorskip('scipy.spatial.transform')
    drawn = transform.Rotation.random(len(skeleton), random_state=3)
    return {name: (lambda time, each=each: each)
            for name, each in zip(skeleton, drawn, strict=True)}


@pytest.mark.parametrize('order', ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX'])
def test_angles_are_in_the_order_of_the_channels(order):
    """Against SciPy's intrinsic rotations, one after the other."""
    turns = random_turns(ARM)
    file = parse_bvh(bvh(ARM, turns, lambda time: (5, 6, 7), order=order).encode())
    worlds = file.worlds(range(3))
    base, upper, lower = (turns[name](0.0) for name in ARM)
    places = [np.array((5.0, 6, 7))]
    places.append(places[0] + base.apply(ARM['upper'][1]))
    places.append(places[1] + (base * upper).apply(ARM['lower'][1]))
    for k, due in enumerate((base, base * upper, base * upper * lower)):
        place, turn = worlds[k]
        # Degrees have nine decimals in the file.
        np.testing.assert_allclose(place[0], places[k], atol=1e-8)
        np.testing.assert_allclose(rotation.matrix(turn[0]), due.as_matrix(), atol=1e-9)


def test_places_of_all_joints_are_bvhios(tmp_path):
    bvhio = pytest.importorskip('bvhio')
    path = tmp_path / 'cmu.bvh'
    path.write_text(bvh(CMU, random_turns(CMU), lambda time: (1, 17, 2), moved=('LeftLeg',)))
    file, root = read_bvh(str(path)), bvhio.readAsHierarchy(str(path))
    root.loadPose(1)
    read = {joint.Name: np.array(joint.PositionWorld) for joint, *_ in root.layout()}
    worlds = file.worlds(range(len(CMU)))
    for k, name in enumerate(file.names):
        # Its numbers have 32 bits.
        np.testing.assert_allclose(worlds[k][0][1], read[name], atol=2e-5)


def test_a_position_replaces_the_offset():
    text = bvh(ARM, moved=('upper',)).replace('OFFSET 1 2 3', 'OFFSET 9 9 9')
    place, _ = parse_bvh(text.encode()).worlds([2])[2]
    assert place[0] == pytest.approx((5, 1, 5))


def test_other_writers_forms_are_read():
    """Windows' line ends, a mark of UTF-8, braces at the names, spaces in these, lower case."""
    text = bvh(ARM).replace('\n  JOINT upper\n', '\n  JOINT my upper').replace(
        'Frames:', 'Frames :').replace('rotation', 'Rotation').replace('\n', '\r\n') + '\r\n\r\n'
    file = parse_bvh(b'\xef\xbb\xbf' + text.encode())
    assert file.names == ['base', 'my upper', 'lower'] and len(file.frames) == 2
    assert file.times[1] == pytest.approx(FRAME_TIME) and file.joints[2].tip == pytest.approx(
        ARM['lower'][1])


GOOD = bvh(ARM)
ROW = GOOD.splitlines()[-1]
LAST = len(GOOD.splitlines())


@pytest.mark.parametrize(('old', 'new', 'place', 'words'), [
    ('HIERARCHY', 'root:x:0:0', 'line 1', "another text'; expected a BVH file"),
    (GOOD, '', 'line 1', 'expected a BVH file'),
    (GOOD, '\0\1\2', 'line 1', 'expected a BVH file'),
    ('upper', '\udcff', 'line 6', 'text in UTF-8'),
    ('MOTION', '', f'line {LAST}', 'expected MOTION'),
    (GOOD[GOOD.index('Frames'):], '', 'line 21', 'expected Frames: and their number'),
    ('Frames: 2', 'Frames: two', 'line 22', "'two'; expected a number"),
    ('Frames: 2', 'Frames: 0', 'line 22', 'OutOfRange: 0.0; expected 1 to 100000'),
    ('Frames: 2', 'Frames: 10000000', 'line 22', 'OutOfRange: 10000000.0; expected 1 to'),
    ('Frames: 2', 'Frames: 1.5', 'line 22', 'a whole number'),
    ('Frames: 2', 'Frames: 3', f'line {LAST}', '2 frames.; expected 3, as Frames says'),
    ('Frames: 2', 'Frames: 1', f'line {LAST}', '2 frames.; expected 1, as Frames says'),
    ('Frame Time: 0', 'Frame Time: -0', 'line 23', 'OutOfRange: -0.008333333333; expected 0.0001'),
    ('Frame Time: 0', 'Frame Time: nan', 'line 23', 'expected a number'),
    (ROW, ROW + ' 1', 'line 24', '13 numbers.; expected 12, one for each channel'),
    (ROW, ROW[:30], 'line 24', '3 numbers.; expected 12'),
    (ROW, ROW.replace('0.000000000', 'nan', 1), 'line 24', "'nan'; expected a number"),
    (ROW, ROW.replace('0.000000000', 'x', 1), 'line 24', "'x'; expected a number"),
    (ROW, ROW.replace('0.000000000', '1e300', 1), 'line 24', "'1e300'; expected a number of at"),
    ('Xrotation', 'Wrotation', 'line 5', "'Wrotation'; expected Xposition"),
    ('CHANNELS 6', 'CHANNELS 7', 'line 5', "'7'; expected a number of channels"),
    ('CHANNELS 6', 'CHANNELS 5', 'line 5', "'Xrotation'; expected OFFSET"),
    ('OFFSET 1 2', 'OFFSET 1', 'line 9', "'CHANNELS'; expected a number"),
    ('ROOT', 'JOINT', 'line 2', "'JOINT'; expected ROOT outside"),
    ('JOINT upper', 'ROOT upper', 'line 6', "'ROOT'; expected ROOT outside"),
    ('      End Site\n      {', '      {', 'line 14', "'{'; expected OFFSET"),
    ('JOINT lower\n', '', 'line 10', "'{'; expected OFFSET"),
    ('\n}\nMOTION', '\nMOTION', 'line 19', "the end of the hierarchy'; expected }"),
    ('OFFSET 1 2 3', 'OFFSET 1 2 inf', 'line 8', "'inf'; expected a number of at most")])
def test_what_is_wrong_is_named_with_its_line(old, new, place, words):
    content = GOOD.replace(old, new, 1).encode('utf-8', 'surrogateescape')
    assert old in GOOD
    with pytest.raises(ModelError, match=words) as caught:
        parse_bvh(content)
    assert caught.value.path == place


def test_a_skeleton_of_too_many_joints_is_refused():
    nested = ''.join(f'JOINT j{k}\n{{\nOFFSET 0 0 1\nCHANNELS 0\n' for k in range(5000))
    text = f'HIERARCHY\nROOT r\n{{\n{nested}{"}" * 5001}\nMOTION\nFrames: 1\nFrame Time: 1\n'
    with pytest.raises(ModelError, match='expected at most 1000 joints'):
        parse_bvh(text.encode())


def test_a_file_that_is_none_is_named(tmp_path):
    (tmp_path / 'walk.txt').write_text(GOOD)
    for name, words in (('none.bvh', 'No such file'), ('walk.txt', 'ends in .bvh')):
        with pytest.raises(ModelErrors, match=words) as caught:
            read_bvh(str(tmp_path / name))
        assert caught.value.file == str(tmp_path / name)


def test_a_file_is_read_anew_after_a_change(tmp_path):
    path = tmp_path / 'walk.bvh'
    path.write_text(bvh(ARM))
    assert len(read_bvh(str(path)).frames) == 2
    path.write_text(bvh(ARM, count=3))
    assert len(read_bvh(str(path)).frames) == 3

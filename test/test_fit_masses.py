"""Masses follow the skin's volume, cut where weights change hands; a person's follow de Leva's."""
import dataclasses
from collections import Counter

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, fitted

from ragdoll_ros.fit.bodies.masses import skin_volumes
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import Character, read_character

DE_LEVA = {'head': 6.94, 'trunk': 43.46, 'upper_arm': 5.42, 'forearm': 3.24, 'hand': 1.22,
           'thigh': 28.32, 'shin': 8.66, 'foot': 2.74}
"""Percent of a man's mass, both sides together: de Leva 1996, table 4, typed anew."""

PART = {'neck': 'head', 'head': 'head', 'spine': 'trunk', 'hips': 'trunk', 'clavicle': 'trunk',
        'toe': 'foot'}


def bar(cuts, lid=True, split=False):
    """A square bar along x from 0 to 3, 1 x 2 across, with rings of vertices at 0, 1, 2, 3.

    ``cuts`` has the body of each ring; ``split``: every triangle has vertices of its own.
    """
    ring = np.array([(0, 0), (1, 0), (1, 2), (0, 2)], float)
    points = np.array([(x, *corner) for x in range(4) for corner in ring])
    faces = []
    for start in range(0, 12, 4):
        for k in range(4):
            a, b = start + k, start + (k + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    if lid:
        faces += [(0, 2, 1), (0, 3, 2), (12, 13, 14), (12, 14, 15)]
    bodies = np.repeat(cuts, 4)
    faces = np.array(faces)
    if split:
        points, bodies = points[faces].reshape(-1, 3), bodies[faces].ravel()
        faces = np.arange(len(points)).reshape(-1, 3)
    nothing = np.zeros((len(points), 1))
    return Character('bar', ('a',), (-1,), np.zeros((1, 3)), np.zeros((1, 4)), points, faces,
                     nothing.astype(int), nothing), bodies


@pytest.mark.parametrize('split', [False, True])
def test_a_bar_in_two_has_two_volumes_that_make_the_whole(split):
    """Between rings the seam zigzags, by at most the 2 l of the piece there: so to the half."""
    character, bodies = bar([0, 0, 1, 1], split=split)
    volumes = skin_volumes(character, bodies, 2)
    assert volumes.sum() == pytest.approx(6, rel=1e-12)
    assert volumes == pytest.approx([3, 3], abs=1)
    inside_out = dataclasses.replace(character, triangles=character.triangles[:, ::-1])
    # The other order of corners gives a triangle on the seam to the other side.
    assert skin_volumes(inside_out, bodies, 2).sum() == pytest.approx(6, rel=1e-12)


def test_an_open_end_is_closed():
    character, bodies = bar([0, 0, 0, 0], lid=False)
    assert skin_volumes(character, bodies, 1) == pytest.approx([6], rel=1e-12)


def test_a_sheet_has_no_volume():
    character, bodies = bar([0, 0, 0, 0])
    flat = dataclasses.replace(character, vertices=character.vertices * (1, 1, 0))
    assert skin_volumes(flat, bodies, 1) == pytest.approx([0], abs=1e-12)


@pytest.mark.parametrize('name', ['mixamo', 'bird', 'starfish', 'spider'])
def test_shares_add_up_to_the_skin_in_water(name):
    """Tubes about each bone: closed, so that all of the volume is somebody's."""
    fit = fitted(name)
    assert fit.doll.mass == pytest.approx(1000 * fit.character.volume(), rel=1e-6)
    for body in fit.bodies:
        tubes = [bone for bone in RIGS[name].bones if bone.name in body.bones]
        # A tube of round ends holds between half and all of its cylinder.
        cylinders = sum(np.pi * bone.radius ** 2 * np.linalg.norm(np.subtract(bone.tail, bone.head))
                        for bone in tubes)
        if name != 'mixamo':
            assert 0.5 < body.bone.mass / (1000 * cylinders) < 1


def shares(fit):
    """Percent of the mass of each segment, left and right together."""
    total = Counter()
    for body in fit.bodies:
        total[PART.get(body.role, body.role)] += 100 * body.bone.mass / fit.doll.mass
    return total


@pytest.fixture(scope='module')
def people(tmp_path_factory):
    """The mannequin, a real body; and tubes with names of four kinds."""
    found = {name: fitted(name).character for name in ('mixamo', 'unreal', 'vrm', 'cmu')}
    try:
        path = tmp_path_factory.mktemp('people') / 'mannequin.glb'
        path.write_bytes(fit_rigs.mannequin().glb())
        found['mannequin'] = read_character(path)
    except ImportError:
        pass
    return found


@pytest.mark.parametrize(('masses', 'within'), [('proportions', 0.2), ('best', 0.35)])
def test_a_persons_shares_are_de_levas(people, masses, within):
    for name, character in people.items():
        fit = fit_character(character, FitOptions(masses=masses))
        assert fit.doll.mass == pytest.approx(1000 * character.volume(), rel=0.15)
        for part, share in shares(fit).items():
            assert share == pytest.approx(DE_LEVA[part], rel=within), (name, part)


def test_what_is_no_person_follows_its_skin():
    """Hips that hold four legs, and a head far ahead of them: no man's shares."""
    character = fitted('four_legs').character
    by_skin = fit_character(character, FitOptions(masses='volume'))
    assert [bone.mass for bone in fitted('four_legs').doll.bones] == [
        bone.mass for bone in by_skin.doll.bones]


def test_a_skin_without_volume_gets_a_note():
    """Every triangle twice, once inside out: no volume at all."""
    character = fitted('two_bones').character
    both = np.concatenate([character.triangles, character.triangles[:, ::-1]])
    fit = fit_character(dataclasses.replace(character, triangles=both))
    note, = fit.notes
    assert 'the bodies 5.34 l: the skin is open or layered, so masses follow the volumes' in note
    assert fit.doll.mass == pytest.approx(1000 * sum(b.shape.volume for b in fit.doll.bones),
                                          rel=1e-6)

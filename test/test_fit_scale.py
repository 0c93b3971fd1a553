"""Length unit of a file: from a person's height, else from the largest plausible extent."""
import numpy as np
import pytest
from fit_rigs import fitted

from ragdoll_ros.fit.reading.scale import metres_per_unit
from ragdoll_ros.model import errors


def unit_of(name, height):
    """Metres to a unit of a rig as high as ``height`` units, and the notes."""
    character, notes = fitted(name).character, []
    factor = height / np.ptp(character.vertices[:, 2])
    metres = metres_per_unit(character.bone_names, character.parents,
                             factor * character.positions, factor * character.vertices, notes)
    return metres, notes


@pytest.mark.parametrize(('height', 'metres', 'unit'), [
    (1.8, 1, None), (0.3, 1, None), (2.9, 1, None), (175, 0.01, 'centimetres'),
    (92, 0.01, 'centimetres'), (1750, 0.001, 'millimetres'), (69, 0.0254, 'inches'),
    (5.8, 0.3048, 'feet'), (17.5, 0.1, 'decimetres'), (0.0175, 100, 'a scale of 0.01 applied'),
    (40_000, 1.75 / 40_000, 'no known unit')])
def test_a_persons_height_tells_the_unit(height, metres, unit):
    found, notes = unit_of('mixamo', height)
    assert found == pytest.approx(metres)
    assert len(notes) == (unit is not None)
    assert unit is None or (unit in notes[0] and '--scale' in notes[0])


@pytest.mark.parametrize(('height', 'metres'), [
    (0.5, 1), (5, 1), (17, 1), (31, 1), (45, 1), (120, 0.01), (400, 0.01), (4000, 0.001),
    (0.01, 100)])
def test_an_animal_is_metres_unless_it_would_be_too_long(height, metres):
    """Four legs, nearly twice as long as high: up to 100 m they are left as they are."""
    found, notes = unit_of('four_legs', height)
    assert found == metres
    assert bool(notes) == (metres != 1 or height > 11)
    assert all('--scale' in note for note in notes)


@pytest.mark.parametrize('height', [0.0, np.inf])
def test_a_skin_without_a_size_is_refused(height):
    with np.errstate(all='ignore'), pytest.raises(errors.OutOfRange, match='a skin with a size'):
        unit_of('snake', height)

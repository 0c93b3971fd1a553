"""Biomechanical limits: the shipped ones, one's own, and what is wrong with others."""
import pytest

from ragdoll_ros import load_doll
from ragdoll_ros.files.limits import load_limits
from ragdoll_ros.model.errors import ModelErrors

MINE = """
source: measured here
regions:
  chest: {force: 100, transient_force: 200, stiffness: 2.0e+4, bones: [chest, left_rib]}
"""


def test_bones_of_people_have_regions():
    limits = load_limits()
    assert 'ISO/TS 15066' in limits.source and len(limits.regions) == 12
    for name in ('man', 'woman', 'doll'):
        without = {bone.name for bone in load_doll(name).bones if not limits.region_of(bone.name)}
        assert without <= {'left_foot', 'right_foot'}
    assert [limits.region_of(bone) for bone in ('head', 'left_shin', 'shin', 'tail')] == [
        'skull', 'lower_leg', 'lower_leg', '']


def test_limits_of_ones_own(tmp_path):
    (tmp_path / 'mine.yaml').write_text(MINE)
    limits = load_limits(tmp_path / 'mine.yaml')
    assert limits.source == 'measured here'
    assert limits.regions['chest'].effective_mass is None
    assert (limits.region_of('left_rib'), limits.region_of('rib')) == ('chest', '')


@pytest.mark.parametrize(('old', 'new', 'found'), [
    ('force: 100', 'force: 0', r'regions.chest.force: NotPositive: 0'),
    ('2.0e+4', 'soft', "regions.chest.stiffness: WrongForm: 'soft'"),
    ('source: measured here', '', 'the missing source'),
    ('bones', 'bone', 'only force, transient_force'),
    ('regions:', 'bones:', 'without regions'),
    ('left_rib]}', 'rib]}\n  rib: {force: 1, transient_force: 1, stiffness: 1, bones: [rib]}',
     'regions.rib.bones: DuplicateName'),
    ('2.0e+4', '.nan', 'NotFinite')])
def test_what_is_wrong_is_named(tmp_path, old, new, found):
    (tmp_path / 'mine.yaml').write_text(MINE.replace(old, new))
    with pytest.raises(ModelErrors, match=found):
        load_limits(tmp_path / 'mine.yaml')


def test_a_missing_file_names_the_shipped_ones():
    with pytest.raises(ModelErrors, match='one of iso_ts_15066'):
        load_limits('nothing')

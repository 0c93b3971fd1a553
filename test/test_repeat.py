"""`repeat:` in a scene: where the copies stand, that a seed repeats them, what is refused."""
from __future__ import annotations

import numpy as np
import pytest

from ragdoll_ros import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelErrors

BONE = '{name: ball, shape: {sphere: {radius: 0.1}}, mass: 1, position: [0, 0, 0]}'
DOLL = f'{{name: ball, bones: [{BONE}]}}'


def scene(tmp_path, repeat, more=''):
    file = tmp_path / 'scene.yaml'
    file.write_text(f'dolls:\n  - {{doll: {DOLL}, position: [1, 2, 3], repeat: {repeat}}}\n{more}')
    return load_scene(str(file))


def places(made):
    return np.array([placement.position for placement in made.dolls])


def test_a_grid_grows_along_x_then_y_then_z(tmp_path):
    made = scene(tmp_path, '{count: 8, grid: [0.5, 0.7, 0.9], columns: [3, 2]}')
    assert places(made) == pytest.approx(np.array([
        (1, 2, 3), (1.5, 2, 3), (2, 2, 3), (1, 2.7, 3), (1.5, 2.7, 3), (2, 2.7, 3),
        (1, 2, 3.9), (1.5, 2, 3.9)]))
    assert [placement.name for placement in made.dolls[:2]] == ['ball_1', 'ball_2']
    assert len({id(placement.doll) for placement in made.dolls}) == 1, 'they share the doll'


def test_a_grid_is_a_square_unless_columns_say_otherwise(tmp_path):
    assert places(scene(tmp_path, '{count: 9, grid: [1, 1, 1]}'))[-1] == pytest.approx((3, 4, 3))


def test_a_shift_makes_a_flight_of_stairs(tmp_path):
    assert places(scene(tmp_path, '{count: 3, shift: [0.3, 0, -0.2]}')) == pytest.approx(
        np.array([(1, 2, 3), (1.3, 2, 2.8), (1.6, 2, 2.6)]))


def test_a_seed_strews_and_turns_the_same_way_for_ever(tmp_path):
    repeat = '{count: 200, spread: [2, 1, 0], turned: true, seed: %d}'
    first, again, other = (scene(tmp_path, repeat % seed) for seed in (7, 7, 8))
    assert first == again != other
    away = places(first) - (1, 2, 3)
    assert (np.abs(away) <= (1, 0.5, 0)).all()
    assert away.std(axis=0) == pytest.approx((2 / 12 ** 0.5, 1 / 12 ** 0.5, 0), rel=0.1)
    turns = np.array([placement.orientation for placement in first.dolls])
    assert np.abs(turns.mean(axis=0)).max() < 0.2, 'any way up'


def test_yaw_turns_about_the_vertical_through_the_centre_of_mass():
    """Of the 160 dolls of `pile`, which stay lying in 4 x 4 columns of ten, clear of the ground."""
    pile = load_scene('pile')
    centres = np.array([np.array(placement.position) + rotation.rotate(
        placement.orientation, placement.doll.mass_centre) for placement in pile.dolls])
    assert len(pile.dolls) == 160
    assert np.ptp(centres[::16], axis=0) == pytest.approx((0, 0, 5.4)), 'ten above each other'
    assert centres[:16].max(axis=0) == pytest.approx((6, 6, 0.5), abs=0.01)
    assert centres[:16].min(axis=0) == pytest.approx((-6, -6, 0.5), abs=0.01)
    spines = np.array([rotation.rotate(placement.orientation, (0.0, 0.0, 1.0))
                       for placement in pile.dolls])
    assert np.abs(spines[:, 2]).max() < 1e-12, 'they lie'
    angles = np.arctan2(spines[:, 1], spines[:, 0])
    assert ((angles >= 0) & (angles <= np.pi)).all()
    assert angles.std() == pytest.approx(np.pi / 12 ** 0.5, rel=0.1)


def test_the_field_is_a_thousand_dolls_that_do_not_touch():
    field = load_scene('field')
    where = places(field)
    assert len(field.dolls) == 1000
    assert min(np.linalg.norm(where[k + 1:] - place, axis=1).min()
               for k, place in enumerate(where[:-1])) == pytest.approx(2.5)


@pytest.mark.parametrize(('repeat', 'path'), [
    ('{grid: [1, 1, 1]}', r'repeat'), ('{count: 0}', r'repeat\.count'),
    ('{count: 1001}', r'repeat\.count'), ('{count: 2.5}', r'repeat\.count'),
    ('{count: 2, grid: [1, 1]}', r'repeat\.grid'), ('{count: 2, sped: 1}', r'repeat'),
    ('{count: 2, columns: [0, 1]}', r'repeat\.columns'),
    ('{count: 2, turned: pitch}', r'repeat\.turned')])
def test_what_is_wrong_is_told_in_its_place(tmp_path, repeat, path):
    with pytest.raises(ModelErrors, match=r'dolls\[0\]\.' + path):
        scene(tmp_path, repeat)


def test_more_dolls_than_a_scene_may_have_are_refused(tmp_path):
    more = f'  - {{doll: {DOLL}, name: other, repeat: {{count: 600}}}}\n'
    with pytest.raises(ModelErrors, match='1200'):
        scene(tmp_path, '{count: 600}', more)

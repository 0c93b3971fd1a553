"""Worst impacts of falls: against closed forms, and as columns of a data set."""
from __future__ import annotations

import io
import math

import numpy as np
import pytest

pytest.importorskip('numba')

from ragdoll_ros import load_limits
from ragdoll_ros.falls.formats.registry import resolve_format
from ragdoll_ros.falls.recipe import build_recipe
from ragdoll_ros.falls.simulate import generate
from ragdoll_ros.physics.sensors.head_injury import head_injury_criterion

G = 9.8
MASS, HEIGHT, RADIUS = 4.5, 0.8, 0.1


def recipe_of_balls(tmp_path, bone, restitution):
    """Balls, each one bone of that name, that fall on the ground."""
    ball = {'name': 'ball', 'bones': [{'name': bone, 'shape': {'sphere': {'radius': RADIUS}},
                                       'mass': MASS, 'position': [0, 0, 0]}]}
    recipe, found = build_recipe({
        'name': 'balls', 'who': {'dolls': [ball]}, 'duration': 1.5,
        'ground': {'restitution': restitution, 'friction': 0.5},
        'start': {'clearance': HEIGHT}}, tmp_path / 'balls.yaml')
    assert not found
    return recipe


@pytest.mark.parametrize('restitution', [0.0, 0.6])
def test_the_worst_impact_of_a_head_is_that_of_the_contact_law(tmp_path, restitution):
    """It arrives with v = sqrt(2 g h): the peak is v sqrt(m k), and the criterion is that of a
    half-sine of pi sqrt(m / k), which is sampled here. Later bounces are weaker.
    """
    skull = load_limits().regions['skull']
    fall, = generate(recipe_of_balls(tmp_path, 'head', restitution), [0])
    speed = math.sqrt(2 * G * HEIGHT)
    peak, duration = (speed * math.sqrt(MASS * skull.stiffness),
                      math.pi * math.sqrt(MASS / skull.stiffness))
    worst = fall.worst_impacts
    assert list(worst.by_region) == ['skull'] and worst.worst is worst.by_region['skull']
    assert worst.worst.peak_force == pytest.approx(peak, rel=1e-6)
    assert worst.worst.ratio == pytest.approx(peak / skull.transient_force, rel=1e-6)
    rate = 1e5
    pulse = peak / MASS * np.sin(np.pi * np.arange(0, duration, 1 / rate) / duration)
    # Sampled at 1e5 Hz, whose ends are within 1e-3 of those of the best window.
    assert worst.hic15 == pytest.approx(head_injury_criterion(pulse, rate), rel=1e-3)


@pytest.mark.parametrize('restitution', [0.0, 0.6])
def test_each_contact_has_its_energy(tmp_path, restitution):
    """Bounces of a ball: m g h comes, e^2 of it goes, until it is slower than an impact."""
    fall, = generate(recipe_of_balls(tmp_path, 'head', restitution), [0])
    energy, time, speed = MASS * G * HEIGHT, math.sqrt(2 * HEIGHT / G), math.sqrt(2 * G * HEIGHT)
    count = 0
    while time < 1.45:
        hit = fall.contacts[count]
        assert (hit.bone, hit.against) == ('head', 'ground')
        assert hit.time * 1e-9 == pytest.approx(time, abs=1e-5)
        assert hit.approach_energy == pytest.approx(energy, rel=1e-5)
        assert hit.lost_energy == pytest.approx((1 - restitution ** 2) * energy, rel=1e-5)
        count, speed, energy = count + 1, speed * restitution, energy * restitution ** 2
        time += 2 * speed / G if speed else math.inf
    assert count == (4 if restitution else 1)


def test_a_bone_without_a_region_has_no_columns_of_its_own(tmp_path):
    fall, = generate(recipe_of_balls(tmp_path, 'shell', 0.0), [0])
    assert fall.worst_impacts.by_region == {} and fall.worst_impacts.worst is None
    assert math.isnan(fall.worst_impacts.hic15)


def test_episodes_have_them_as_columns(tmp_path):
    """Of two falls of the default doll, of which the second hits nothing in its short time."""
    parquet = pytest.importorskip('pyarrow.parquet')
    rows = []
    for duration in (1.5, 0.2):
        recipe, found = build_recipe({
            'name': 'doll_falls', 'who': {'dolls': ['doll']}, 'duration': duration,
            'start': {'tumbled': True, 'clearance': 0.5}}, tmp_path / 'falls.yaml')
        assert not found
        falls = list(generate(recipe, [0]))
        files = resolve_format('lerobot').shard_files(recipe, falls, 0)
        table, = (parquet.read_table(io.BytesIO(data)) for name, data in files.items()
                  if 'episodes' in name)
        rows += [(falls[0].worst_impacts, row, table.schema) for row in table.to_pylist()]
    (worst, row, schema), (none, empty, other) = rows
    assert schema == other, 'shards can be joined'
    assert row['regions'] == list(worst.by_region) == empty['regions']
    assert {'skull', 'chest', 'thigh_knee', 'lower_leg'} <= set(row['regions'])
    assert row['worst_region'] == worst.worst.region
    known = [ratio for ratio in row['region_ratios'] if ratio is not None]
    assert row['worst_ratio'] == max(known) == worst.worst.ratio
    place = row['regions'].index(row['worst_region'])
    assert row['worst_peak_force_N'] == row['region_peak_forces_N'][place]
    assert (row['worst_against'], row['worst_speed_m_s']) == (worst.worst.against,
                                                              worst.worst.speed)
    assert row['contact_times_s'] == sorted(row['contact_times_s'])
    place = row['contact_times_s'].index(worst.worst.time / 1e9)
    assert row['contact_speeds_m_s'][place] == worst.worst.speed
    assert {len(row[key]) for key in row if key.startswith('contact_')} == {
        len(row['contact_bones'])}
    pairs = list(zip(row['contact_times_s'], row['contact_bones'], row['contact_against'],
                     strict=True))
    assert not any((time, against, bone) in pairs for time, bone, against in pairs), 'each once'
    assert empty['contact_bones'] == []
    assert none.worst is None and empty['worst_region'] is empty['worst_ratio'] is None
    assert set(empty['region_ratios']) == {None}

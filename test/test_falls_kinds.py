"""Kinds of falls: of walkers who trip or slip, of people beside bodies."""
import copy
import math
from pathlib import Path

import numpy as np
import pytest
from falls_recipes import BALL, DROP, recipe
from scipy.spatial.transform import Rotation

from ragdoll_ros.falls import generate, load_recipe
from ragdoll_ros.falls.recipe import build_recipe, recipe_of
from ragdoll_ros.falls.simulate import simulate
from ragdoll_ros.falls.start import start_of

WOMAN = {'people': [{'sex': 'female', 'height': 1.6, 'bmi': 22}]}
WALK = {'name': 'walks', 'who': WOMAN, 'duration': 0.1, 'feet': ['left_foot', 'right_foot'],
        'start': {'heading_deg': 90, 'walk': {'speed': 1.2, 'swing': 'right'},
                  'angles_deg': {'r_p_hip': -30, 'r_knee': 55, 'l_knee': 5}}}


@pytest.mark.parametrize(('swing', 'stance'), [('right', 'left'), ('left', 'right')])
def test_a_walkers_stance_foot_rests_and_the_other_swings(swing, stance):
    side = swing[0]
    start = {**WALK['start'], 'walk': {'speed': 1.2, 'swing': swing},
             'angles_deg': {f'{side}_p_hip': -30, f'{side}_knee': 55}}
    fall = next(generate(recipe({**WALK, 'start': start}), [0]))
    # As the engine has it; forwards is the world's y.
    velocities = dict(zip(fall.scene.bone_names, fall.states[0, :, 7:], strict=True))
    np.testing.assert_allclose(velocities['pelvis'][:3], [0, 1.2, 0], atol=1e-9)
    np.testing.assert_allclose(velocities[f'{stance}_foot'], 0, atol=1e-9)
    assert velocities[f'{swing}_foot'][1] == pytest.approx(2.5 * 1.2, abs=1e-9)
    # An inverted pendulum: speeds are in proportion to the heights above the ankle.
    scene, doll = fall.scene, fall.scene.dolls[0].doll
    ankle, = (joint.anchor for joint in doll.joints if joint.child == f'{stance}_foot')
    foot = fall.states[0, scene.bone_index(f'{stance}_foot'), 2]
    height = foot + ankle[2] - doll.bone(f'{stance}_foot').position[2]
    head, pelvis = (fall.states[0, scene.bone_index(name), 2] - height
                    for name in ('head', 'pelvis'))
    assert velocities['head'][1] == pytest.approx(1.2 * head / pelvis, rel=1e-9)


def test_a_grabbed_bone_is_held_as_by_a_damped_spring_and_let_go():
    """A ball that moves at 0.5 m/s in the air, grabbed at the start for 0.1 s."""
    fall = next(generate(recipe(start={'clearance': 5, 'velocity': [0.5, 0, 0]}, accuracy='exact',
                                record={'rate': 100}, grabs=[{'bone': 'ball'}]), [0]))
    time = np.minimum(fall.times, 0.1)
    # Critically damped with w = 30 rad/s: v = v0 (1 - w t) exp(-w t); free again after 0.1 s.
    expected = 0.5 * (1 - 30 * time) * np.exp(-30 * time)
    # Steps of at most 0.25 ms, of order 2: (w h)^2 of the speed.
    np.testing.assert_allclose(fall.states[:, 0, 7], expected, atol=0.5 * (30 * 0.00025) ** 2)
    assert fall.scene.angle_names == () and not fall.failure


@pytest.mark.parametrize('heading', [0, 90])
def test_a_hand_moves_a_ball_with_minimum_jerk_to_where_it_says(heading):
    fall = next(generate(recipe(
        start={'clearance': 0.9, 'heading_deg': heading}, duration=2, record={'rate': 100},
        grabs=[{'bone': 'ball', 'at': 0.2, 'duration': 9, 'to': [0.4, 0, 1.5], 'takes': 1}]), [0]))
    along, up = fall.states[:, 0, 0 if heading == 0 else 1], fall.states[:, 0, 2]
    # Flash and Hogan 1985. A damped spring of w = 30 rad/s is up to a/w^2 behind its hand, whose
    # acceleration is at most 5.8 d/T^2, and ends g/w^2 below it.
    share = np.clip(fall.times - 0.2, 0, 1)
    expected = 0.4 * (10 * share ** 3 - 15 * share ** 4 + 6 * share ** 5)
    np.testing.assert_allclose(along, expected, atol=5.8 * 0.4 / 30 ** 2)
    assert along[-1] == pytest.approx(0.4, abs=1e-3)
    assert up[-1] == pytest.approx(1.5 - 9.8 / 30 ** 2, abs=1e-3)


def test_who_is_lowered_does_not_fall():
    """A ball that is put down touches the ground and is no fall."""
    put_down = {'start': {'clearance': 0.3}, 'duration': 1.5, 'record': {'rate': 100},
                'grabs': [{'bone': 'ball', 'duration': 9, 'to': [0, 0, 0.05], 'takes': 1}]}
    for cause, falls in (({'cause': 'no_fall'}, False), ({}, True)):
        fall = next(generate(recipe(**put_down, **cause), [0]))
        assert fall.touching[:, 0].any() and (fall.phases.impact is not None) == falls


@pytest.mark.parametrize('walks', [False, True])
def test_soles_are_level_whatever_the_lean(walks):
    start = {'heading_deg': 40, 'lean_deg': 11, 'lean_towards_deg': 230, 'level_soles': True,
             'angles_deg': {'l_p_hip': -12, 'l_knee': 9, 'r_p_hip': -30, 'r_knee': 3}}
    if walks:
        start |= {'lean_deg': 5, 'walk': {'speed': 1, 'swing': 'right'}}
    fall = next(generate(recipe({**WALK, 'start': start}), [0]))
    feet = [Rotation.from_quat(fall.states[0, fall.scene.bone_index(f'{side}_foot'), 3:7])
            for side in ('left', 'right')]
    tilts = [math.degrees(math.acos(min(foot.apply([0, 0, 1])[2], 1))) for foot in feet]
    # To the cosine's rounding: sqrt(2 eps) rad.
    assert tilts[0] == pytest.approx(0, abs=1e-5) and (tilts[1] > 5 if walks else tilts[1] < 1e-5)


def test_level_soles_set_the_ankles_of_people():
    start = {'level_soles': True, 'angles_deg': {'l_p_ankle': 5, 'r_p_ankle': 5}}
    _, found = build_recipe({**DROP, 'start': {'level_soles': True}}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['start.level_soles']
    _, found = build_recipe({**WALK, 'start': start}, Path('recipe.yaml'))
    assert [error.path for error in found] == [
        'start.angles_deg.l_p_ankle', 'start.angles_deg.r_p_ankle']
    start['walk'] = {'speed': 1, 'swing': 'right'}
    _, found = build_recipe({**WALK, 'start': start}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['start.angles_deg.l_p_ankle']


@pytest.mark.parametrize('friction', [0.9, math.inf])
def test_friction_may_be_less_under_one_bone(friction):
    box = {'name': 'box', 'bones': [{'name': 'box', 'mass': 2.0, 'position': [0, 0, 0.05],
                                     'shape': {'box': {'size': [0.4, 0.4, 0.1]}}}]}
    fall = next(generate(recipe(who={'dolls': [box]}, start={'lean_deg': 30}, ground={
        'friction': friction, 'friction_under': {'box': 0.2}, 'slope_deg': 30}), [0]))
    slope = math.radians(30)
    speed = 9.8 * (math.sin(slope) - 0.2 * math.cos(slope)) * fall.times[-1]
    assert np.linalg.norm(fall.states[-1, 0, 7:10]) == pytest.approx(speed, rel=1e-3)


TABLE = {'name': 'table', 'shape': {'box': {'size': [0.5, 0.5, 1]}}, 'position': [0.1, 0, 0.5]}


@pytest.mark.parametrize('floor', [[], ['table']])
def test_what_begins_in_a_body_is_lifted_onto_it(floor):
    fall = next(generate(recipe(start={'heading_deg': 90}, bodies=[TABLE], floor=floor,
                                duration=0.3), [0]))
    body, = fall.scene.bodies
    np.testing.assert_allclose(body.position, (0, 0.1, 0.5), atol=1e-12)
    # To a millimetre, and at most one more inside, a contact.
    assert fall.states[0, 0, 2] == pytest.approx(1.1, abs=2e-3)
    assert fall.states[-1, 0, 2] == pytest.approx(1.1, abs=2e-3)
    assert fall.touching[-1, 0] == bool(floor)
    assert (fall.phases.impact is None) == (not floor)


def test_copies_of_a_body_are_floor_and_a_data_sets_recipe_has_them():
    steps = {'name': 'stair', 'shape': {'box': {'size': [0.3, 1, 0.2]}},
             'repeat': {'count': 3, 'shift': [0.3, 0, -0.2]}}
    made = recipe(bodies=[steps, TABLE], floor=['stair'])
    assert len(made.bodies) == 4 and sorted(made.floor) == sorted(
        body.name for body in made.bodies if body.name != 'table')
    again = recipe_of(made.data)
    assert again.bodies == made.bodies and again.floor == made.floor
    assert again.digest == made.digest


def test_wrong_kinds_are_refused_with_all_errors():
    _, found = build_recipe({
        **DROP, 'start': {'walk': {'speed': 1, 'swing': 'right'}, 'spin': [0, 1, 0]},
        'bodies': [TABLE, {**TABLE, 'name': 'loose', 'mass': 2}, {'name': 'nothing'}]},
        Path('recipe.yaml'))
    assert {error.path for error in found} == {
        'start.walk', 'start.spin', 'bodies', 'bodies[2]'}
    _, found = build_recipe({**WALK, 'start': {'walk': {'speed': 9, 'swing': 'both'}}},
                            Path('recipe.yaml'))
    assert [error.path for error in found] == ['start.walk.swing', 'start.walk.speed']
    _, found = build_recipe({
        **DROP, 'bodies': [TABLE], 'floor': ['chair'],
        'grabs': [{'bone': 'foot', 'duration': 0}],
        'ground': {'friction_under': {'ball': -1}}}, Path('recipe.yaml'))
    assert [error.path for error in found] == [
        'floor[0]', 'grabs[0].duration', 'ground.friction_under.ball']
    _, found = build_recipe({
        **DROP, 'grabs': [{'bone': {'choice': ['ball', 'foot']}}],
        'ground': {'friction_under': {'toe': 0}}}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['grabs[0].bone', 'ground.friction_under.toe']


def test_recipes_without_these_keys_have_the_falls_that_they_had():
    data = copy.deepcopy(load_recipe('shove').data)
    assert data['record']['imus'][0].pop('contact_pulse') and data['start'].pop('level_soles')
    assert recipe_of(data).digest.startswith(SHOVE_DIGEST)
    assert f'{load_recipe("tumble").philox_key:032x}' == TUMBLE_KEY


SHOVE_DIGEST, TUMBLE_KEY = 'b84e40505cb294b2', '6d36376549a94940c999ef8442e39528'
"""Before these keys were there."""


@pytest.mark.parametrize(('name', 'towards'), [('trip', 0), ('slip', 180)])
def test_walkers_fall_over_a_held_foot_and_behind_a_sliding_one(name, towards):
    made = load_recipe(name)
    for number in range(3):
        fall = simulate(made, start_of(made, number))
        assert not fall.failure and fall.phases.impact is not None
        assert abs((fall.direction - towards + 180) % 360 - 180) < 60


@pytest.mark.slow
def test_a_fifth_of_faints_and_more_go_forwards_backwards_and_to_the_sides():
    shipped = load_recipe('faint')
    # As long as it takes to the impact; the same falls.
    made = recipe_of({**shipped.data, 'duration': 1.4})
    assert made.draw(7) == shipped.draw(7)
    quarters = [round(fall.direction / 90) % 4 for fall in generate(made, range(100))]
    forwards, left, backwards, right = np.bincount(quarters, minlength=4)
    assert min(forwards, backwards, left + right) >= 20


def test_balls_have_no_feet_to_fall_from():
    fall = next(generate(recipe(who={'dolls': [BALL]}, start={
        'clearance': 0.1, 'velocity': [0, 1, 0], 'heading_deg': 40}), [0]))
    assert fall.direction == pytest.approx(90, abs=1e-6)

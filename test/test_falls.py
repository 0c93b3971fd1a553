"""What falls are drawn from, how they begin, and when they begin, hit and end."""
import math
from pathlib import Path

import numpy as np
import pytest
from falls_recipes import BALL, DROP, SHOVE, recipe

from ragdoll_ros import Bone, Ground, Joint, Placement, Ragdoll, Scene, Simulation, Sphere, State
from ragdoll_ros.falls import generate, load_recipe
from ragdoll_ros.falls.distribution import quantile
from ragdoll_ros.falls.recipe import build_recipe
from ragdoll_ros.falls.simulate import begin
from ragdoll_ros.falls.start import start_of
from ragdoll_ros.files.config import RECIPES, names_in
from ragdoll_ros.files.doll import build_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import DofLayout
from ragdoll_ros.model.errors import ModelErrors, OutOfRange
from ragdoll_ros.people.fall_phases import bone_impacts, find_phases, part_impact
from ragdoll_ros.physics.rigid_body import GroundHeights

pytest.importorskip('scipy')

STAND = {'name': 'stand', 'who': {'dolls': ['doll']}, 'duration': 0.1}
"""The default doll, upright on the ground, facing x."""


def one(number=0, **changes):
    """A fall of the doll that stands."""
    return next(generate(recipe(STAND, **changes), [number]))


def place_of(fall, bone, frame=0):
    return fall.states[frame, fall.scene.bone_index(bone), :3]


@pytest.mark.parametrize(('distribution', 'same'), [
    ({'uniform': [-2, 5]}, ('uniform', -2, 7)),
    ({'normal': [3, 2], 'within': [2, 8]}, ('truncnorm', -0.5, 2.5, 3, 2)),
    ({'normal': [0, 1], 'within': [-30, 30]}, ('norm',))])
def test_a_draw_is_the_inverse_of_the_distribution(distribution, same):
    from scipy import stats
    name, *parameters = same
    shares = np.linspace(0, 1, 101)[1:-1]
    values = [quantile(distribution, share) for share in shares]
    reference = getattr(stats, name)(*parameters)
    np.testing.assert_allclose(values, reference.ppf(shares), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize('within', [[-90, 90], [0, 360], [20, 400], [-400, -30]])
def test_a_mean_that_the_bounds_do_not_give_is_warned_of(within):
    from scipy import stats
    made = recipe(start={'lean_towards_deg': {'normal': [0, 30], 'within': within}})
    low, high = (end / 30 for end in within)
    mean = stats.truncnorm(low, high, scale=30).mean()
    told = [f'start.lean_towards_deg: the mean is {mean:.3g}, not 0: within {within} cuts it off']
    assert made.warnings == (told if within != [-90, 90] else [])


@pytest.mark.parametrize('name', names_in(RECIPES))
def test_shipped_recipes_give_the_means_that_they_name(name):
    assert load_recipe(name).warnings == []


def test_choices_are_made_by_their_weights():
    choice = {'choice': ['a', 'b', 'c'], 'weights': [1, 0, 3]}
    made = [quantile(choice, share) for share in np.arange(0, 1, 0.01)]
    assert made == ['a'] * 25 + ['c'] * 75


def test_draws_are_those_of_their_distribution_and_no_fall_is_another():
    from scipy import stats
    falls = [recipe().draw(number)['start']['clearance'] for number in range(2000)]
    assert len(set(falls)) == 2000
    # A sound generator fails this once in a thousand seeds; it is one seed, always the same.
    assert stats.kstest(falls, stats.uniform(0.1, 0.4).cdf).pvalue > 1e-3


def test_a_fall_is_of_the_recipe_and_its_number_alone():
    made = recipe()
    here = made.draw(7)
    [made.draw(number) for number in range(5)]
    assert made.draw(7) == here != made.draw(8)
    assert recipe(dict(reversed(DROP.items()))).draw(7) == here
    assert recipe(seed=1).draw(7) != here
    # The same falls, more finely and with other things recorded; yet another data set.
    finer = recipe(accuracy='exact', record={'rate': 100})
    assert finer.draw(7) == here and finer.digest != made.digest


def test_the_lowest_point_is_at_its_clearance_also_on_a_slope():
    for number in range(5):
        fall = one(number, start={'clearance': {'uniform': [0.1, 2]}, 'tumbled': True,
                                  'other_angles': {'uniform': [0.3, 0.7]}},
                   ground={'slope_deg': {'uniform': [0, 40]}, 'downhill_deg': 70})
        heights = GroundHeights(fall.scene)(State.of(fall.states[0]))
        # Positions of some m in float64, through two ways to the lowest point.
        assert heights.min() == pytest.approx(fall.drawn['start']['clearance'], abs=1e-12)


@pytest.mark.parametrize(('towards', 'axis', 'sign'), [
    (0, 0, 1), (90, 1, 1), (180, 0, -1), (270, 1, -1)])
def test_a_lean_is_towards_where_it_says(towards, axis, sign):
    fall = one(start={'lean_deg': 20, 'lean_towards_deg': towards})
    reach = place_of(fall, 'head') - place_of(fall, 'left_shin') / 2 - place_of(
        fall, 'right_shin') / 2
    # The head is 0.95 m above the shins in the doll's file.
    assert reach[axis] == pytest.approx(sign * 0.95 * math.sin(math.radians(20)), abs=1e-9)
    assert reach[2] == pytest.approx(0.95 * math.cos(math.radians(20)), abs=1e-9)


def test_heading_turns_the_doll_its_lean_its_velocity_and_its_pushes():
    start = {'heading_deg': 90, 'lean_deg': 20, 'velocity': [1, 0, 0]}
    push = {'bone': 'torso', 'force': 1000, 'duration': 0.1}
    fall = one(start=start, pushes=[push])
    left = place_of(fall, 'left_forearm') - place_of(fall, 'right_forearm')
    assert left[0] < -0.9 and abs(left[1]) < 1e-9
    assert place_of(fall, 'head')[1] > place_of(fall, 'torso')[1]
    np.testing.assert_allclose(fall.states[0, :, 7:10], [[0, 1, 0]] * 10, atol=1e-12)
    pushed, = start_of(recipe(STAND, start=start, pushes=[push]), 0).pushes
    np.testing.assert_allclose(pushed.force, (0, 1000, 0), atol=1e-9)


def test_directions_of_a_push():
    def force(**push):
        made = recipe(STAND, pushes=[{'bone': 'torso', 'force': 100, **push}])
        return start_of(made, 0).pushes[0].force
    np.testing.assert_allclose(force(towards_deg=90), (0, 100, 0), atol=1e-12)
    np.testing.assert_allclose(force(upwards_deg=90), (0, 0, 100), atol=1e-12)


def test_what_lies_on_a_slope_without_friction_goes_downhill():
    fall = next(generate(recipe(
        start={}, ground={'friction': 0, 'slope_deg': 30, 'downhill_deg': 90}), [0]))
    velocity = fall.states[-1, 0, 7:10]
    # g sin(a) along the slope; a ball without friction does not roll.
    along = 9.8 * math.sin(math.radians(30)) * fall.times[-1]
    expected = along * np.array([0, math.cos(math.radians(30)), -math.sin(math.radians(30))])
    np.testing.assert_allclose(velocity, expected, atol=1e-6)


def test_angles_are_set_where_the_recipe_says():
    fall = one(start={'angles_deg': {'left_shin': 30}, 'other_angles': 0.5})
    angles = dict(zip(fall.scene.angle_names, np.degrees(fall.angles[0]), strict=True))
    assert angles['left_shin'] == pytest.approx(30, abs=1e-9)
    # The middle of its limits, 0 and 126 degrees.
    assert angles['right_shin'] == pytest.approx(63, abs=1e-9)


def test_free_balls_take_their_angles():
    bones = tuple(Bone(name, Sphere(0.1), 1.0, (0, 0, z)) for name, z in (('a', 0), ('b', 1)))
    doll = Ragdoll('pair', bones, (Joint('a', 'b', 'ball', (0, 0, 0.5), ((0, 0, 1),)),))
    layout = DofLayout([doll])
    q = layout.with_joint_angles(np.array([0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1.0]),
                                 np.array([0.3, -0.4, 1.2]))
    np.testing.assert_allclose(layout.joint_angles(q), [0.3, -0.4, 1.2], atol=1e-12)
    turns = rotation.from_euler_xyz(0.3, -0.4, 1.2)
    np.testing.assert_allclose(rotation.to_euler_xyz(turns), [0.3, -0.4, 1.2], atol=1e-12)


def test_tumbled_dolls_are_turned_evenly():
    from scipy import stats
    quaternions = np.array([start_of(recipe(start={'tumbled': True}), number).scene.dolls[
        0].orientation for number in range(1000)])
    up = rotation.rotate(quaternions, np.array([0, 0, 1.0]))
    # Archimedes: of directions without preference each coordinate is even from -1 to 1.
    for axis in range(3):
        assert stats.kstest(up[:, axis], stats.uniform(-1, 2).cdf).pvalue > 1e-3


@pytest.mark.parametrize('restitution', [0.0, 0.8])
def test_a_dropped_ball_hits_when_and_as_fast_as_it_must(restitution):
    """Also where it has left the ground again before the next frame."""
    for number in range(20):
        fall = next(generate(recipe(ground={'restitution': restitution}), [number]))
        height, rate = fall.drawn['start']['clearance'], 50
        hits = math.sqrt(2 * height / 9.8)
        assert fall.phases.impact == math.ceil(hits * rate)
        # The frame before the touch.
        speed = 9.8 * (fall.phases.impact - 1) / rate
        np.testing.assert_allclose(fall.impact_velocities, [[0, 0, -speed]], atol=1e-9)
        # 0.1 m/s is passed after 0.0102 s: one frame of 0.02 s.
        assert fall.phases.onset == 1
        assert not fall.failure and fall.valid == 30 and fall.energy_excess < 1e-9


def two_balls():
    ball, _ = build_doll(BALL)
    return Scene('balls', (Placement(ball, 'foot'), Placement(ball, 'head')), Ground())


def test_phases_are_as_defined():
    scene = two_balls()
    # Gives a little at frame 1, sinks from 3 on, hits with its head at 6, rests from 8 on.
    sinking = np.array([0, 0.2, 0.05, 0.2, 0.3, 0.5, 1, 0.2, 0.01, 0])
    states = np.zeros((10, 2, 13))
    states[:, :, 9] = -sinking[:, None]
    touching = np.zeros((10, 2), bool)
    touching[:, 0], touching[6:, 1] = True, True
    phases = find_phases(scene, states, touching, ['foot/ball'], 2, 0.1, 0.05)
    assert (phases.onset, phases.impact, phases.rest) == (3, 6, 8)
    # What sinks for less time than asked only falls where the impact cuts it short.
    slow = find_phases(scene, states, touching, ['foot/ball'], 9, 0.1, 0.05)
    assert slow.onset == 3
    assert find_phases(scene, states[:8], touching[:8], ['foot/ball'], 2, 0.1, 0.05).rest is None
    never = find_phases(scene, states, touching, ['foot/ball', 'head/ball'], 2, 0.1, 0.05)
    assert (never.onset, never.impact, never.rest) == (None, None, None)


def test_descent_and_impact_speeds_of_a_fall_made_by_hand():
    """Onset at frame 3, first contact of a knee at 6, of a hand at 8, of the pelvis at 11."""
    names = ['foot', 'knee', 'pelvis', 'left_hand', 'right_hand', 'head']
    ball, _ = build_doll(BALL)
    scene = Scene('bones', tuple(Placement(ball, name) for name in names), Ground())
    states, touching = np.zeros((14, 6, 13)), np.zeros((14, 6), bool)
    down = np.array([0, 0.2, 0.05, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4, 1.6, 0.1, 0, 0])
    states[:, :, 9] = -down[:, None] * [1, 1, 1, 2, 3, 1]
    # The pelvis touches again after a bounce; the right hand touches later than the left one.
    for bone, frames in enumerate([range(14), (6, 7), (11, 13), (8, 9), (9, 10), ()]):
        touching[list(frames), bone] = True
    bones = [f'{name}/ball' for name in names]
    phases = find_phases(scene, states, touching, bones[:1], 2)
    frames, velocities = bone_impacts(states, touching)
    assert (phases.onset, phases.impact) == (3, 6)
    np.testing.assert_array_equal(frames, [math.nan, 6, 11, 8, 9, math.nan])
    pelvis, hand, head = (part_impact(part, names, frames, -velocities[:, 2])
                          for part in ('pelvis', 'hand', 'head'))
    # Speeds are those of the frame before: 1.6 at 10, twice 1.0 at 7.
    assert pelvis == (11, 1.6) and hand == (8, 2.0) and np.isnan(head).all()
    assert pelvis[0] - phases.onset == 8


def test_a_fall_that_sleeps_is_as_if_it_had_been_watched():
    """Frames after a doll has come to rest are those of a simulation that goes on."""
    made = recipe(SHOVE)
    fall = next(generate(made, [5]))
    start = start_of(made, 5)
    with Simulation(start.scene, accuracy='draft', engine='rigid') as simulation:
        begin(simulation, start)
        states = [simulation.state.rows] + [simulation.advance().rows for _ in range(299)]
        assert simulation.asleep
        np.testing.assert_array_equal(fall.states, states)
        np.testing.assert_array_equal(fall.angles[-1], simulation.joint_angles)
        np.testing.assert_array_equal(fall.rates[-1], simulation.joint_rates)


def test_what_cannot_begin_is_kept_with_its_reason(monkeypatch):
    made = recipe()
    monkeypatch.setitem(made.data['start'], 'velocity', [1e12, 0, 0])
    fall = next(generate(made, [0]))
    assert fall.failure and fall.valid < 30
    assert np.isnan(fall.states[fall.valid:]).all() and fall.phases.rest is None
    assert np.isnan(fall.impact_velocities).all() and np.isnan(fall.impact_frames).all()


def test_five_errors_are_all_named():
    data = {'who': {'dolls': ['nobody']}, 'duration': -3, 'accuracy': 'perfect',
            'ground': {'friction': {'uniform': [1, -1]}}, 'start': {'lean_deg': {'normal': [1, 2]}}}
    _, found = build_recipe(data, Path('recipe.yaml'))
    assert [error.path for error in sorted(found, key=lambda error: error.path)] == [
        'accuracy', 'duration', 'ground.friction.uniform', 'start.lean_deg.within',
        'who.dolls[0]']


@pytest.mark.parametrize(('changes', 'path'), [
    ({'feet': ['left_foot']}, 'feet[0]'),
    ({'pushes': [{'bone': {'choice': ['torso', 'tail']}, 'force': 1}]}, 'pushes[0].bone'),
    ({'pushes': [{'bone': 'torso', 'force': {'uniform': [0, 1e7]}}]}, 'pushes[0].force'),
    ({'start': {'angles_deg': {'left_shin': 130}}}, 'start.angles_deg.left_shin'),
    ({'start': {'angles_deg': {'tail': 1}}}, 'start.angles_deg.tail'),
    ({'start': {'velocity': [0, 0, {'uniform': [0, 1e9]}]}}, 'start.velocity[2]'),
    ({'ground': {'friction': {'uniform': [0, 1], 'choice': [1]}}}, 'ground.friction'),
    ({'ground': {'friction': {'choice': [1, 2], 'weights': [1]}}}, 'ground.friction.weights'),
    ({'ground': {'friction': {'normal': [0, 1], 'within': [50, 51]}}}, 'ground.friction.within'),
    ({'ground': {'friction': float('nan')}}, 'ground.friction'),
    ({'record': {'rate': 1}}, 'record.rate'),
    ({'record': {'imu_rate': 250}}, 'record.imu_rate'),
    *[({'record': {'imus': [{'name': 'a', 'bone': 'torso', key: value}]}}, f'record.imus[0].{path}')
      for key, value, path in (('noise_rate', -1, 'noise_rate'), ('range', [-1, 0], 'range'),
                               ('noise_acceleration', float('nan'), 'noise_acceleration'),
                               ('mount_frequency', -1, 'mount_frequency'))],
    ({'seed': -1}, 'seed')])
def test_what_cannot_be_drawn_is_refused(changes, path):
    _, found = build_recipe({**STAND, **changes}, Path('recipe.yaml'))
    assert [error.path for error in found] == [path]


def test_dolls_of_other_bones_do_not_share_a_recipe():
    _, found = build_recipe({**DROP, 'who': {'dolls': ['doll', BALL]}}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['who.dolls[1]']


PEOPLE = [{'sex': 'female', 'height': {'uniform': [1.5, 1.8]}, 'bmi': {'uniform': [18, 35]}},
          {'sex': 'male', 'height': 1.9, 'bmi': 25}]


def test_people_are_drawn_from_their_groups():
    made = recipe(who={'people': PEOPLE}, duration=0.1)
    starts = [start_of(made, number) for number in range(60)]
    sexes = [start.drawn['who']['sex'] for start in starts]
    # Of a fair coin 60 times: 30 +- 3.9; five deviations.
    assert 10 < sexes.count('male') < 50
    for start in starts:
        who, doll = start.drawn['who'], start.scene.dolls[0].doll
        assert doll.mass == pytest.approx(who['bmi'] * who['height'] ** 2, rel=1e-12)
        assert who['height'] == 1.9 if who['sex'] == 'male' else 1.5 <= who['height'] <= 1.8
    assert len({start.drawn['who']['height'] for start in starts}) == 1 + sexes.count('female')
    fall = next(generate(made, [3]))
    tallest = fall.states[0, fall.scene.bone_index('head'), 2]
    assert 0.85 < tallest / (fall.drawn['who']['height'] + fall.drawn['start']['clearance']) < 1


HELD = {'who': {'people': [{'sex': 'male', 'height': 1.75, 'bmi': 25}]}, 'duration': 1.0,
        'start': {'angles_deg': {'l_knee': 5, 'r_knee': 5}}}


def test_who_is_held_stands_until_the_knees_give():
    stands = next(generate(recipe(HELD, limp=[{'at': 600}]), [0]))
    falls = next(generate(recipe(HELD, limp=[{'at': 0.5, 'angles': ['l_knee', 'r_knee']}]), [0]))
    knee = stands.scene.angle_names.index('l_knee')
    # The springs give by some degrees; without them the pelvis would be on the floor in 1 s.
    assert np.degrees(np.abs(stands.angles[:, knee]).max()) < 10
    assert stands.states[-1, 0, 2] > 0.95 * stands.states[0, 0, 2]
    np.testing.assert_array_equal(falls.states[:51], stands.states[:51])
    assert np.degrees(falls.angles[-1, knee]) > 20


def test_only_people_can_be_held():
    _, found = build_recipe({**STAND, 'limp': [{'at': 1}]}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['limp']
    _, found = build_recipe({**HELD, 'limp': [{'at': 1, 'angles': ['tail']}]}, Path('recipe.yaml'))
    assert [error.path for error in found] == ['limp[0].angles[0]']


@pytest.mark.parametrize(('who', 'path'), [
    ({'people': [{**PEOPLE[0], 'height': {'uniform': [0.5, 1.8]}}]}, 'who.people[0].height'),
    ({'people': [PEOPLE[0], {**PEOPLE[1], 'bmi': 60}]}, 'who.people[1]'),
    ({'people': [{**PEOPLE[1], 'sex': 'none'}]}, 'who.people[0].sex'),
    ({'people': PEOPLE, 'dolls': ['doll']}, 'who')])
def test_people_that_cannot_be_are_refused(who, path):
    _, found = build_recipe({**DROP, 'who': who}, Path('recipe.yaml'))
    assert [error.path for error in found] == [path]


def test_a_recipe_that_is_none_is_refused(tmp_path):
    with pytest.raises(ModelErrors):
        load_recipe('drop')
    with pytest.raises(ModelErrors, match=r'a file, or one of .*faint, .*shove, .*tumble'):
        load_recipe('faints')
    with pytest.raises(OutOfRange):
        recipe().draw(-1)


@pytest.mark.parametrize('name', names_in(RECIPES))
def test_shipped_recipes_make_falls(name):
    made = load_recipe(name)
    fall = next(generate(made, [0]))
    assert not fall.failure and (fall.phases.impact is not None) == made.falls
    assert not made.falls or fall.phases.onset <= fall.phases.impact

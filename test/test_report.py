"""The report's own arithmetic, its page and its command line."""
import dataclasses
import functools
import json
import math
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

pytest.importorskip('scipy')
pytest.importorskip('mujoco')

from ragdoll_ros.accuracy import methods
from ragdoll_ros.accuracy.cases import starts
from ragdoll_ros.accuracy.cases.hard_cases import hard_cases
from ragdoll_ros.accuracy.cases.trial import Trial
from ragdoll_ros.accuracy.methods import bullet, by_name, median_run, ours, quickstart, run
from ragdoll_ros.accuracy.metrics import Metrics
from ragdoll_ros.accuracy.motions.flight import free_fall, gentle_flight, tumbling_box
from ragdoll_ros.accuracy.motions.mechanisms import OMEGA, swing
from ragdoll_ros.accuracy.parts import orders, start_classes, work_precision
from ragdoll_ros.accuracy.parts.hard import violations
from ragdoll_ros.accuracy.references.articulated import Articulated, torque_free_rotation
from ragdoll_ros.accuracy.report import command, hard, many_starts, plots
from ragdoll_ros.accuracy.report.sections import markdown
from ragdoll_ros.accuracy.results import criteria, figures
from ragdoll_ros.accuracy.results import markdown as tables
from ragdoll_ros.accuracy.results.runner import Job, attempt
from ragdoll_ros.accuracy.trajectory import Trajectory
from ragdoll_ros.model import rotation
from ragdoll_ros.physics.simulation import Simulation


def test_the_slope_of_a_power_is_its_order():
    ticks = (.02, .01, .005, .0025)
    found = orders.slope(ticks, [3 * tick ** 4 for tick in ticks], floor=1e-30)
    assert found['order'] == pytest.approx(4)
    assert found['order_finest'] == pytest.approx(4)


def test_errors_at_the_floor_and_large_ones_do_not_count():
    """From 7 (not small) and 1e-12 (rounding) only three points of order 2 are left."""
    ticks = (.08, .04, .02, .01, .005)
    errors = [7.0, .16e-2, .04e-2, .01e-2, 1e-12]
    found = orders.slope(ticks, errors, floor=1e-11)
    assert found['points'] == 3
    assert found['order'] == pytest.approx(2)
    assert orders.slope(ticks, [math.inf] * 5, 1e-11)['order'] is None


def test_free_fall_by_fixed_steps_is_off_by_what_semi_implicit_euler_says():
    """x_n = g h^2 n (n + 1) / 2, so after 1 s in steps of 2.5 ms it is g h / 2 too low."""
    motion = free_fall()
    result = run(bullet(4), motion.trial)
    truth = motion.truth(result.trajectory.times)
    low = truth.positions[-1, 0, 2] - result.trajectory.positions[-1, 0, 2]
    assert low == pytest.approx(9.8 * .0025 / 2, rel=1e-9)


def test_the_quickstart_brakes():
    """PyBullet's own damping of 0.04 takes a falling body's speed, as its manual says."""
    motion = free_fall()
    result = run(quickstart(), motion.trial)
    assert len(result.trajectory.times) == 241
    assert np.abs(result.trajectory.linear_velocities[-1, 0, 2]) < .95 * 9.8


@pytest.mark.parametrize('name', ['projectile', 'tumbling_box', 'thin_disc', 'three_balls',
                                  'chain_2', 'rolling_ball'])
@pytest.mark.parametrize('method', ['quickstart', 'bullet-1', 'mujoco-euler-1', 'ours-normal'])
def test_every_method_begins_where_the_trial_does(method, name):
    trial = work_precision.motions()[name].trial
    found = run(by_name(method), dataclasses.replace(trial, duration=trial.scene.step)).trajectory
    with Simulation(trial.scene) as simulation:
        state = simulation.place(trial.start) if trial.start is not None else simulation.state
    # MuJoCo's quaternions are normalized, which rounds.
    for key in ('positions', 'linear_velocities', 'angular_velocities'):
        np.testing.assert_allclose(getattr(found, key)[0], getattr(state, key), atol=1e-9)


def test_a_pendulum_hangs_still_at_its_root():
    """The stand-in for a fixed root: the pivot stays within 1e-10 m in 2 s.

    At 1 rad a swing takes 1.066 times as long as a small one.
    """
    motion = swing('pendulum', '', 1.0)
    moved = run(bullet(8), motion.trial).trajectory
    assert np.abs(moved.positions[:, 0]).max() < 1e-10
    quarter = round(np.pi / 2 / OMEGA / .01 * 1.066)
    assert abs(moved.positions[quarter, 1, 0]) < .05


@pytest.mark.parametrize('tick', [0.05, 0.2])
def test_finer_settings_are_finer_in_long_ticks_too(tick):
    """The steps of a flight that a tick may take go with its length."""
    motion = tumbling_box()
    scene = motion.trial.scene
    fast = dataclasses.replace(scene.dolls[0], spin=(6.0, 8.0, 11.0))
    trial = Trial(dataclasses.replace(scene, dolls=(fast,), step=tick), 1.0)
    orientations, _ = torque_free_rotation(scene.bones[0].inertia, fast.spin, trial.times())
    draft, normal, exact = (rotation.angle_between(
        run(ours(accuracy), trial).trajectory.orientations[:, 0], orientations).max()
        for accuracy in ('draft', 'normal', 'exact'))
    assert exact < normal / 4 < draft / 16
    assert exact < 1e-5


def test_the_quickstart_owes_nothing_to_what_ran_before():
    """PyBullet keeps its contact margin for a whole process, whichever client sets it."""
    code = ('from ragdoll_ros.accuracy.methods import quickstart, run\n'
            'from ragdoll_ros.accuracy.cases.starts import trial\n'
            'print(run(quickstart(), trial("drop .4 m", 0)).trajectory.positions.tobytes().hex())')
    airborne_scene = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                           cwd=ROOT, check=True).stdout.split()[-1]
    trial = starts.trial('drop .4 m', 0)
    run(ours('normal'), trial)
    assert run(quickstart(), trial).trajectory.positions.tobytes().hex() == airborne_scene


def test_costs_are_medians_over_runs(monkeypatch):
    """Three runs whose ticks take 5, 1 and 3 ms by a clock of our own; 100 ticks make 1 s."""
    readings = iter([time for run in (5e-3, 1e-3, 3e-3) for time in [0.0, run, run + 1e-3] * 100])
    monkeypatch.setattr(methods, 'process_time', lambda: next(readings))
    result = median_run(bullet(1), free_fall().trial, 3)
    assert result.costs.tolist() == [3e-3] * 100
    assert result.reading == pytest.approx(np.full(100, 1e-3))
    assert result.cpu_s_per_s == pytest.approx(.3)


TUMBLING = tumbling_box()


@functools.cache
def tumbling_truth():
    """Integrated once for all settings."""
    return TUMBLING.truth(TUMBLING.trial.times())


@pytest.mark.parametrize(('accuracy', 'bound'), [('draft', 1e-2), ('normal', 1e-4),
                                                 ('exact', 1e-5)])
def test_a_plate_tumbles_as_euler_says(accuracy, bound):
    """About its unstable axis, where errors grow some thousandfold in 5 s; alone and as a pair.

    Its angular momentum stays what it is at the start, I w along the world's axes.
    """
    trial, truth = TUMBLING.trial, tumbling_truth()
    inertia = np.array(trial.scene.bones[0].inertia)
    other = dataclasses.replace(trial.scene.dolls[0], name='other', position=(9.0, 0.0, 0.0))
    both = dataclasses.replace(trial, scene=dataclasses.replace(
        trial.scene, dolls=(*trial.scene.dolls, other)))
    for moved in (run(ours(accuracy), trial).trajectory, run(ours(accuracy), both).trajectory):
        orientations, omegas = moved.orientations[:, 0], moved.angular_velocities[:, 0]
        errors = rotation.angle_between(orientations, truth.orientations[:, 0])
        assert errors.max() < bound
        momenta = rotation.rotate(orientations, inertia * rotation.rotate(
            rotation.inverse(orientations), omegas))
        first = inertia * trial.scene.dolls[0].spin
        assert np.abs(momenta - first).max() < 1e-9 * np.linalg.norm(first)


def test_the_gentle_flight_touches_no_limit():
    """The reference knows no limits, so it must not need them."""
    motion = gentle_flight()
    truth = motion.truth(motion.trial.times())
    assert Metrics(motion.trial.scene).overshoot(truth) == 0


@pytest.mark.parametrize('name', list(starts.CLASSES))
def test_starts_are_what_their_class_says(name):
    """The same twice; let go with the lowest point at the height that the class names."""
    first, again = starts.trial(name, 3), starts.trial(name, 3)
    if first.start is None:
        assert again.pushes == first.pushes
        assert np.hypot(*first.pushes[0].force[:2]) == pytest.approx(2000)
        return
    assert (again.start.q == first.start.q).all()
    scene = first.scene
    tree = Articulated(scene.dolls[0].doll)
    moved = Trajectory.of([0], [tree.state(first.start.q, first.start.v)])
    lowest = min(starts.height(bone, *pose, scene.ground) for bone, pose in zip(
        scene.bones, zip(moved.positions[0], moved.orientations[0], strict=True), strict=True))
    height = {'limit slam': .4, 'start outside': .4}.get(
        name, 2.0 if 'spin' in name else float(name.split()[1]) if 'drop' in name else None)
    assert lowest == pytest.approx(height, abs=1e-9)
    outside = Metrics(scene).overshoot(moved)
    assert (outside > math.radians(5)) if name == 'start outside' else outside == 0
    if 'spin' in name:
        assert np.linalg.norm(first.start.v[3:6]) == pytest.approx(float(name.split()[1]))


def row(**changes):
    base = {'number': 0, 'excess': 0.0, 'overshoot_rad': .1, 'sinking_m': 0.0, 'depth_m': 0.0,
            'gap_m': 0.0, 'restless': False, 'speed_m_s': 1.0, 'settled_s': 1.0, 'cpu_s': .5,
            'simulated_s': 2.0}
    return {**base, **changes}


def test_many_starts_become_one_row_with_the_worst_of_each():
    one = start_classes.gathered('drop', 'ours', [row(), row(number=1, excess=2e-3)])
    two = start_classes.gathered('drop', 'ours', [
        row(number=2, excess=math.inf, settled_s=math.inf)])
    merged, = start_classes.merged([one, two])
    assert (merged['starts'], merged['bad'], merged['worst_start']) == (3, 2, 2)
    assert merged['worst_excess'] == math.inf
    assert merged['settled'] == 2
    assert merged['cpu_s'] == pytest.approx(1.5)


def test_a_criterion_that_is_not_met_is_shown_as_such():
    rows = [{**start_classes.gathered('spin', f'ours-{name}', [row(excess=excess)])}
            for name, excess in (('draft', 1e-6), ('normal', 2e-5))]
    met = {entry['criterion']: entry['met'] for entry in criteria.criteria({'classes': rows})}
    assert met['energy excess in every start, draft'] is True
    assert met['energy excess in every start, normal'] is False


def test_a_method_beaten_in_speed_and_error_is_not_on_the_front():
    def point(method, family, cpu, error):
        return {'motion': 'm', 'method': method, 'label': method, 'family': family,
                'cpu_s_per_s': cpu, 'yardstick': 'position_worst_m', 'position_worst_m': error}
    rows = [point('ours-draft', 'ours', 1.0, 1e-3), point('ours-exact', 'ours', 2.0, 1e-6),
            point('other', 'PyBullet', .5, 1e-4)]
    met = {entry['criterion'].split()[-1]: entry['met']
           for entry in criteria.criteria({'precision': rows}) if 'front' in entry['criterion']}
    assert met == {'ours-draft': False, 'ours-exact': True}


def test_json_has_neither_nan_nor_infinity_and_a_line_for_each_row(tmp_path):
    rows = [{'a': [math.nan, math.inf, 1 / 3, True]}, {'b': 'e²'}]
    figures.save({'about': {'quick': True}, 'figures': {'one': rows, 'two': [{}]}}, tmp_path)
    text = (tmp_path / figures.FILE).read_text(encoding='utf-8')
    assert json.loads(text, parse_constant=pytest.fail) == figures.load(tmp_path) == {
        'about': {'quick': True},
        'figures': {'one': [{'a': [None, 'inf', .333333, True]}, {'b': 'e²'}], 'two': [{}]}}
    assert sum(line.startswith('{') and line.rstrip(',').endswith('}')
               for line in text.splitlines()[2:-1]) == 3


@pytest.mark.parametrize('folder', ['docs', 'docs/starts'])
def test_the_published_page_is_what_the_published_figures_give(folder):
    """Also after a key or a column has been renamed: figures of older versions stay readable."""
    docs = ROOT / folder
    pictures = {path.stem.removeprefix('accuracy_'): path.name
                for path in docs.glob('accuracy_*.png')}
    assert markdown(figures.load(docs), pictures) == (docs / 'accuracy.md').read_text('utf-8')


def test_tables_write_what_exploded_and_what_failed():
    text = tables.table([{'a': 'inf', 'b': True}, {'failed': 'x', 'job': 'j', 'at': 'f:1'}],
                        (('a', 'A', '{:.1f}'), ('b', 'B', '{}'), ('c', 'C', '{}')))
    assert '| ∞ | yes |  |' in text
    assert '**failed**: x (f:1)' in text


def test_a_job_that_fails_says_where():
    found, = attempt(Job('part', 'label', lambda: 1 / 0))
    assert 'ZeroDivisionError' in found['failed']
    assert found['at'].startswith('test_report.py')


def test_a_failed_job_is_told_beside_the_rows_of_the_others():
    """In a section that makes tables out of its rows as in one that shows them as they are."""
    failed = {'failed': 'E: x', 'job': 'j', 'at': 'f.py:1'}
    case = {'case': 'fall', 'method': 'ours-normal', 'passed': False, 'faults': ['gap']}
    page = markdown({'about': figures.about('', 1.0, True, 2), 'figures': {
        'hard': [case, failed], 'costs': [failed, {'scene': 'empty', 'tick_s': 1e-6}]}}, {})
    assert page.count('| j | **failed**: E: x (f.py:1) |') == 2
    assert '| fall | **no** | gap |' in page and '- **fall** fails: cause unknown' in page
    assert '| empty | 1 |' in page


@pytest.mark.slow
def test_page_and_pictures_come_from_the_json_alone(tmp_path):
    pytest.importorskip('matplotlib')
    from ragdoll_ros.accuracy.parts import energy, work_precision
    rows = work_precision.measure_all('free_fall', ['ours-normal', 'bullet-1', 'mujoco-rk4-1'], 1)
    about = figures.about('ragdoll_report', 1.0, True, 2)
    figures.save({'about': about, 'figures': {
        'precision': rows, 'energy': energy.energies('drop')}}, tmp_path)
    assert command.main(['--from-json', '--out', str(tmp_path)]) == 0
    page = (tmp_path / 'accuracy.md').read_text()
    assert '| free fall and throw, normal |' in page and '### Free fall' in page
    assert f'{9.8 * .01 / 2:.1e}' in page  # by which PyBullet in ticks of 10 ms falls too far
    for picture in ('accuracy_precision.png', 'accuracy_drop.png'):
        assert picture in page
        assert (tmp_path / picture).stat().st_size > 5000


NEW = [{'failed': 'E: y', 'at': 'f.py:2', 'job': 'new'}]


def test_a_part_is_replaced_and_the_others_stay(tmp_path, monkeypatch):
    """The page names both runs; what is no whole part is refused before anything runs."""
    about = figures.about('ragdoll_report', 1.0, False, 100)
    costs = [{'scene': 'empty', 'method': 'ours-normal', 'tick_s': 1e-6}]
    figures.save({'about': about, 'figures': {
        'hard': [{'failed': 'E: x', 'at': 'f.py:1', 'job': 'old'}], 'costs': costs}}, tmp_path)
    monkeypatch.setattr(command, 'run_jobs', lambda jobs: {'hard': NEW})
    assert command.main(['--case', 'hard', '--update', '--out', str(tmp_path)]) == 0
    data = figures.load(tmp_path)
    assert data['figures'] == {'hard': NEW, 'costs': costs}
    assert data['about']['command'] == 'ragdoll_report'
    assert data['about']['updated']['hard']['command'] == 'ragdoll_report --case hard'
    assert 'Measured again by `ragdoll_report --case hard` on ' in (
        tmp_path / 'accuracy.md').read_text()


def test_an_empty_run_still_has_a_head():
    about = figures.about('ragdoll_report', 1.0, False, 100)
    assert markdown({'about': about, 'figures': {}}, {}).startswith('# Speed against error')
    assert plots.draw_all({}, None) == {}


@pytest.mark.parametrize(('arguments', 'text'), [
    (['--case', 'nonsense'], 'precision'), (['--starts', '0'], '1 or more'),
    (['--out', '/proc/nowhere'], '/proc/nowhere'), (['--from-json', '--out', '/tmp'], 'no /tmp'),
    (['--case', 'hard', '--update', '--out', '/tmp'], 'no /tmp'),
    (['--case', 'free_fall', '--update', '--out', 'docs'], 'free_fall: expected whole parts')])
def test_a_wrong_call_is_told_and_ends_with_2(arguments, text, capsys):
    assert command.main(arguments) == 2
    assert text in capsys.readouterr().err


def test_help_has_an_example(capsys):
    for main in (command.main, hard.main, many_starts.main):
        with pytest.raises(SystemExit) as left:
            main(['--help'])
        assert left.value.code == 0
        assert 'example' in capsys.readouterr().out


def test_an_unknown_hard_case_or_method_is_named(capsys):
    assert hard.main(['--case', 'nonsense']) == 2
    assert 'limits of 2°' in capsys.readouterr().err
    with pytest.raises(ValueError, match='leapfrog'):
        by_name('leapfrog')


def test_a_hard_case_is_checked_against_its_requirements():
    """A limit passed by 7 degrees, at rest, whole: one error."""
    case = hard_cases()[0]
    good = {'excess': 0.0, 'gap_m': 0.0, 'overshoot_rad': 0.0, 'sinking_m': 0.0,
            'end_sinking_m': 0.0, 'depth_m': 0.0, 'momentum': 1.0, 'moved_m': 9.0, 'stops': 0.0,
            'slowest_s': 0.0, 'fastest_m_s': 5.0, 'end_m_s': 0.0}
    assert violations(case, good) == []
    assert violations(case, {**good, 'overshoot_rad': math.radians(7)}) == ['overshoot']
    assert 'energy from nothing' in violations(case, {**good, 'excess': math.nan})
    assert violations(case, {**good, 'stops': 1.0, 'depth_m': 2e-3}) == ['stopped', 'bone in bone']
    cases = {case.name: case for case in hard_cases()}
    collision, stack = cases['two dolls at 6 m/s in the air'], cases['stack of five boxes']
    assert violations(collision, {**good, 'momentum': 2e-9}) == ['momentum']
    assert violations(stack, {**good, 'moved_m': 2e-3}) == ['does not stay']


@pytest.mark.parametrize(('name', 'number'), [
    ('push .1 to 3 s', 62), ('start outside', 84), ('start outside', 34)])
def test_starts_that_once_sank_do_not(name, number):
    """A shin dragged at 38 m/s that friction drove 36 mm into the ground, and jammed legs."""
    trial = starts.trial(name, number)
    moved = run(ours('normal'), trial).trajectory
    assert Metrics(trial.scene).penetration(moved) < 0.005


@pytest.mark.slow
def test_the_quick_report_runs(tmp_path):
    """Nothing in it fails; figures for every part are there."""
    assert command.main(['--quick', '--out', str(tmp_path)]) == 0
    data = json.loads((tmp_path / 'accuracy.json').read_text())
    failed = [entry for rows in data['figures'].values() for entry in rows if 'failed' in entry]
    assert not failed
    assert data['about']['seconds'] < 90


def test_ours_is_the_simulation_of_the_node():
    """The method's states are those of a Simulation driven by hand."""
    from ragdoll_ros.physics.simulation import Simulation
    trial = gentle_flight().trial
    moved = run(ours('normal'), trial).trajectory
    with Simulation(trial.scene) as simulation:
        simulation.place(trial.start)
        for _ in range(len(moved.times) - 1):
            state = simulation.advance()
    assert (state.positions == moved.positions[-1]).all()

"""The report's arithmetic of contacts: clouds of drops, apexes, steps, promises."""
import dataclasses
import math

import numpy as np
import pytest

pytest.importorskip('scipy')
pytest.importorskip('mujoco')

from ragdoll_ros.accuracy.cases import comparison
from ragdoll_ros.accuracy.cases.contact_cases import two_dolls
from ragdoll_ros.accuracy.cases.fuzzed import fuzzed
from ragdoll_ros.accuracy.methods import bullet, by_name, core, reference, run
from ragdoll_ros.accuracy.metrics import Metrics
from ragdoll_ros.accuracy.parts import (
    convergence,
    drop_statistics,
    error_estimate,
    restitution,
    short_segments,
)
from ragdoll_ros.accuracy.references.closed_forms import bounce_times
from ragdoll_ros.accuracy.report.contact_plots import STYLES, draw_convergence, draw_drops
from ragdoll_ros.accuracy.report.contact_sections import CONVERGENCE, DROPS, RESTITUTION, SEGMENTS
from ragdoll_ros.accuracy.results import criteria
from ragdoll_ros.accuracy.trajectory import Trajectory
from ragdoll_ros.model.ragdoll import JOINT_KINDS
from ragdoll_ros.model.shapes import SHAPES


def cloud(method, values, population='random'):
    """A chunk of drops whose every quantity takes these values."""
    return {'population': population, 'method': method, 'label': method, 'drops': len(values),
            'values': {key: list(values) for key in drop_statistics.QUANTITIES}}


def test_clouds_are_told_apart_by_their_distribution_not_their_order():
    """The same numbers in other chunks: p = 1; moved by three standard deviations: p near 0."""
    draws = np.random.default_rng(1).normal(size=60)
    rows = drop_statistics.merged([cloud('truth', draws[:40]), cloud('same', draws[30:]),
                         cloud('truth', draws[40:]), cloud('same', draws[:30]),
                         cloud('other', draws + 3)])
    truth, same, other = rows
    assert (truth['drops'], same['drops'], other['drops']) == (60, 60, 60)
    assert same['slide_m_p'] == pytest.approx(1)
    assert same['slide_m_off'] < 1e-12
    assert other['slide_m_p'] < 1e-9
    # the mean's standard error is the spread over the root of 60, of each cloud
    assert other['slide_m_off'] == pytest.approx(3 / (draws.std(ddof=1) * math.sqrt(2 / 60)))
    assert '60 drops, random' in DROPS.tables(rows)[0]


def test_what_has_not_settled_counts_as_settling_at_the_end():
    never, = drop_statistics.merged([cloud('truth', [math.inf, 1.0])])
    assert never['settled_s_mean'] == pytest.approx((drop_statistics.DURATION + 1) / 2)


@pytest.mark.parametrize('wrong', [0.0, 0.01])
def test_apexes_come_from_height_and_speed_in_the_middle_of_a_flight(wrong):
    """Parabolas of e = 0.5 in ticks of 2 ms; those of a restitution 1 % too large show it."""
    shape, flights = restitution.BODIES['ball'], restitution.impact_times(0.5)
    found = 0.5 * (1 + wrong)
    impacts = bounce_times(1.0, found, 9.8, len(flights))
    times = np.arange(0, flights[-1], restitution.FINE_TICK)
    positions, speeds = np.zeros((len(times), 1, 3)), np.zeros((len(times), 1, 3))
    for index, time in enumerate(times):
        n = sum(impact <= time for impact in impacts)
        since = time - impacts[n - 1] if n else time
        speed = found ** n * math.sqrt(2 * 9.8) if n else 0.0
        positions[index, 0, 2] = 0.1 + (0 if n else 1) + speed * since - 4.9 * since ** 2
        speeds[index, 0, 2] = speed - 9.8 * since
    moved = Trajectory(times, positions, np.tile((0, 0, 0, 1.0), (len(times), 1, 1)), speeds,
                       0 * speeds)
    shares = restitution.apex_shares(moved, shape, flights, 0.5)
    assert len(shares) == len(flights) - 1 == 7
    assert shares[0] == pytest.approx((1 + wrong) ** 2, rel=1e-12)
    assert (max(abs(share - 1) for share in shares) < 1e-9) is (wrong == 0)


def test_flights_count_down_to_the_slowest_approach():
    """v0 = 4.43 m/s: 0.5^6 of it is above 0.05 m/s, 0.5^7 below."""
    assert len(restitution.impact_times(0.5)) == 8
    assert len(restitution.impact_times(1.0)) == restitution.MAX_FLIGHTS + 1


def test_semi_implicit_euler_shows_its_order_on_a_slope():
    """PyBullet's block slides g h / 2 t too far: an error in proportion to the step."""
    rows = convergence.measure('incline_slip', 5)
    bullet = next(row for row in rows if row['label'] == 'PyBullet')
    assert bullet['steps_s'] == [0.01 / 2 ** k for k in range(6)]
    assert bullet['order_finest'] == pytest.approx(1, abs=0.2)
    page = '\n'.join(CONVERGENCE.tables(rows))
    assert 'h/32' in page and 'PyBullet' in page


def test_standard_errors_of_segments_are_those_of_drops():
    """Of independent normal errors: sqrt(q (1 - q) / n) over the density at the quantile q; where
    the four segments of a drop are equal, n is the number of drops, a factor of two. The bootstrap
    itself scatters by 9 and 13 % (40 seeds).
    """
    from scipy.stats import norm
    rng = np.random.default_rng(5)
    for drops, errors in ((8000, rng.normal(size=8000)),
                          (2000, np.repeat(rng.normal(size=2000), 4))):
        for quantile, found in zip((.5, .9), short_segments.standard_errors(errors), strict=True):
            due = math.sqrt(quantile * (1 - quantile) / drops) / norm.pdf(norm.ppf(quantile))
            assert found == pytest.approx(due, rel=.4)


def test_segments_come_from_drops_that_differ():
    law = comparison.LAWS[0]
    starts = [trial.start for trial in short_segments.segments(2, law)]
    heights = [start.q[2] for start in starts]
    assert len(set(heights)) == len(starts) == 8
    alone = [trial.start for trial in short_segments.segments(1, law)]
    for one, other in zip(alone, starts[:4], strict=True):
        assert np.array_equal(one.q, other.q) and np.array_equal(one.v, other.v)


def criteria_met(figures):
    return {row['criterion']: row['met'] for row in criteria.criteria(figures)}


def test_criteria_of_segments_are_met_or_not():
    def segment(method, family, cpu, error, own):
        return {'method': method, 'label': method, 'family': family, 'cpu_s_per_s': cpu,
                'position_median_m': error, 'position_p90_m': 5 * error, 'own_median_m': own,
                'reference': 'fine'}
    rows = [segment('ours-normal', 'ours', 9.0, 0.3e-3, 0.3e-3),
            segment('ours-exact', 'ours', 35.0, 0.3e-3, 0.3e-3),
            segment('bullet-10', 'PyBullet', 10.0, 6e-3, 0.2e-3)]
    met = criteria_met({'pieces': rows})
    assert met['short segments through contacts, normal'] is True
    assert met['short segments through contacts, exact'] is False
    assert met['CPU of segments over PyBullet N = 10, normal'] is True
    assert met['CPU of segments over PyBullet N = 10, exact'] is False
    assert met['no engine is faster and closer to its own limit, normal'] is True
    assert met['no engine is faster and closer to its own limit, exact'] is False
    assert '| 0.90 |' in SEGMENTS.tables(rows)[1]


def test_criteria_of_restitution_and_energy_are_met_or_not():
    def body(accuracy, worst):
        return {'method': f'ours-{accuracy}', 'label': accuracy, 'body': 'ball', 'restitution': 0.5,
                'flights': 7, 'seen': 7, 'worst': worst, 'found': 0.5}
    rows = [body('normal', 1e-9), body('exact', math.nan)]
    met = criteria_met({'restitution': rows})
    assert met['apexes of single bodies, e = 0.5 to 0.5, normal'] is True
    assert met['apexes of single bodies, e = 0.5 to 0.5, exact'] is False
    assert '| normal | ball | 0.5000 |' in RESTITUTION.tables(rows)[0]
    clouds = drop_statistics.merged([
        cloud('truth', (0.5, 0.6, 0.7), 'default, tilted'),
        cloud('ours-draft', (0.51, 0.6, 0.7), 'default, tilted'),
        cloud('ours-normal', (0.91, 0.92, 0.93), 'default, tilted')])
    met = criteria_met({'drops': clouds})
    assert met['energies of 3 default drops, draft'] is True
    assert met['energies of 3 default drops, normal'] is False


def test_ticks_at_rounding_level_do_not_count_as_estimated(monkeypatch):
    """A flight whose errors are all rounding is no proof of the estimate."""
    monkeypatch.setattr(error_estimate, 'NOISE', 1.0)
    row, = error_estimate.measure('draft', ('flight_gentle',))
    assert row['ticks'] == 0 and row['rounding'] + row['distrusted'] == 28
    assert not [entry for entry in criteria.criteria({'estimate': [row]})
                if 'estimate' in entry['criterion']]


def test_methods_are_found_by_their_names():
    assert by_name('mujoco-rk4-8').substeps == 8
    assert by_name(reference(50).name).label == reference(50).label
    assert core(2e-5).label == 'core, steps of 20 µs'
    assert by_name(core(2e-5).name).label == core(2e-5).label
    for wrong in ('bullet-x', 'ours-finest', 'mujoco-euler', 'mujoco-rk4-'):
        with pytest.raises(ValueError, match=wrong):
            by_name(wrong)


def test_random_scenes_are_the_same_for_ever_and_unlike_each_other():
    first, again, other = fuzzed(3), fuzzed(3), fuzzed(4)
    assert first.scene == again.scene and first.pushes == again.pushes
    assert first.scene != other.scene
    kinds = {joint.kind for number in range(20) for placement in fuzzed(number).scene.dolls
             for joint in placement.doll.joints}
    shapes = {bone.shape.kind for number in range(20) for bone in fuzzed(number).scene.bones}
    assert kinds == set(JOINT_KINDS) and shapes == set(SHAPES)


def test_dolls_that_collide_meet_and_one_alone_keeps_its_momentum():
    """The measure itself: the pair's flight before they meet loses nothing."""
    trial = two_dolls(6.0)
    early = dataclasses.replace(trial, duration=0.1)
    assert Metrics(trial.scene).momentum_drift(early, run(bullet(4), early).trajectory) < 1e-9
    moved = run(bullet(4), trial).trajectory
    assert np.abs(moved.angular_velocities[-1]).max() > 0.5


def test_pictures_show_a_line_for_each_engine_and_each_cloud():
    matplotlib = pytest.importorskip('matplotlib')
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    rows = [{'motion': 'm', 'title': 'M', 'label': label, 'yardstick': 'position_worst_m',
             'steps_s': [1e-2, 5e-3], 'errors': [1e-3, 0.0]} for label in STYLES]
    figure = draw_convergence({'convergence': rows}, plt)
    assert len(figure.axes[0].lines) == len(STYLES) + 1
    clouds = drop_statistics.merged([cloud('truth', [0.1, 0.2]), cloud('other', [0.3, math.inf])])
    figure = draw_drops({'drops': clouds}, plt)
    # of two drops one has no value: its line ends at a half
    assert [line.get_ydata()[-1] for line in figure.axes[0].lines] == [1.0, 0.5]
    assert draw_drops({}, plt) is None and draw_convergence({}, plt) is None
    plt.close('all')

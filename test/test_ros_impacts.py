"""~/impacts: a status for each impact while somebody listens, and what /diagnostics tells."""
import math
import re

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('numba')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.parameter import Parameter
from visualization_msgs.msg import Marker, MarkerArray

from ragdoll_ros import load_limits, load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.impacts.markers import to_arrows

IMPACTS = '/ragdoll/impacts'
TICKS = 40
MINE = """
source: of this test
regions:
  foot_leg: {force: 1, transient_force: 1.0e+9, stiffness: 1.0e+4, head: true, bones: [shin]}
"""


def alone():
    """Impacts of the scene `drop` by a simulation alone, tick by tick."""
    with Simulation(load_scene('drop')) as simulation:
        simulation.record_impacts(load_limits())
        ticks = []
        for _ in range(TICKS):
            simulation.advance()
            ticks.append(simulation.impacts)
    return [impacts for impacts in ticks if impacts]


def values_of(status):
    return {pair.key: pair.value for pair in status.values}


def test_impacts_are_published_while_subscribed(make_node, peer):
    node = make_node()
    node.tick()
    with pytest.raises(Exception, match='not recorded'):
        _ = node.simulation.impacts
    assert node._impacts.status.startswith('not recorded')
    node.reset()
    heard = peer.collect(DiagnosticArray, IMPACTS)
    peer.wait_heard(node, IMPACTS)
    for _ in range(TICKS):
        node.tick()
    expected = alone()
    peer.wait(lambda: len(heard) >= len(expected))
    assert [len(message.status) for _, message in heard] == list(map(len, expected))
    worst = {}
    for (_, message), impacts in zip(heard, expected, strict=True):
        assert message.header.frame_id == 'world'
        for status, impact in zip(message.status, impacts, strict=True):
            values = values_of(status)
            assert (status.name, status.hardware_id) == (impact.bone, 'doll')
            assert (values['region'], values['against']) == (impact.region, impact.against)
            for key, figure in (('approach_speed_m_s', impact.speed), ('ratio', impact.ratio),
                                ('effective_mass_kg', impact.effective_mass),
                                ('impulse_N_s', impact.impulse), ('limit_N', impact.limit),
                                ('peak_force_N', impact.peak_force),
                                ('duration_s', impact.duration),
                                ('simulated_time', impact.time / 1e9)):
                assert float(values[key]) == pytest.approx(figure, rel=1e-5), key
            assert (status.level == DiagnosticStatus.WARN) == (impact.ratio > 1)
            assert ('hic15' in values) == (impact.region == 'skull')
            assert 'ISO/TS 15066' in values['source_of_limits']
            worst[impact.region] = max(worst.get(impact.region, (0, '')),
                                       (impact.ratio, impact.against))
    told = {region: (float(ratio), hit) for region, ratio, hit in re.findall(
        r'(\S+) (\S+) \((.+?)\)', node._impacts.status)}
    assert told.keys() == worst.keys()
    for region, (ratio, hit) in told.items():
        assert (pytest.approx(ratio, rel=0.01), hit) == worst[region]


def test_markers_of_impacts_are_arrows_with_their_ratio(make_node, peer):
    """Also without a subscriber to ~/impacts."""
    node = make_node(impact_marker_lifetime=1.5)
    heard = peer.collect(MarkerArray, IMPACTS + '/markers')
    peer.wait_heard(node, IMPACTS + '/markers')
    for _ in range(TICKS):
        node.tick()
    expected = alone()
    peer.wait(lambda: len(heard) >= len(expected))
    ids = []
    for (_, message), impacts in zip(heard, expected, strict=True):
        arrows = [marker for marker in message.markers if marker.type == Marker.ARROW]
        texts = [marker for marker in message.markers if marker.type == Marker.TEXT_VIEW_FACING]
        assert len(message.markers) == 2 * len(impacts)
        for arrow, text, impact in zip(arrows, texts, impacts, strict=True):
            assert arrow.header.frame_id == 'world' and arrow.id == text.id
            assert arrow.lifetime.sec == 1 and arrow.lifetime.nanosec == 500_000_000
            tail, tip = (np.array((point.x, point.y, point.z)) for point in arrow.points)
            assert tuple(tail) == impact.point
            along = tip - tail
            np.testing.assert_allclose(along / np.linalg.norm(along), impact.normal, atol=1e-12)
            assert text.text.startswith(f'{impact.bone}: {impact.peak_force:.0f} N, ')
            assert f'{impact.ratio:.2f} of the limit' in text.text
            assert (arrow.color.r > 0.8) == (impact.ratio > 1)
            ids.append(arrow.id)
        assert [arrow.is_above for arrow in to_arrows(message)] == [
            impact.ratio > 1 for impact in impacts]
    assert len(set(ids)) == len(ids)
    longest = max(impact.ratio for impacts in expected for impact in impacts)
    assert longest > 1, 'both colours were seen'


def test_limits_are_replaced_by_a_path(make_node, peer, tmp_path):
    (tmp_path / 'mine.yaml').write_text(MINE)
    node = make_node(impact_limits=str(tmp_path / 'mine.yaml'))
    heard = peer.collect(DiagnosticArray, IMPACTS)
    peer.wait_heard(node, IMPACTS)
    for _ in range(TICKS):
        node.tick()
    peer.wait(lambda: heard)
    found = [values_of(status) for _, message in heard for status in message.status]
    assert {values['region'] for values in found} <= {'foot_leg', 'unknown'}
    for values in found:
        if values['region'] == 'unknown':
            assert values['peak_force_N'] == values['source_of_limits'] == 'unknown'
        else:
            assert float(values['hic36']) >= float(values['hic15'])
            assert float(values['duration_s']) == pytest.approx(
                math.pi * math.sqrt(float(values['effective_mass_kg']) / 1e4), rel=1e-4)
    refused = node.set_parameters_atomically([Parameter('impact_limits', value='nothing')])
    assert not refused.successful and 'iso_ts_15066' in refused.reason
    assert node.set_parameters_atomically(
        [Parameter('impact_limits', value='iso_ts_15066')]).successful


def test_another_engine_says_that_it_has_none(make_node, peer):
    pytest.importorskip('pybullet')
    node = make_node(engine='bullet')
    peer.collect(DiagnosticArray, IMPACTS)
    peer.wait_heard(node, IMPACTS)
    node.tick()
    assert 'engine bullet finds no times of impact' in node._impacts.status

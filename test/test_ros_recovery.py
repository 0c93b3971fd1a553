"""Bad states never leave the node: what is published, logged, written and told instead."""
from __future__ import annotations

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from poison import poison
from rclpy.logging import get_logging_directory

from ragdoll_ros.physics.guard import BOUND
from ragdoll_ros.ros.recovery import DUMP_LENGTH, MAX_CONSECUTIVE, MAX_DUMPS


def places(messages):
    """(k, n, 7) of PoseArrays."""
    return np.array([[[p.position.x, p.position.y, p.position.z, p.orientation.x, p.orientation.y,
                       p.orientation.z, p.orientation.w] for p in message.poses]
                     for _, message in messages])


def stamps(messages):
    return [message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec
            for _, message in messages]


@pytest.mark.parametrize('kind', ['a NaN', '1e12 m', 'energy'])
def test_what_is_put_into_the_engine_is_never_published(make_node, peer, tmp_path, kind):
    node = make_node(dump_directory=str(tmp_path))
    node.pause(True)
    got = peer.collect(PoseArray, 'ragdoll/poses')
    peer.wait_heard(node, '/ragdoll/poses')
    for tick in range(150):
        if tick == 130:
            node.inputs.on_force(Wrench(force=Vector3(x=500.0)))
        if tick == 133:
            last = node.simulation.state.rows.copy()
            reason = poison(node.simulation, kind)
        node.tick()
    peer.wait(lambda: len(got) == 150)
    shown = places(got)
    assert np.isfinite(shown).all() and np.abs(shown).max() < 10
    # That tick shows again what the last one did; forward kinematics round anew.
    np.testing.assert_allclose(shown[133], shown[132], atol=1e-9)
    assert np.abs(np.diff(shown[:, :, :3], axis=0)).max() < 0.2, 'm in a tick: no jump'
    assert min(np.diff(stamps(got))) > 0
    file, = tmp_path.iterdir()
    with np.load(file, allow_pickle=False) as dump:
        assert reason in str(dump['reason'])
        assert dump['states'].shape == (DUMP_LENGTH, 10, 13)
        assert dump['times'].shape == (DUMP_LENGTH,)
        np.testing.assert_array_equal(dump['states'][-2], last)
        bad = dump['states'][-1]
        assert kind == 'energy' or not np.linalg.norm(bad) <= BOUND
        np.testing.assert_array_equal(np.diff(dump['times']), node.simulation.tick)
        assert tuple(dump['bone_names']) == node.simulation.scene.bone_names
        # Ticks 130 to 133, 133 the last.
        np.testing.assert_array_equal(dump['push_ticks'], np.arange(DUMP_LENGTH - 4, DUMP_LENGTH))
        assert set(dump['push_bones']) == {'torso'}
        np.testing.assert_array_equal(dump['push_numbers'][:, 0], 500.0)
        assert dump['grab_numbers'].shape == (0, 6)


def test_diagnostics_say_error_once_and_then_ok(make_node, peer, tmp_path):
    node = make_node(dump_directory=str(tmp_path))
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(node)
    peer.wait(lambda: reports)
    reports.clear()
    poison(node.simulation, 'a NaN')
    peer.wait(lambda: any(each.status[0].level == DiagnosticStatus.ERROR for _, each in reports))
    status = reports[-1][1].status[0]
    file, = tmp_path.iterdir()
    assert 'not finite' in status.message and str(file) in status.message
    values = {pair.key: pair.value for pair in status.values}
    assert values['bad_states'] == '1' and values['state_dump'] == str(file)
    # A busy machine may warn of its stalls.
    peer.wait(lambda: reports[-1][1].status[0].level != DiagnosticStatus.ERROR)
    count = len(reports)
    peer.wait(lambda: len(reports) > count)
    assert reports[-1][1].status[0].level != DiagnosticStatus.ERROR


def test_three_in_a_row_begin_the_scene_anew(make_node, tmp_path):
    node = make_node(dump_directory=str(tmp_path))
    node.pause(True)
    for _ in range(20):
        node.tick()
    before = node.simulation
    for number in range(1, MAX_CONSECUTIVE):
        poison(node.simulation, 'a NaN')
        node.tick()
        assert node.simulation is before and node.simulation.time == 20 * before.tick
        assert node._diagnostic_values()['bad_states'] == number
    poison(node.simulation, 'a NaN')
    node.tick()
    assert node.simulation is not before and node.simulation.time == 0
    assert len(list(tmp_path.iterdir())) == 1, 'all begin alike'
    node.tick()
    assert node.simulation.time == node.simulation.tick


def test_files_are_few_however_often_states_are_bad(make_node, tmp_path):
    node = make_node(dump_directory=str(tmp_path / 'made' / 'on demand'))
    node.pause(True)
    for _ in range(MAX_DUMPS + 5):
        poison(node.simulation, 'a NaN')
        node.tick()
        node.tick()
    assert len(list((tmp_path / 'made' / 'on demand').iterdir())) == MAX_DUMPS
    assert node._diagnostic_values()['bad_states'] == MAX_DUMPS + 5


def test_without_a_place_to_write_the_doll_goes_on(make_node, tmp_path):
    (tmp_path / 'file').write_text('')
    node = make_node(dump_directory=str(tmp_path / 'file'))
    node.pause(True)
    poison(node.simulation, 'a NaN')
    node.tick()
    node.tick()
    assert node.simulation.time == node.simulation.tick
    assert node._diagnostic_values()['state_dump'] == ''


def test_by_default_files_go_where_ros_has_its_logs(make_node):
    node = make_node()
    node.pause(True)
    before = set(get_logging_directory().glob('ragdoll_*.npz'))
    poison(node.simulation, 'a NaN')
    node.tick()
    made, = set(get_logging_directory().glob('ragdoll_*.npz')) - before
    made.unlink()

"""Parameters at the start and live: taken, refused with a reason, brought along by a scene."""
from __future__ import annotations

import dataclasses
import math
import time

import pytest
import rclpy
import yaml
from conftest import ROOT
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from geometry_msgs.msg import PoseArray
from rcl_interfaces.msg import Log, ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.clock import Clock, ClockType
from rclpy.parameter import (
    Parameter,
    parameter_value_to_python,
)
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from ragdoll_ros.files.robots.urdf_tree import parse_urdf
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model.errors import ModelErrors, RagdollError
from ragdoll_ros.physics.accuracy import EXACT
from ragdoll_ros.ros.latched_topic import LATCHED, InvalidQosOverride
from ragdoll_ros.ros.node import RagdollNode
from ragdoll_ros.ros.parameters.node_settings import SPECS, NodeSettings
from ragdoll_ros.ros.ticker import Ticker

LATCHED_LOG = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)

RANGES = {name: spec.metadata['range'] for name, spec in SPECS.items()
          if spec.metadata['range'] and isinstance(spec.default, float)}


def put(node, **values):
    """Set parameters together, as the service does; give the result."""
    return node.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in values.items()])


def value(node, name):
    return node.get_parameter(name).value


@pytest.fixture
def node(make_node):
    return make_node()


def test_all_are_declared_with_a_description(node):
    for name in [*SPECS, 'bone_names']:
        assert node.describe_parameter(name).description
    assert value(node, 'bone_names') == list(load_scene('drop').bone_names)
    assert (value(node, 'rate'), value(node, 'real_time_factor')) == (100.0, 1.0)
    assert value(node, 'pushed_bone') == 'torso'


def test_the_doll_goes_on_while_another_scene_is_loaded(node):
    """A thousand dolls take longer than many ticks; a scene that cannot be is refused as before."""
    before = node.simulation
    assert put(node, scene='field').successful
    assert node.simulation is not before and len(node.simulation.scene.dolls) == 1000
    assert before.time > 10 * before.tick
    assert 'Unreadable' in put(node, scene='/').reason


def test_long_ticks_leave_half_the_time_to_what_runs_beside_them(node):
    """Ticks that keep the interpreter and take longer than their period, as on a busy machine."""
    spent = [0.0]

    def tick(_):
        begin = time.thread_time()
        sum(range(1_000_000))  # one call of C code
        spent[0] += time.thread_time() - begin

    def make():
        begin = time.thread_time()
        while time.thread_time() < begin + 0.2:
            pass
        return 'made'

    ticker = Ticker(node, Clock(clock_type=ClockType.STEADY_TIME), tick)
    ticker.start(1e6)
    assert ticker.run_beside(make) == 'made'
    # 0.15 to 0.18 s seen; 0.51 and 0.52 s without the pause.
    assert 0 < spent[0] < 0.3


def test_a_start_that_is_paused_stands_until_it_is_let_go(make_node, peer):
    node = make_node(start_paused=True)
    shown = peer.collect(PoseArray, f'{node.get_fully_qualified_name()}/poses', qos=LATCHED)
    spun(node, peer, lambda: shown)
    assert node.paused and node.simulation.time == 0
    node.pause(False)
    spun(node, peer, lambda: node.simulation.time > 0)


def spun(node, peer, condition):
    """Spin the node until a condition holds."""
    peer.wait(lambda: rclpy.spin_once(node, timeout_sec=0.02) or condition())


@pytest.mark.parametrize('name', RANGES)
def test_a_number_may_be_at_its_ends_and_not_beyond(node, name):
    lower, upper = RANGES[name]
    for good in (lower, upper):
        assert put(node, **{name: good}).successful
        assert getattr(node.settings, name) == value(node, name) == good
        node.tick()
    bad = [upper * 1.001, math.nan, math.inf, -math.inf, lower - 0.001 * max(1, lower), -1.0]
    for number in bad:
        result = put(node, **{name: float(number)})
        assert not result.successful and name in result.reason
    assert getattr(node.settings, name) == value(node, name) == upper
    assert node.input_counts.refused['parameters'] == len(bad)


def test_whole_numbers_are_numbers(make_node):
    node = make_node(rate=50, real_time_factor=2)
    assert (node.settings.rate, node.settings.real_time_factor) == (50.0, 2.0)
    assert put(node, max_force=300).successful and put(node, push_timeout=1).successful
    assert (node.settings.max_force, value(node, 'push_timeout')) == (300.0, 1.0)
    assert not put(node, rate=True).successful
    result, = node.set_parameters([Parameter('rate', value=6000)])
    assert not result.successful and '5000' in result.reason


def rosout(peer, node):
    """What the log of a node gets to say to everybody."""
    got = peer.collect(Log, '/rosout', LATCHED_LOG)
    peer.executor_.add_node(node)
    return lambda: [message.msg for _, message in got]


def test_a_parameter_that_does_not_exist_is_warned_of(make_node, peer):
    said = rosout(peer, make_node(rat=50.0, speed=1.0))
    peer.wait(lambda: {'no parameter rat: it is ignored; did you mean rate?',
                       'no parameter speed: it is ignored'} <= set(said()))


def test_two_nodes_of_one_name_are_told_of(make_node, peer):
    nodes = make_node(), make_node()
    said = rosout(peer, nodes[0])
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(nodes[1])
    peer.wait(lambda: any('2 nodes are called /ragdoll' in line and 'end all but one' in line
                          for line in said()))
    peer.wait(lambda: any('2 nodes have this name' in report.status[0].message
                          for _, report in reports))
    peer.executor_.remove_node(nodes[1])
    nodes[1].destroy_node()
    count = len(reports)
    peer.wait(lambda: any({pair.key: pair.value for pair in report.status[0].values}['namesakes']
                          == '0' for _, report in reports[count:]))


def test_the_start_is_told_in_one_line(make_node, peer):
    said = rosout(peer, make_node(scene='crowd', accuracy='draft', engine='bullet'))
    peer.wait(lambda: ('scene crowd: 10 dolls of 100 bones, engine bullet, accuracy draft; poses '
                       'on /ragdoll/poses, status on /diagnostics') in said())


def test_overlaps_at_the_start_are_told(make_node, peer, tmp_path):
    ball = '{name: ball, bones: [{name: ball, shape: {sphere: {radius: 0.1}}, mass: 1, ' \
           'position: [0, 0, 0]}]}'
    path = tmp_path / 'deep.yaml'
    path.write_text(f'dolls: [{{doll: {ball}, position: [0, 0, 0.58]}}]\n'
                    'bodies: [{name: post, shape: {box: {size: [1, 1, 1]}}}]\n')
    said = rosout(peer, make_node(scene=str(path), engine='rigid'))
    words = 'ball is 20.0 mm deep in post'
    peer.wait(lambda: f'overlaps at the start: {words}' in said())
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.wait(lambda: any(KeyValue(key='initial_overlaps', value=words) in report.status[0].values
                          for _, report in reports))


def dump(peer, path):
    """Write all parameters of the node as `ros2 param dump` does."""
    names = peer.call(ListParameters, 'ragdoll/list_parameters', ListParameters.Request())
    request = GetParameters.Request(names=names.result.names)
    values = peer.call(GetParameters, 'ragdoll/get_parameters', request).values
    found = {name: parameter_value_to_python(value)
             for name, value in zip(request.names, values, strict=True)}
    path.write_text(yaml.safe_dump({'/ragdoll': {'ros__parameters': found}}))


def test_a_dump_can_be_loaded(make_node, peer, tmp_path):
    """By what `ros2 param load` uses; all of it is accepted, also what is read-only."""
    path = tmp_path / 'dump.yaml'
    node = make_node(rate=50, scene='flight', pushed_bone='head')
    peer.executor_.add_node(node)
    dump(peer, path)
    before = node.settings
    assert put(node, rate=200.0, pushed_bone='torso', scene='drop').successful
    client = AsyncParameterClient(peer, 'ragdoll')
    peer.wait(client.services_are_ready)
    future = client.load_parameter_file(str(path))
    peer.wait(future.done)
    assert [result.reason for result in future.result().results if not result.successful] == []
    assert node.settings == before


@pytest.mark.parametrize('names', [[], ['-r', '__node:=other', '-r', '__ns:=/stage']])
def test_the_parameter_file_reaches_a_node_of_any_name(ros, tmp_path, names):
    path, text = tmp_path / 'node.yaml', (ROOT / 'config/node.yaml').read_text()
    path.write_text(text.replace('max_force: 10000.0', 'max_force: 300'))
    node = RagdollNode(cli_args=['--ros-args', *names, '--params-file', str(path)])
    try:
        assert node.settings.max_force == 300.0
    finally:
        node.destroy_node()


def test_workers_are_a_number_of_threads_or_all_cores(node):
    for good in (0, 2, 64, 1):
        assert put(node, workers=good).successful
        assert node.settings.workers == value(node, 'workers') == good
        node.tick()
    for count, bad in enumerate((-1, 65), start=1):
        result = put(node, workers=bad)
        assert not result.successful and 'workers' in result.reason
        assert node.input_counts.refused['parameters'] == count
    assert node.settings.workers == 1


@pytest.mark.parametrize('name', [*SPECS, 'bone_names'])
def test_a_wrong_type_is_refused_and_counted(node, name):
    before = value(node, name)
    wrong = [[1.0], [b'x'], *([1.5] if isinstance(before, str | int) else ['text'])]
    wrong += ['text' if isinstance(before, int | float) else 7]
    for count, other in enumerate(wrong, start=1):
        result = put(node, **{name: other})
        assert not result.successful and result.reason
        assert node.input_counts.refused['parameters'] == count
    assert value(node, name) == before


@pytest.mark.parametrize('name, bad, reason', [
    ('accuracy', 'perfect', 'draft, normal, exact'), ('engine', 'steam', 'rigid, bullet, mujoco'),
    ('pushed_bone', 'tail', 'torso, head'),
    ('pushed_bone', '', 'torso'), ('publish_tf', 'some', 'all, root, none'),
    ('frame_id', '', 'a name'), ('frame_id', '/world', 'slash'),
    ('frame_id', 'left_shin', 'no bone'), ('scene', 'nowhere', 'crowd'), ('scene', '', 'crowd'),
    ('scene', 'x' * 5000, 'Unreadable'), ('scene', '~nobody/x', 'Unreadable'),
    ('scene', '/', 'Unreadable')])
def test_a_wrong_word_is_refused_with_what_would_be_right(node, name, bad, reason):
    before, simulation = node.settings, node.simulation
    result = put(node, **{name: bad})
    assert not result.successful and reason in result.reason
    assert node.settings == before and node.simulation is simulation
    node.tick()


def test_bone_names_are_read_only(node):
    result = put(node, bone_names=['a'])
    assert not result.successful and 'read-only' in result.reason


def test_bone_names_are_the_scene_s_whatever_the_start_says(make_node):
    """As with a dump of the parameters that another scene had."""
    assert value(make_node(bone_names=['a', 'b']), 'bone_names') == list(
        load_scene('drop').bone_names)


def test_pace_and_rate_change_live(node):
    assert put(node, rate=250.0, real_time_factor=0.5).successful
    assert node.simulation.tick == 4_000_000
    assert 8_000_000 in {timer.timer_period_ns for timer in node.timers}
    before = node.simulation.time
    node.tick()
    assert node.simulation.time - before == 4_000_000


def test_accuracy_changes_live(node):
    assert put(node, accuracy='exact').successful
    assert node.simulation.accuracy is EXACT


def test_another_engine_starts_the_scene_anew(node):
    node.tick()
    before = node.simulation
    assert put(node, engine='bullet').successful
    assert node.simulation is not before and node.simulation.engine_name == 'bullet'
    assert node.simulation.time == 0 and node.simulation.scene == before.scene
    node.tick()
    assert put(node, accuracy='draft').successful
    assert node.simulation.time > 0


def test_a_scene_brings_its_bones_its_pace_and_its_root(node):
    assert put(node, scene='article').successful
    assert value(node, 'real_time_factor') == node.settings.real_time_factor == 0.6
    assert put(node, scene='crowd').successful
    assert value(node, 'bone_names') == list(node.simulation.scene.bone_names)
    assert len(value(node, 'bone_names')) == 100
    assert value(node, 'pushed_bone') == node.settings.pushed_bone == 'doll_1/torso'
    assert value(node, 'real_time_factor') == 1.0
    assert node.describe_parameter('bone_names').read_only
    node.tick()


def test_what_was_set_otherwise_stays_over_a_new_scene(make_node):
    node = make_node(real_time_factor=0.25, rate=50.0, pushed_bone='head')
    assert put(node, scene='article').successful
    assert (node.settings.real_time_factor, node.settings.rate) == (0.25, 50.0)
    assert node.settings.pushed_bone == 'head'
    assert node.simulation.tick == 20_000_000


def test_a_scene_without_the_pushed_bone_needs_another_in_the_same_call(make_node):
    node = make_node(pushed_bone='head')
    assert 'pushed_bone' in put(node, scene='crowd').reason
    assert put(node, scene='crowd', pushed_bone='doll_3/head').successful
    assert value(node, 'pushed_bone') == 'doll_3/head'


def test_a_scene_with_a_bone_of_the_world_s_name_is_refused(make_node):
    node = make_node(scene='crowd', frame_id='torso')
    result = put(node, scene='drop')
    assert not result.successful and 'frame_id' in result.reason
    assert put(node, scene='drop', frame_id='map').successful


def test_a_scene_that_is_set_again_is_read_again(make_node, tmp_path):
    path = tmp_path / 'mine.yaml'
    scene = load_scene('drop')
    save_scene(scene, path)
    node = make_node(scene=str(path))
    save_scene(dataclasses.replace(scene, gravity=(0, 0, -1)), path)
    assert put(node, scene=str(path)).successful
    assert node.simulation.scene.gravity == (0, 0, -1)
    path.write_text('dolls: []\n')
    result = put(node, scene=str(path))
    assert not result.successful and 'dolls' in result.reason
    assert node.simulation.scene.gravity == (0, 0, -1)


def test_the_world_s_name_is_that_of_the_description_s_root(make_node, peer):
    """Several dolls hang on it; poses are given in it."""
    node = make_node(scene='crowd', frame_id='map')
    got = peer.collect(String, 'robot_description', LATCHED)
    peer.wait(lambda: got)
    assert parse_urdf(got[-1][1].data).order[0] == 'map'
    assert put(node, frame_id='odom').successful
    peer.wait(lambda: parse_urdf(got[-1][1].data).order[0] == 'odom')


def test_the_world_s_name_and_the_clock_change_live(node):
    assert put(node, frame_id='map', publish_clock=True).successful
    assert node.count_publishers('/clock') == 1
    assert put(node, publish_clock=False).successful
    node.tick()
    assert '/clock' not in {publisher.topic_name for publisher in node.publishers}


@pytest.mark.parametrize('values, words', [
    ({'rate': -1.0, 'real_time_factor': math.nan, 'pushed_bone': 'tail'},
     ['rate', 'real_time_factor', 'tail']),
    ({'rate': 'fast', 'accuracy': 'foo'}, ['rate', 'DOUBLE', 'foo']),
    ({'rate': 6000}, ['rate', '5000']),
    ({'frame_id': 'left_shin'}, ['frame_id', 'left_shin'])])
def test_a_wrong_start_is_refused_with_all_that_is_wrong(make_node, values, words):
    with pytest.raises(RagdollError) as caught:
        make_node(**values)
    assert all(word in str(caught.value) for word in words)


def test_a_broken_scene_ends_the_start_with_all_its_faults(make_node, broken_scene):
    path, words = broken_scene
    with pytest.raises(ModelErrors) as caught:
        make_node(scene=str(path))
    assert all(word in str(caught.value) for word in words)


def test_the_defaults_are_those_of_the_default_scene(node):
    assert dataclasses.replace(NodeSettings(), pushed_bone='torso') == node.settings
    assert node.describe_parameter('rate').type == ParameterType.PARAMETER_DOUBLE


def test_qos_overrides_set_the_qos_of_publishers(make_node):
    """Of this topic alone, also after it has been made anew for want of subscribers."""
    name = 'qos_overrides./ragdoll/poses.publisher.'
    node = make_node(**{f'{name}reliability': 'best_effort', f'{name}depth': 3})
    for _ in range(2):
        for topic, expected in (('poses', ReliabilityPolicy.BEST_EFFORT),
                                ('markers', ReliabilityPolicy.RELIABLE)):
            found, = node.get_publishers_info_by_topic(f'/ragdoll/{topic}')
            assert found.qos_profile.reliability == expected
        node.pause(True)
        node.tick()
    assert node.get_parameter(f'{name}depth').value == 3
    with pytest.raises(InvalidQosOverride, match='~/poses: Unexpected QoS override'):
        make_node(**{f'{name}reliability': 'fast'})


def test_a_broken_scene_does_not_hide_other_faults(make_node, broken_scene):
    path, words = broken_scene
    with pytest.raises(RagdollError) as caught:
        make_node(scene=str(path), rate=-1.0, pushed_bone='tail')
    assert all(word in str(caught.value) for word in (*words, 'rate'))
    assert 'pushed_bone' not in str(caught.value), 'of a scene that is not known'


def test_all_wrong_words_are_told_at_once(make_node):
    with pytest.raises(RagdollError) as caught:
        make_node(accuracy='fine', publish_tf='some', engine='steam', frame_id='/map',
                  pushed_bone='tail', imus=['nose'], max_force=-1.0)
    told = str(caught.value)
    assert all(name in told for name in ('accuracy', 'publish_tf', 'engine', 'frame_id',
                                         'pushed_bone', 'imus', 'max_force'))


def test_the_line_at_the_start_follows_remappings(ros, capfd):
    node = RagdollNode(cli_args=['--ros-args', '-r', '~/poses:=/bodies', '-r',
                                 '/diagnostics:=/health'])
    node.destroy_node()
    assert 'poses on /bodies, status on /health' in capfd.readouterr().err

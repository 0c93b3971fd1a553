"""README.md and docs/ say what the node is: messages can be sent, tables are complete."""
import importlib
import re
from pathlib import Path

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray

from ragdoll_ros.ros.messages.tf import TFMessage

ROOT = Path(__file__).resolve().parent.parent
PAGES = [(ROOT / 'README.md').read_text(), *(path.read_text() for path in ROOT.glob('docs/*.md'))]
TEXT = re.sub(r' *\\\n *', ' ', '\n'.join(PAGES))
REFERENCE = (ROOT / 'docs/reference.md').read_text()
DIAGNOSTICS = (ROOT / 'docs/diagnostics.md').read_text()
SENT = sorted(set(re.findall(r'^ros2 (?:topic pub --once|service call) (\S+) (\w+)/(msg|srv)/(\w+)'
                             r"(?: '(.*)')?$", TEXT, re.M)))

ROS_OWN = re.compile('use_sim_time$|start_type_description_service$|qos_overrides')
"""Parameters that rclpy declares for every node."""


ABSENT = {('/ragdoll/bodies/<name>/odom', 'in', 'nav_msgs/Odometry'),
          ('/ragdoll/bodies/<name>/cmd_vel', 'in', 'geometry_msgs/Twist'),
          ('/ragdoll/bodies/<name>/joint_states', 'in', 'sensor_msgs/JointState'),
          ('/tf', 'in', 'tf2_msgs/TFMessage'), ('/tf_static', 'in', 'tf2_msgs/TFMessage'),
          *(() if TFMessage else {('/tf', 'out', 'tf2_msgs/TFMessage')})}
"""What is offered with driven bodies, by `body_frames`, and where tf2_msgs is installed."""

STANDARD = re.compile('simulation_interfaces/|/_action/')
"""What docs/simulation_interfaces.md has."""


def topics_and_services(node):
    """Give the names and types of all that a node offers, by what it is: out, in or service."""
    name, namespace = node.get_name(), node.get_namespace()
    return [*node.get_publisher_names_and_types_by_node(name, namespace),
            *node.get_subscriber_names_and_types_by_node(name, namespace),
            *node.get_service_names_and_types_by_node(name, namespace)]


def directions(node):
    """Give (name, direction, type) of all that a node offers."""
    name, namespace = node.get_name(), node.get_namespace()
    ways = {'out': node.get_publisher_names_and_types_by_node,
            'in': node.get_subscriber_names_and_types_by_node,
            'service': node.get_service_names_and_types_by_node}
    return {(topic, way, re.sub('/(msg|srv)/', '/', kind)) for way, ask in ways.items()
            for topic, kinds in ask(name, namespace) for kind in kinds}


def fill(message, values):
    for key, value in values.items():
        if isinstance(value, dict):
            fill(getattr(message, key), value)
        else:
            setattr(message, key, value)  # rclpy asserts name, type and range


def table(title, page=REFERENCE):
    """Cells of each row of the tables below a title of a page, of docs/reference.md if not said."""
    section = page.split(f'## {title}\n')[1].split('\n## ')[0]
    return [[cell.strip() for cell in line.strip('|').split(' | ')]
            for line in re.findall(r'^\| `.*\|$', section, re.M)]


def parameters(node):
    return {name: parameter.value for name, parameter in node.get_parameters_by_prefix('').items()
            if not ROS_OWN.match(name)}


def test_every_line_to_copy_is_looked_at():
    """Else the next test may pass one over."""
    count = len(set(re.findall('^ros2 (?:topic pub|service call) .*$', TEXT, re.M)))
    assert len(SENT) == count > 0


@pytest.mark.parametrize(('target', 'package', 'kind', 'name', 'text'), SENT)
def test_line_to_copy_is_a_message_the_node_takes(make_node, target, package, kind, name, text):
    if package == 'simulation_interfaces':  # its lines are called by test_ros_simulation_interfaces
        pytest.importorskip(package)
    made = getattr(importlib.import_module(f'{package}.{kind}'), name)
    fill(made() if kind == 'msg' else made.Request(), yaml.safe_load(text or '{}'))
    assert (target, [f'{package}/{kind}/{name}']) in topics_and_services(make_node())


def test_table_has_all_topics_and_services_of_the_node(make_node):
    told = {('/' + name.strip('`').replace('~', 'ragdoll').replace('<bone>', 'head').lstrip('/'),
             way, kind)
            for name, way, kind, *_ in table('Topics and services')}
    own = re.compile('/ragdoll/(describe|get|list|set)_(parameter|type_description)|'
                     '/(rosout|parameter_events)$')
    offered = {row for row in directions(make_node(publish_clock=True, scene='ponytail',
                                                    imus=['head']))
               if not own.search(row[0]) and not STANDARD.search(' '.join(row))}
    assert told - ABSENT == offered


def test_table_has_all_parameters_with_their_defaults(make_node):
    told = {name.strip('`'): default for name, default, *_ in table('Parameters')}
    declared = parameters(make_node())
    assert set(told) == set(declared)
    for name, default in told.items():
        if not default.startswith('the '):
            value = declared[name]
            value = value if isinstance(value, (str, bool, int, float)) else list(value)
            assert yaml.safe_load(default.strip('`')) == value, name


def test_table_has_the_ranges_of_the_parameters(make_node):
    node = make_node()
    for name, _, told, *_ in table('Parameters'):
        told_by = node.describe_parameter(name.strip('`'))
        for span in (*told_by.floating_point_range, *told_by.integer_range):
            lower, upper = map(float, told.split(' to '))
            assert (span.from_value, span.to_value) == (lower, upper), name


def test_parameters_that_lines_to_copy_set_exist(make_node):
    named = set(re.findall(r'-p (\w+):=', TEXT))
    named |= set(re.findall(r'^ros2 param \w+ /ragdoll (\w+)', TEXT, re.M))
    assert named and named <= set(parameters(make_node()))


@pytest.mark.parametrize('engine', ['rigid', 'bullet'])
def test_table_has_all_values_of_the_diagnostics(make_node, peer, engine):
    """With units, as the keys of measures end in them; and none that no engine has."""
    node = make_node(engine=engine)
    got = peer.collect(DiagnosticArray, '/diagnostics')
    peer.executor_.add_node(node)
    try:
        peer.wait(lambda: got)
    finally:
        peer.executor_.remove_node(node)
    status = got[0][1].status[0]
    rows = {key: (unit, meaning) for keys, unit, meaning, *_ in table('Values', DIAGNOSTICS)
            for key in re.findall('`(.*?)`', keys)}
    values = {pair.key: pair.value for pair in status.values}
    assert status.name in DIAGNOSTICS
    assert set(values) <= set(rows)
    others = [meaning for key, (_, meaning) in rows.items() if key not in values]
    assert all('`rigid`' in meaning or '`bullet`' in meaning for meaning in others)
    assert {key for key, (unit, _) in rows.items() if unit == 'boolean' and key in values} == {
        key for key, value in values.items() if value in ('true', 'false')}
    for key, (unit, _) in rows.items():
        ending = key.rpartition('_')[2]
        assert ending not in ('J', 'm', 'rad', 'ms') or unit == ending, key


def test_files_that_lines_to_copy_name_exist():
    named = re.findall(r'share ragdoll_ros\)/(\S+)', TEXT)
    assert named and all((ROOT / path).is_file() for path in named)

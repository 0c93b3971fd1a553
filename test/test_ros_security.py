"""The SROS2 policy: of the form that SROS2 reads, and what the nodes need and no more."""
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

import pytest
from test_ros_bodies import SCENE

from ragdoll_ros.ros.simulation_interfaces.entity_services import EntityServices
from ragdoll_ros.ros.simulation_interfaces.servers import snake_case
from ragdoll_ros.ros.simulation_interfaces.simulation_services import SimulationServices
from ragdoll_ros.ros.simulation_interfaces.spawning import SpawnServices

PATTERNS = {'~/bodies/*/odom', '~/bodies/*/cmd_vel', '~/bodies/*/joint_states',
            '~/imu/*/data_raw'}
"""Topics below the node's own name that are named after bones and bodies of its scene."""

POLICY = Path(__file__).resolve().parent.parent / 'config' / 'ragdoll.policy.xml'


def policy():
    """The policy's element; what SROS2's schema of format 0.2.0 asks of it is asserted here."""
    top = ElementTree.parse(POLICY).getroot()
    assert (top.tag, top.attrib) == ('policy', {'version': '0.2.0'})
    children = {'policy': {'enclaves'}, 'enclaves': {'enclave'}, 'enclave': {'profiles'},
                'profiles': {'profile'}, 'profile': {'topics', 'services', 'actions'},
                'topics': {'topic'}, 'services': {'service'}, 'actions': {'action'}}
    needed = {'enclave': {'path'}, 'profile': {'ns', 'node'}}
    rules = {'topics': {'publish', 'subscribe'}, 'services': {'reply', 'request'},
             'actions': {'call', 'execute'}}
    for each in top.iter():
        allowed = children.get(each.tag, set())
        assert {child.tag for child in each} <= allowed and bool(len(each)) == bool(allowed), each
        assert needed.get(each.tag, set()) <= set(each.attrib), each
        if each.tag in rules:
            assert each.attrib and set(each.attrib) <= rules[each.tag]
            assert set(each.attrib.values()) <= {'ALLOW', 'DENY'}
        elif each.tag in ('topic', 'service', 'action'):
            assert each.text.strip() and not each.attrib
    return top


def allowed(node, kind, right):
    """Names that a node's profile allows, in full."""
    profile = policy().find(f".//profile[@node='{node}']")
    space = profile.get('ns')
    return {each.text if each.text.startswith('/') else
            f'{space}{node}{each.text[1:]}' if each.text.startswith('~') else space + each.text
            for rule in profile.findall(kind) if rule.get(right) == 'ALLOW' for each in rule}


def test_the_policy_is_of_the_form_that_sros2_reads():
    paths = [each.get('path') for each in policy().iter('enclave')]
    assert sorted(paths) == ['/ragdoll', '/ragdoll_teleop']
    assert {each.text for each in policy().iter() if each.text and '*' in each.text} == PATTERNS


@pytest.fixture
def given(ros):
    """What ROS knows of a node: names of what it publishes, hears, answers and asks."""
    def names(node):
        own = node.get_name(), node.get_namespace()
        # The policy names an action as a whole, not its topics and services.
        return [{name for name, _ in listed(*own) if '/_action/' not in name} for listed in (
            node.get_publisher_names_and_types_by_node,
            node.get_subscriber_names_and_types_by_node,
            node.get_service_names_and_types_by_node, node.get_client_names_and_types_by_node)]
    return names


def test_the_policy_allows_what_the_node_does_and_no_more(make_node, given):
    node = make_node(scene='ponytail', publish_clock=True)
    publish, hear, answer, ask = given(node)
    publishable, hearable = (allowed('ragdoll', 'topics', right) for right in (
        'publish', 'subscribe'))
    patterns = {f'/ragdoll{pattern[1:]}' for pattern in PATTERNS}
    assert publish | {'/tf'} == publishable - patterns
    # Those of use_sim_time and body_frames.
    assert hear | {'/clock', '/tf', '/tf_static'} == hearable - patterns
    standard = {f'/ragdoll/{snake_case(name)}'  # where simulation_interfaces is installed
                for services in (SimulationServices, EntityServices, SpawnServices)
                for name in services.FEATURES}
    assert answer | standard == allowed('ragdoll', 'services', 'reply') and not ask
    assert allowed('ragdoll', 'actions', 'execute') == {'/ragdoll/simulate_steps'}


def test_the_policy_allows_topics_of_sensors_and_driven_bodies(make_node, given, tmp_path):
    """DDS compares with a pattern as fnmatch() does."""
    path = tmp_path / 'robot.yaml'
    path.write_text(SCENE)
    node = make_node(scene=str(path), imus=['doll/torso'], start_paused=True)
    publish, hear, _, _ = given(node)
    for names, right, own in ((publish, 'publish', '/imu/'), (hear, 'subscribe', '/bodies/')):
        patterns = allowed('ragdoll', 'topics', right)
        assert any(own in name for name in names)
        assert not [name for name in names if not any(fnmatchcase(name, pattern)
                                                      for pattern in patterns)]


def test_the_policy_allows_what_the_teleoperation_does_and_no_more(ros, given):
    from ragdoll_ros.ros.teleop.teleop import Teleop
    teleop = Teleop()
    try:
        publish, hear, answer, ask = given(teleop)
    finally:
        teleop.destroy_node()
    assert publish == allowed('ragdoll_teleop', 'topics', 'publish')
    assert hear | {'/clock'} == allowed('ragdoll_teleop', 'topics', 'subscribe')
    assert answer == allowed('ragdoll_teleop', 'services', 'reply')
    assert ask == allowed('ragdoll_teleop', 'services', 'request')

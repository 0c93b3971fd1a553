"""The launch files: by launch itself where that is installed, else by what they name."""
from __future__ import annotations

import ast
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
FILES = ('ragdoll.launch.py', 'ragdoll.launch.xml')
PYTHON, XML = (ROOT / 'launch' / name for name in FILES)

START = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
path, *given = sys.argv[1:]
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    AnyLaunchDescriptionSource(path),
    launch_arguments=[tuple(word.split(':=')) for word in given])]))
sys.exit(service.run())
"""


def constant(name):
    """What the launch file in Python calls so; it is read, as launch may not be here."""
    for node in ast.parse(PYTHON.read_text()).body:
        if isinstance(node, ast.Assign) and node.targets[0].id == name:
            return ast.literal_eval(node.value)
    raise AssertionError(name)


def test_both_files_have_the_same_arguments_and_the_one_in_xml_hands_all_on():
    root = ElementTree.parse(XML).getroot()
    told = {arg.get('name'): (arg.get('default'), arg.get('description'))
            for arg in root.findall('arg')}
    assert told == constant('ARGUMENTS')
    include, = root.findall('include')
    assert include.get('file') == f'$(dirname)/{PYTHON.name}'
    handed = {arg.get('name'): arg.get('value') for arg in include.findall('arg')}
    assert handed == {name: f'$(var {name})' for name in told}


def test_what_the_launch_file_starts_and_sets_is_there(make_node):
    text = PYTHON.read_text()
    assert "package='ragdoll_ros', executable='ragdoll_node'" in text
    assert "'ragdoll_node': 'ragdoll_ros.ros.node:main'" in (ROOT / 'setup.py').read_text()
    named = set(re.findall(r"parameters(?:\[| = \{)'(\w+)'", text)) - {'robot_description'}
    assert named == {'scene', 'publish_tf', 'real_time_factor'}
    assert all(make_node().has_parameter(name) for name in named)


def test_all_topics_of_the_configuration_of_rviz_go_into_the_namespace(make_node):
    text = (ROOT / 'config/ragdoll.rviz').read_text()
    displays = yaml.safe_load(text)['Visualization Manager']['Displays']
    topics = {topic['Value'] for display in displays for key, topic in display.items()
              if key in ('Topic', 'Description Topic')}
    below = {f'/ragdoll/{name}' for name in constant('RVIZ_TOPICS')}
    assert topics - {'/robot_description'} <= below
    offered = {name for name, _ in make_node().get_topic_names_and_types()} | {
        name for name, _ in make_node().get_service_names_and_types()}
    assert topics | below <= offered
    view = yaml.safe_load(text)['Visualization Manager']['Views']['Current']
    from ragdoll_ros.files.scene import load_scene
    assert view['Target Frame'] == load_scene('drop').dolls[0].doll.root.name


@pytest.mark.slow
@pytest.mark.parametrize('name', FILES)
def test_launch_starts_the_node_with_what_it_is_given(ros, peer, name):
    pytest.importorskip('launch_ros', reason='launch comes with apt alone')
    from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
    from geometry_msgs.msg import PoseArray
    from rcl_interfaces.srv import GetParameters
    try:
        path = Path(get_package_share_directory('ragdoll_ros'), 'launch', name)
    except (PackageNotFoundError, OSError):
        pytest.skip('ragdoll_ros is not built: make colcon')
    process = subprocess.Popen(
        [sys.executable, '-c', START, str(path), 'scene:=crowd', 'namespace:=stage', 'pace:=2'],
        env=dict(os.environ))
    try:
        assert len(peer.hear_once(PoseArray, '/stage/ragdoll/poses').poses) == 100
        answer = peer.call(GetParameters, '/stage/ragdoll/get_parameters', GetParameters.Request(
            names=['real_time_factor', 'publish_tf']))
        assert [answer.values[0].double_value, answer.values[1].string_value] == [2.0, 'all']
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)

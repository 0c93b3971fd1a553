"""The launch files: by launch itself where that is installed, else by what they name."""
from __future__ import annotations

import ast
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from geometry_msgs.msg import Vector3, Wrench

from ragdoll_ros.ros.parameters.launch_arguments import (
    PARAMETERS,
    InvalidLaunchArguments,
    node_parameters,
)

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
    assert node_parameters(given(), lambda package: False) == {}
    node = make_node()
    assert all(node.has_parameter(name) for name in {*PARAMETERS.values(), 'publish_tf'})


def given(**values):
    """All launch arguments, with these values."""
    return {**{name: default for name, (default, _) in constant('ARGUMENTS').items()}, **values}


def test_arguments_become_parameters_of_the_node(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('/**: {ros__parameters: {scene: crowd}}')
    found = node_parameters(given(scene='flight', pace='0.5', rate='50', publish_clock='true',
                                  use_sim_time='False', robot_state_publisher='1',
                                  params_file=str(path)), lambda package: True)
    assert found == {'scene': 'flight', 'real_time_factor': 0.5, 'rate': 50.0, 'publish_tf': 'root',
                     'publish_clock': True, 'use_sim_time': False}


@pytest.mark.parametrize(('wrong', 'told'), [
    ({'rate': 'fast'}, 'rate:=fast: expected a number from 5 to 5000'),
    ({'rate': '2'}, 'rate:=2: expected a number from 5 to 5000'),
    ({'pace': 'nan'}, 'pace:=nan: expected a number from 0.001 to 100'),
    ({'publish_clock': 'ja'}, 'publish_clock:=ja: expected true or false'),
    ({'use_sim_time': '2'}, 'use_sim_time:=2: expected true or false'),
    ({'rviz': ''}, 'rviz:=: expected true or false'),
    ({'params_file': '/nowhere.yaml'}, 'params_file:=/nowhere.yaml: expected a parameter file'),
    ({'params_file': __file__, 'robot_state_publisher': 'true'},
     'robot_state_publisher:=true with a params_file needs scene:=... as well'),
    ({'rviz': 'true'}, 'rviz:=true needs rviz2, which is not installed: sudo apt install '
                       'ros-$ROS_DISTRO-rviz2'),
    ({'foxglove': 'true'}, 'foxglove:=true needs foxglove_bridge, which is not installed: sudo apt '
                           'install ros-$ROS_DISTRO-foxglove-bridge')])
def test_what_is_wrong_or_missing_is_told_before_anything_starts(wrong, told):
    with pytest.raises(InvalidLaunchArguments) as caught:
        node_parameters(given(**wrong), lambda package: package == 'robot_state_publisher')
    assert str(caught.value) == told


def test_a_scene_that_is_not_there_is_told_before_anything_starts():
    with pytest.raises(InvalidLaunchArguments, match=r'(?s)^scene:=nowhere: .*drop'):
        node_parameters(given(scene='nowhere'), lambda package: True)


def test_all_faults_are_told_at_once():
    with pytest.raises(InvalidLaunchArguments) as caught:
        node_parameters(given(rate='x', pace='y', rviz='z'), lambda package: True)
    assert [line.split(':')[0] for line in str(caught.value).splitlines()] == [
        'pace', 'rate', 'rviz']


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


def test_the_layout_of_foxglove_shows_and_sends_what_the_node_offers(make_node):
    layout = json.loads((ROOT / 'config/ragdoll.foxglove.json').read_text())
    panels = layout['configById']
    offered = dict(make_node().get_topic_names_and_types())
    plotted = {path['value'].split('.')[0] for path in panels['Plot!height']['paths']}
    assert plotted | {*panels['3D!ragdoll']['topics'], panels['Teleop!arrows']['topic'],
                      panels['DiagnosticSummary!node']['topicToRender']} <= set(offered)
    push = panels['Publish!push']
    assert offered[push['topicName']] == [push['datatype']]
    Wrench(**{name: Vector3(**{axis: float(value) for axis, value in vector.items()})
              for name, vector in json.loads(push['value']).items()})
    assert panels['CallService!reset']['serviceName'] in dict(
        make_node().get_service_names_and_types())
    assert sorted(leaves(layout['layout'])) == sorted(panels)


def leaves(split):
    """Panels of a layout, which is divided in two again and again."""
    if isinstance(split, str):
        return [split]
    return leaves(split['first']) + leaves(split['second'])


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

"""Launches the node and, on request, robot_state_publisher and RViz.

ros2 launch ragdoll_ros ragdoll.launch.py scene:=crowd pace:=0.5 rviz:=true
"""
from __future__ import annotations

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.files.urdf import scene_to_urdf

ARGUMENTS = {
    'scene': ('drop', 'a name in config/, or the path of a scene or a doll'),
    'namespace': ('', 'namespace of the nodes, their topics and tf'),
    'pace': ('', "real-time factor; empty: the scene's"),
    'robot_state_publisher': ('false', 'true: it publishes the frames below the root links'),
    'rviz': ('false', 'true: start RViz')}
"""Default and description of each argument."""

TF_REMAPPINGS = [('/tf', 'tf'), ('/tf_static', 'tf_static')]
"""A tf topic per namespace, as equal dolls have equal frame names."""

RVIZ_TOPICS = ('markers', 'poses', 'interactive/update', 'interactive/feedback',
         'interactive/get_interactive_markers')
"""Topics in config/ragdoll.rviz, relative to /ragdoll."""


def generate_launch_description() -> LaunchDescription:
    """Entry point of `ros2 launch`."""
    declared = [DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=make_nodes)])


def make_nodes(context: LaunchContext) -> list[Node]:
    """The nodes that the launch arguments request."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    namespace = given['namespace']
    nodes = [ragdoll_node(given, namespace)]
    if is_true(given['robot_state_publisher']):
        nodes.append(robot_state_publisher(given['scene'], namespace))
    if is_true(given['rviz']):
        nodes.append(rviz(namespace))
    return nodes


def ragdoll_node(given: dict[str, str], namespace: str) -> Node:
    """The ragdoll node; with robot_state_publisher it publishes only the root links on tf."""
    parameters = {'scene': given['scene']}
    if is_true(given['robot_state_publisher']):
        parameters['publish_tf'] = 'root'
    if given['pace']:
        parameters['real_time_factor'] = float(given['pace'])
    return Node(package='ragdoll_ros', executable='ragdoll_node', namespace=namespace,
                parameters=[parameters], remappings=TF_REMAPPINGS, output='screen')


def robot_state_publisher(scene: str, namespace: str) -> Node:
    """Gets the URDF as a parameter; its robot_description is remapped, the node has its own."""
    parameters = {'robot_description': scene_to_urdf(load_scene(scene))}
    topic = ('robot_description', 'robot_state_publisher/robot_description')
    return Node(package='robot_state_publisher', executable='robot_state_publisher',
                namespace=namespace, parameters=[parameters], remappings=[*TF_REMAPPINGS, topic])


def rviz(namespace: str) -> Node:
    """RViz with the package's configuration, its topics remapped into the namespace."""
    topics = [(f'/ragdoll/{name}', f'ragdoll/{name}') for name in RVIZ_TOPICS]
    return Node(package='rviz2', executable='rviz2', namespace=namespace,
                arguments=['-d', str(config_folder() / 'ragdoll.rviz')],
                remappings=[*TF_REMAPPINGS, *topics, ('/robot_description', 'robot_description')])


def is_true(text: str) -> bool:
    """Whether a launch argument is true."""
    return text.lower() in ('true', '1')

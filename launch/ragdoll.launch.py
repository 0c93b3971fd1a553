"""Launches the node and, on request, robot_state_publisher, RViz and foxglove_bridge.

ros2 launch ragdoll_ros ragdoll.launch.py scene:=crowd pace:=0.5 rviz:=true
"""
from __future__ import annotations

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import Action, LaunchContext, LaunchDescription
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.files.urdf import scene_to_urdf
from ragdoll_ros.ros.parameters.launch_arguments import BOOLEANS, node_parameters

ARGUMENTS = {
    'scene': ('', 'a name in config/, or the path of a scene or a doll; empty: drop'),
    'params_file': ('', 'parameter file of the node; other arguments override it'),
    'namespace': ('', 'namespace of the nodes, their topics and tf'),
    'pace': ('', "real-time factor; empty: the scene's"),
    'rate': ('', "ticks per second of simulated time, Hz; empty: the scene's"),
    'publish_clock': ('', 'true: publish simulated time on /clock'),
    'use_sim_time': ('', 'true: take time from /clock'),
    'robot_state_publisher': ('false', 'true: it publishes the frames below the root links'),
    'rviz': ('false', 'true: start RViz'),
    'foxglove': ('false', 'true: start foxglove_bridge; config/ragdoll.foxglove.json is a layout')}
"""Default and description of each argument."""

TF_REMAPPINGS = [('/tf', 'tf'), ('/tf_static', 'tf_static')]
"""A tf topic per namespace, as equal dolls have equal frame names."""

RVIZ_TOPICS = ('markers', 'poses', 'interactive/update', 'interactive/feedback',
         'interactive/get_interactive_markers')
"""Topics in config/ragdoll.rviz, relative to /ragdoll."""


FOXGLOVE = 'Foxglove: open a connection to ws://localhost:8765, and import the layout {}'


def generate_launch_description() -> LaunchDescription:
    """Entry point of `ros2 launch`."""
    declared = [DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=make_nodes)])


def make_nodes(context: LaunchContext) -> list[Action]:
    """The nodes that the launch arguments request; all are checked before one starts."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    parameters = node_parameters(given, is_installed)
    namespace = given['namespace']
    nodes: list[Action] = [ragdoll_node(given, parameters)]
    if BOOLEANS[given['robot_state_publisher'].lower()]:
        nodes.append(robot_state_publisher(given['scene'] or 'drop', namespace))
    if BOOLEANS[given['rviz'].lower()]:
        nodes.append(rviz(namespace))
    if BOOLEANS[given['foxglove'].lower()]:
        nodes += [foxglove_bridge(namespace), LogInfo(msg=FOXGLOVE.format(
            config_folder() / 'ragdoll.foxglove.json'))]
    return nodes


def ragdoll_node(given: dict[str, str], parameters: dict) -> Node:
    """The ragdoll node; with robot_state_publisher it publishes only the root links on tf."""
    files = [given['params_file']] if given['params_file'] else []
    return Node(package='ragdoll_ros', executable='ragdoll_node', namespace=given['namespace'],
                parameters=[*files, parameters] if parameters else files,
                remappings=TF_REMAPPINGS, output='screen')


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


def foxglove_bridge(namespace: str) -> Node:
    """What Foxglove connects to."""
    return Node(package='foxglove_bridge', executable='foxglove_bridge', namespace=namespace,
                remappings=TF_REMAPPINGS)


def is_installed(package: str) -> bool:
    """Whether ROS finds a package."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return False
    return True

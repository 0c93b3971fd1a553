"""The node and, on demand, robot_state_publisher and RViz.

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
    'namespace': ('', 'of the nodes, of their topics and of tf'),
    'pace': ('', "simulated seconds in each second on the wall; empty: the scene's own"),
    'robot_state_publisher': ('false', 'true: it publishes the frames below the roots'),
    'rviz': ('false', 'true: RViz shows the doll')}
"""Default and description of each."""

OWN_TF = [('/tf', 'tf'), ('/tf_static', 'tf_static')]
"""Equal dolls in different namespaces have frames of the same names."""

SHOWN = ('markers', 'poses', 'interactive/update', 'interactive/feedback',
         'interactive/get_interactive_markers')
"""What config/ragdoll.rviz names, below /ragdoll."""


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    declared = [DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])


def nodes(context: LaunchContext) -> list[Node]:
    """The nodes that the arguments ask for."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    space = given['namespace']
    started = [doll(given, space)]
    if is_true(given['robot_state_publisher']):
        started.append(state_publisher(given['scene'], space))
    if is_true(given['rviz']):
        started.append(rviz(space))
    return started


def doll(given: dict[str, str], space: str) -> Node:
    """The simulation; of the frames the roots alone where robot_state_publisher has the others."""
    parameters = {'scene': given['scene']}
    if is_true(given['robot_state_publisher']):
        parameters['publish_tf'] = 'root'
    if given['pace']:
        parameters['real_time_factor'] = float(given['pace'])
    return Node(package='ragdoll_ros', executable='ragdoll_node', namespace=space,
                parameters=[parameters], remappings=OWN_TF, output='screen')


def state_publisher(scene: str, space: str) -> Node:
    """It wants the URDF at its start, and publishes it; the node's own stays the only one."""
    parameters = {'robot_description': scene_to_urdf(load_scene(scene))}
    topic = ('robot_description', 'robot_state_publisher/robot_description')
    return Node(package='robot_state_publisher', executable='robot_state_publisher',
                namespace=space, parameters=[parameters], remappings=[*OWN_TF, topic])


def rviz(space: str) -> Node:
    """RViz with the package's configuration, its topics in the namespace."""
    topics = [(f'/ragdoll/{name}', f'ragdoll/{name}') for name in SHOWN]
    return Node(package='rviz2', executable='rviz2', namespace=space,
                arguments=['-d', str(config_folder() / 'ragdoll.rviz')],
                remappings=[*OWN_TF, *topics, ('/robot_description', 'robot_description')])


def is_true(text: str) -> bool:
    """Whether an argument is switched on."""
    return text.lower() in ('true', '1')

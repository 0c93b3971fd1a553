"""cmd_vel as Twist and as TwistStamped: each is taken where it is asked for, the other is named."""
from __future__ import annotations

import pytest
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Header


def stamped(frame, speed=1.0):
    message = TwistStamped(header=Header(frame_id=frame))
    message.twist.linear.x = speed
    return message


@pytest.mark.parametrize('frame', ['', 'world', 'map'])
def test_a_stamped_velocity_in_the_world_frame_drives_as_one_without_a_stamp(make_node, frame):
    node = make_node(stamped_cmd_vel=True, frame_id='map')
    node.inputs.on_stamped_cmd_vel(stamped(frame))
    found = node.simulation.pushes
    node.inputs.on_cmd_vel(stamped('').twist)
    assert found == node.simulation.pushes != ()


def test_another_frame_is_refused_and_the_right_one_named(make_node):
    node = make_node(stamped_cmd_vel=True)
    node.inputs.on_stamped_cmd_vel(stamped('base_link'))
    assert node.simulation.pushes == () and node.input_counts.refused == {'cmd_vel': 1}
    assert ("header.frame_id: WrongForm: 'base_link'; expected world or none"
            in node.input_counts.last_reason)


@pytest.fixture
def others(ros):
    """Two nodes of other DDS participants, as one has one type per topic."""
    contexts, nodes = [rclpy.Context(), rclpy.Context()], []
    for number, context in enumerate(contexts):
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
        nodes.append(Node(f'sender_{number}', context=context))
    yield nodes
    for node, context in zip(nodes, contexts, strict=True):
        node.destroy_node()
        context.try_shutdown()


def test_the_type_follows_the_parameter_and_who_sends_the_other_one_is_named(
        make_node, peer, others, capfd):
    """Over real DDS, which connects equal types alone; the parameter is set by its service."""
    node = make_node(scene='flight')
    peer.executor_.add_node(node)
    plain, stamps = others
    speeds = stamps.create_publisher(TwistStamped, 'cmd_vel', 10)
    expected = ('/sender_1 publishes geometry_msgs/msg/TwistStamped on /cmd_vel, which is not '
                'heard: this node takes geometry_msgs/msg/Twist; set the parameter stamped_cmd_vel '
                'to true')
    # The name of the other node may come later than its publisher.
    peer.wait(lambda: node.inputs.cmd_vel.unheard == expected)
    node.inputs.cmd_vel.check_publishers()
    assert capfd.readouterr().err.count(expected) == 1
    peer.call(SetParameters, '/ragdoll/set_parameters', SetParameters.Request(
        parameters=[Parameter('stamped_cmd_vel', value=True).to_parameter_msg()]))
    peer.wait(lambda: speeds.get_subscription_count())
    speeds.publish(stamped('world'))
    peer.wait(lambda: node.simulation.pushes)
    peer.wait(lambda: not node.inputs.cmd_vel.unheard)
    plain.create_publisher(Twist, 'cmd_vel', 10)
    peer.wait(lambda: 'stamped_cmd_vel to false' in node.inputs.cmd_vel.unheard)
    peer.executor_.remove_node(node)

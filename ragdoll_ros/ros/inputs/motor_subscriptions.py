"""Subscriptions that drive motors: they set targets and strengths."""
from __future__ import annotations

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from ...physics.simulation import Simulation
from .input_counts import InputCounts
from .joint_values import joint_efforts, joint_values

TARGET, STRENGTH = '~/pose_target', '~/motor_strength'

STRENGTHS = '~/joint_strengths'


class MotorSubscriptions:
    """Subscriptions to ~/pose_target, ~/motor_strength and ~/joint_strengths.

    ~/pose_target has names, positions and velocities as on joint_states, of any joints with motors;
    positions or velocities may be left out, efforts are ignored. ~/motor_strength sets the strength
    of all motors, 0 to 1. ~/joint_strengths sets, as efforts, the strengths of the motors of the
    named joints or bones.
    """

    def __init__(self, node: Node, counts: InputCounts) -> None:
        self._counts = counts
        self.simulation: Simulation
        node.create_subscription(Float64, STRENGTH, self.on_strength, 10)
        self._joints = [node.create_subscription(JointState, TARGET, self.on_pose_target, 10),
                        node.create_subscription(JointState, STRENGTHS, self.on_joint_strengths,
                                                 10)]

    @property
    def moved_by(self) -> dict[str, list[str]]:
        """Topics of joint states, as they are remapped, by what they move."""
        return {'all motors': [each.topic_name for each in self._joints]}

    def on_pose_target(self, message: JointState) -> None:
        """Set targets; a message that is wrong is refused as a whole and counted."""
        with self._counts.refusing(TARGET):
            self.simulation.set_pose_target(*joint_values(message))

    def on_strength(self, message: Float64) -> None:
        """Set the strength of all motors; a value outside 0 to 1 is refused and counted."""
        with self._counts.refusing(STRENGTH):
            self.simulation.set_strength(message.data)

    def on_joint_strengths(self, message: JointState) -> None:
        """Set strengths; a message that is wrong is refused as a whole and counted."""
        with self._counts.refusing(STRENGTHS):
            self.simulation.set_strength(joint_efforts(message))

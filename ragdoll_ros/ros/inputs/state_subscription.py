"""Subscriptions that set states: Odometry and JointState become Simulation.set_state()."""
from __future__ import annotations

from collections.abc import Callable

from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.ragdoll import WORLD
from ...model.scene import checked_angles
from ...model.vectors import unit_vector
from ...physics.simulation import Simulation
from ..parameters.node_settings import NodeSettings
from .input_counts import InputCounts
from .joint_values import joint_values
from .subscriptions import limited

TOPIC = '~/set_state'

JOINTS = '~/set_joint_states'


class StateSubscription:
    """Subscriptions to ~/set_state and ~/set_joint_states.

    The former: ``pose`` is the root's in the world frame. ``twist`` is along the root's own axes,
    as nav_msgs defines it for ``child_frame_id``, the name of the doll. Covariances are ignored.
    The latter: names, positions and velocities as on joint_states, of any joints of any dolls;
    positions or velocities may be left out, efforts are ignored.

    ``after`` is called when a state has been set.
    """

    def __init__(self, node: Node, counts: InputCounts, after: Callable[[], None]) -> None:
        self._counts, self._after = counts, after
        self.simulation: Simulation
        self.settings: NodeSettings
        node.create_subscription(Odometry, TOPIC, self.on_odometry, 10)
        self._joints = node.create_subscription(JointState, JOINTS, self.on_joint_state, 10)

    @property
    def moved_by(self) -> dict[str, list[str]]:
        """The topic of joint states, as it is remapped, by what it moves."""
        return {'all dolls': [self._joints.topic_name]}

    def on_odometry(self, message: Odometry) -> None:
        """Set pose and velocities of a doll; a message that is wrong is refused and counted."""
        with self._counts.refusing(TOPIC):
            self._set(message)
            self._after()

    def on_joint_state(self, message: JointState) -> None:
        """Set joint angles and rates; a message that is wrong is refused and counted."""
        with self._counts.refusing(JOINTS):
            self._set_joints(message)
            self._after()

    def _set_joints(self, message: JointState) -> None:
        """Set angles and rates doll by doll, after the whole message has been checked."""
        names, scene = list(message.name), self.simulation.scene
        values = dict(zip(('joint_angles', 'joint_rates'), joint_values(message), strict=True))
        given = []
        for placement in scene.dolls:
            own = {scene.qualified(placement, name): name
                   for joint in placement.doll.joints for name in joint.angle_names}
            fields = {key: checked_angles(placement.doll, key, {
                own[name]: value for name, value in each.items() if name in own})
                for key, each in values.items()}
            names = [name for name in names if name not in own]
            if any(fields.values()):
                given.append((placement.name, fields))
        if names:
            raise errors.UnknownJoint('name', names[0], errors.one_of(scene.angle_names, names[0]))
        for doll, fields in given:
            self.simulation.set_state(doll, **fields)

    def _set(self, message: Odometry) -> None:
        frame = message.header.frame_id
        if frame not in (WORLD, self.settings.frame_id):
            raise errors.WrongForm('header.frame_id', frame, self.settings.frame_id)
        pose, twist = message.pose.pose, message.twist.twist
        q = pose.orientation
        orientation = unit_vector('pose.orientation', (q.x, q.y, q.z, q.w),
                                  'a quaternion x, y, z, w, not zero', 4)
        velocity, spin = (
            tuple(rotation.rotate(orientation, limited(
                self._counts, TOPIC, f'twist.{name}', vector, MAX_SPEED, 'the limit')).tolist())
            for name, vector in (('linear', twist.linear), ('angular', twist.angular)))
        p = pose.position
        self.simulation.set_state(message.child_frame_id, (p.x, p.y, p.z), orientation, velocity,
                                  spin)

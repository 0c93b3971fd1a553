"""Hears the first tracked body, by the names of REP 155 alone, and prints it as one JSON object.

    python test/humans_listener.py

Frame, angles and poses are those of the first stamp for which all of them have come.
"""
from __future__ import annotations

import json

import rclpy
from geometry_msgs.msg import PoseArray
from hri_msgs.msg import IdsList
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def numbers(position, orientation):
    return [position.x, position.y, position.z,
            orientation.x, orientation.y, orientation.z, orientation.w]


def stamp(header):
    return header.stamp.sec, header.stamp.nanosec


class Listener:
    """What has been heard."""

    def __init__(self, node):
        self.node, self.heard = node, {}
        self.frames, self.angles, self.poses = {}, {}, {}
        node.create_subscription(IdsList, '/humans/bodies/tracked', self.take_ids, 1)
        node.create_subscription(TFMessage, '/tf', self.take_frames, 100)
        node.create_subscription(PoseArray, '/ragdoll/poses', self.take_poses, 100)

    def take_ids(self, message):
        if 'ids' not in self.heard:
            self.heard['ids'] = list(message.ids)
            body = f'/humans/bodies/{message.ids[0]}'
            create = self.node.create_subscription
            create(JointState, f'{body}/joint_states', self.take_angles, 100)
            create(String, f'{body}/urdf', lambda text: self.heard.update(urdf=text.data), LATCHED)

    def take_frames(self, message):
        for each in message.transforms:
            if 'ids' in self.heard and each.child_frame_id == f'body_{self.heard["ids"][0]}':
                self.frames[stamp(each.header)] = numbers(each.transform.translation,
                                                          each.transform.rotation)

    def take_angles(self, message):
        self.angles[stamp(message.header)] = dict(zip(message.name, message.position, strict=True))

    def take_poses(self, message):
        self.poses[stamp(message.header)] = [numbers(pose.position, pose.orientation)
                                             for pose in message.poses]

    def common(self):
        return set(self.frames) & set(self.angles) & set(self.poses)


rclpy.init()
listener = Listener(rclpy.create_node('listener'))
while not listener.common() or 'urdf' not in listener.heard:
    rclpy.spin_once(listener.node)
first = min(listener.common())
print(json.dumps({**listener.heard, 'frame': listener.frames[first],
                  'angles': listener.angles[first], 'poses': listener.poses[first]}))
rclpy.shutdown()

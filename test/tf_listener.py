"""Hears a node's frames in a process of its own, and prints them as one JSON object.

    python test/tf_listener.py COUNT [NAMESPACE]

COUNT stamps for which all of /tf, joint_states and ~/poses have come; zero: the first of /tf alone.
"""
from __future__ import annotations

import json
import sys

import rclpy
from geometry_msgs.msg import PoseArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def numbers(position, orientation):
    return [position.x, position.y, position.z,
            orientation.x, orientation.y, orientation.z, orientation.w]


def stamp(header):
    return f'{header.stamp.sec}.{header.stamp.nanosec:09}'


def listen(count, space):
    heard = {'frames': {}, 'poses': {}, 'angles': {}, 'urdf': None}

    def take_frames(message):
        times = {stamp(each.header) for each in message.transforms}
        heard['frames'][','.join(times)] = [
            (each.header.frame_id, each.child_frame_id,
             numbers(each.transform.translation, each.transform.rotation))
            for each in message.transforms]

    def take_poses(message):
        heard['poses'][stamp(message.header)] = [
            numbers(pose.position, pose.orientation) for pose in message.poses]

    def take_angles(message):
        heard['angles'][stamp(message.header)] = dict(
            zip(message.name, message.position, strict=True))

    def take_urdf(message):
        heard['urdf'] = message.data

    node = rclpy.create_node('tf_listener')
    for kind, topic, take, qos in (
            (TFMessage, 'tf', take_frames, 100), (PoseArray, 'ragdoll/poses', take_poses, 100),
            (JointState, 'joint_states', take_angles, 100),
            (String, 'robot_description', take_urdf, LATCHED)):
        node.create_subscription(kind, f'{space}/{topic}', take, qos)

    def common():
        return heard['frames'].keys() & heard['poses'].keys() & heard['angles'].keys()

    while not heard['frames'] or (count and not (heard['urdf'] and len(common()) >= count)):
        rclpy.spin_once(node)
    return heard


if __name__ == '__main__':
    rclpy.init()
    print(json.dumps(listen(int(sys.argv[1]), ''.join(sys.argv[2:]))))

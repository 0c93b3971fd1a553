"""Moves a robot's frame in a process of its own, until a node's body has followed it.

    python test/tf_broadcaster.py BONE

Frames: world, map (latched on /tf_static, a quarter turn about z, 1 m up), base (on /tf, moving
for 1 s at 0.5 m/s along the x axis of map, then standing). Prints the poses of the bone BONE, its
index in ~/poses, as JSON, when the last two are equal and the frame stands.
"""
from __future__ import annotations

import json
import math
import sys

import rclpy
from geometry_msgs.msg import PoseArray, TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PERIOD = 0.02


def broadcast(bone):
    node, poses, sent = rclpy.create_node('tf_broadcaster'), [], [0]
    fixed = TransformStamped(child_frame_id='map')
    fixed.header.frame_id = 'world'
    fixed.transform.translation.z = 1.0
    fixed.transform.rotation.z = fixed.transform.rotation.w = math.sqrt(0.5)
    node.create_publisher(TFMessage, '/tf_static', LATCHED).publish(TFMessage(transforms=[fixed]))
    publisher = node.create_publisher(TFMessage, '/tf', 100)

    def send():
        if not publisher.get_subscription_count():
            return
        moving = TransformStamped(child_frame_id='base')
        moving.header.frame_id = 'map'
        moving.header.stamp.sec, rest = divmod(round(1e9 * PERIOD * sent[0]), 10 ** 9)
        moving.header.stamp.nanosec = rest
        moving.transform.translation.x = 0.5 * min(PERIOD * sent[0], 1.0)
        sent[0] += 1
        publisher.publish(TFMessage(transforms=[moving]))

    def take(message):
        at = message.poses[bone]
        poses.append([at.position.x, at.position.y, at.position.z, at.orientation.x,
                      at.orientation.y, at.orientation.z, at.orientation.w])

    node.create_timer(PERIOD, send)
    node.create_subscription(PoseArray, 'ragdoll/poses', take, 100)
    while PERIOD * sent[0] < 1.5 or poses[-2] != poses[-1]:
        rclpy.spin_once(node)
    return poses


if __name__ == '__main__':
    rclpy.init()
    print(json.dumps(broadcast(int(sys.argv[1]))))

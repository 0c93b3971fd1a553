"""Serialized message templates against rclpy's own classes and serialization."""
from __future__ import annotations

import dataclasses
import functools
import timeit

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.files.urdf import scene_to_urdf, to_urdf
from ragdoll_ros.model import rotation
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import DEFAULT_COLOR
from ragdoll_ros.physics.engine.protocol import GROUND, Contacts
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.messages.convert import (
    contact_poses,
    to_header,
    to_joint_state,
    to_multi_dof,
    to_point,
    to_pose,
    to_pose_array,
    to_vector,
)
from ragdoll_ros.ros.messages.interactive_markers import InteractiveMarkers
from ragdoll_ros.ros.messages.markers import (
    BROWN,
    MARKER_TYPES,
    RED,
    ROD_WIDTH,
    SceneMarkers,
    set_color,
)
from ragdoll_ros.ros.messages.serialized import (
    SerializedTemplate,
    deserialize_pose_array,
    serialize_pose_array,
)

STAMPS = (0, 1, 999_999_999, 1_795_257_907_785_147_064)


@pytest.mark.parametrize('frame', ['', 'w', 'wo', 'wor', 'world', 'a/longer/frame'])
@pytest.mark.parametrize('count', [1, 10, 100])
def test_packed_messages_are_what_rclpy_serializes(frame, count):
    random = np.random.default_rng(count)
    names = tuple(f'bone_{"x" * (k % 5)}{k}' for k in range(count))
    poses, twists = random.normal(size=(count, 7)), random.normal(size=(count, 6))
    angles, rates = random.normal(size=(2, count))
    for make, values in ((functools.partial(to_pose_array, frame), (poses,)),
                         (functools.partial(to_multi_dof, frame, names), (poses, twists)),
                         (functools.partial(to_joint_state, frame, names), (angles, rates))):
        template = SerializedTemplate.trace(make, *(value.shape for value in values))
        for stamp in STAMPS:
            assert_same(template.serialize(stamp, *values), make(stamp, *values))


def assert_same(data, message):
    """Serialized as rclpy does it, but for the bytes between, which rclpy leaves to chance."""
    assert len(data) == len(serialize_message(message))
    assert deserialize_message(data, type(message)) == message


def test_a_doll_without_joints_has_an_empty_joint_state():
    make = functools.partial(to_joint_state, 'world', ())
    template = SerializedTemplate.trace(make, (0,), (0,))
    assert_same(template.serialize(5, np.zeros(0), np.zeros(0)), make(5, np.zeros(0), np.zeros(0)))


@pytest.mark.parametrize('frame', ['', 'w', 'wo', 'wor', 'world', 'Wörld'])
@pytest.mark.parametrize('count', [0, 1, 7])
def test_poses_of_any_number_are_what_rclpy_serializes(frame, count):
    poses = np.random.default_rng(count).normal(size=(count, 7))
    for stamp in STAMPS:
        data = serialize_pose_array(frame, stamp, poses)
        assert_same(data, to_pose_array(frame, stamp, poses))
        assert deserialize_pose_array(data)[0] == stamp
        np.testing.assert_array_equal(deserialize_pose_array(data)[1], poses)


def test_a_message_that_has_its_numbers_in_another_order_is_refused():
    with pytest.raises(ValueError, match='order'):
        SerializedTemplate.trace(
            lambda stamp, poses: to_pose_array('world', stamp, poses[::-1]), (3, 7))


def plain_markers(frame, stamp, simulation, pushes=(), gone=0, before=()):
    """The MarkerArray of a simulation, in the message's own classes alone, from its meaning."""
    scene, state, header = simulation.scene, simulation.state, to_header(stamp, frame)
    array = MarkerArray(markers=[Marker(header=header, action=action) for action in before])
    for index, (name, bone) in enumerate(zip(scene.bone_names, scene.bones, strict=True)):
        for number, part in enumerate(bone.shape.primitives):
            pose = state.poses(index).compose(part.pose)
            marker = Marker(header=header, ns=name, id=number, type=MARKER_TYPES[part.kind],
                            pose=to_pose(np.concatenate(pose).tolist()),
                            scale=to_vector(part.size))
            set_color(marker, bone.color or DEFAULT_COLOR)
            array.markers.append(marker)
    if simulation.swings is not None:
        marker = Marker(header=header, ns='swings', type=Marker.LINE_LIST)
        marker.scale.x, marker.pose.orientation.w = ROD_WIDTH, 1.0
        marker.points = [to_point(end) for rod in zip(
            simulation.swings.roots, simulation.swings.positions, strict=True) for end in rod]
        set_color(marker, BROWN)
        array.markers.append(marker)
    for number, push in enumerate(pushes):
        bone = scene.bone_index(push.bone)
        tail, tip = push.arrow(state.positions[bone], state.orientations[bone])
        marker = Marker(header=header, ns='push', id=number, type=Marker.ARROW, pose=to_pose(
            (*tail, *rotation.shortest_arc(np.array([1.0, 0, 0]), tip - tail))))
        marker.scale = to_vector((np.linalg.norm(tip - tail), 0.04, 0.06))
        set_color(marker, RED)
        array.markers.append(marker)
    array.markers += [Marker(header=header, ns='push', id=len(pushes) + number,
                             action=Marker.DELETE) for number in range(gone)]
    return array


@pytest.mark.parametrize('frame', ['w', 'worl', 'world'])
@pytest.mark.parametrize('name', ['drop', 'crowd', 'ponytail'])
def test_markers_are_what_rclpy_serializes(frame, name):
    """Of one doll, of several whose names differ in length, with swings; with one push and two."""
    with Simulation(load_scene(name)) as simulation:
        bones = simulation.scene.bone_names
        first, second = Push(bones[0], (100.0, 0, 0)), Push(bones[-1], (0, 0, -300.0))
        markers = SceneMarkers(simulation.scene, frame)
        for stamp, pushes, more in (
                (0, (), {'before': [Marker.DELETEALL]}), (1, (), {}), (STAMPS[-1], (first,), {}),
                (3, (first, second), {}), (4, (second,), {'gone': 1}), (5, (), {'gone': 1}),
                (6, (), {})):
            simulation.advance()
            data = markers.serialize(stamp, simulation.state, pushes, simulation.swings)
            assert_same(data, rounded(plain_markers(frame, stamp, simulation, pushes, **more)))


def rounded(message):
    """The message as it comes out of its serialized form: colours have fewer digits there."""
    return deserialize_message(serialize_message(message), type(message))


@pytest.mark.parametrize('frame', ['w', 'worl', 'world'])
@pytest.mark.parametrize('name', ['drop', 'crowd'])
def test_updates_of_handles_are_what_rclpy_serializes(frame, name):
    with Simulation(load_scene(name)) as simulation:
        scene = simulation.scene
        handles = InteractiveMarkers(scene, frame, '/stage/ragdoll')
        for number in (1, 2, 2 ** 53 + 1):
            state = simulation.advance()
            assert_same(handles.serialize_update(number, state), InteractiveMarkerUpdate(
                server_id='/stage/ragdoll', seq_num=number, type=InteractiveMarkerUpdate.UPDATE,
                poses=[InteractiveMarkerPose(header=Header(frame_id=frame), name=bone, pose=to_pose(
                    np.concatenate(state.poses(index)).tolist()))
                    for index, bone in enumerate(scene.bone_names)]))


def test_a_contact_s_pose_has_x_along_its_normal():
    assert contact_poses(Contacts.of([])).shape == (0, 7)
    normals = np.array([(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0.6, 0, -0.8), (0, -1.0, 0)])
    poses = contact_poses(Contacts.of([[0, GROUND, GROUND, *range(3), *normal, *8 * [0]]
                                       for normal in normals]))
    np.testing.assert_array_equal(poses[:, :3], np.arange(3.0)[None].repeat(5, 0))
    np.testing.assert_allclose(rotation.rotate(poses[:, 3:], np.array([1.0, 0, 0])),
                               rotation.normalized(normals), atol=1e-15)
    np.testing.assert_allclose(poses[:, 3:], [rotation.shortest_arc(
        np.array([1.0, 0, 0]), normal) for normal in normals], atol=1e-15)


def test_a_template_makes_no_messages():
    """It is traced from what ``make`` gives, and from then on without it."""
    made = []

    def make(*values):
        made.append(to_pose_array('world', *values))
        return made[-1]

    template = SerializedTemplate.trace(make, (4, 7))
    del made[:]
    template.serialize(1, np.random.default_rng(0).normal(size=(4, 7)))
    assert not made


@pytest.mark.slow
def test_packing_is_worth_it():
    poses = np.random.default_rng(0).normal(size=(1000, 7))
    make = functools.partial(to_pose_array, 'world')
    template = SerializedTemplate.trace(make, poses.shape)
    plain = min(timeit.repeat(lambda: serialize_message(make(1, poses)), number=1, repeat=5))
    quick = min(timeit.repeat(lambda: template.serialize(1, poses), number=1, repeat=5))
    assert quick < plain / 20, 'measured: a hundredth'


def test_a_field_shares_what_is_equal():
    """Each doll's URDF is the one it would have by itself, under its own name."""
    field = load_scene('field')
    few = dataclasses.replace(field, dolls=field.dolls[:12])
    text = scene_to_urdf(few)
    for placement in few.dolls:
        alone = to_urdf(placement.doll.renamed(functools.partial(few.qualified, placement)))
        lines = alone.splitlines()[2:-1]
        assert '\n'.join(lines) in text

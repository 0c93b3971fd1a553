"""Packed messages against rclpy's own serialization; markers against the bones."""
from __future__ import annotations

import functools
import timeit

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from specimens import SPECIMENS
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.push import ARROW, Push
from ragdoll_ros.model.ragdoll import DEFAULT_COLOR, Bone, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.handles import GROWTH, Handles
from ragdoll_ros.ros.markers import BROWN, KINDS, RED, ROD, Markers, paint
from ragdoll_ros.ros.messages import (
    contact_poses,
    to_header,
    to_joint_state,
    to_multi_dof,
    to_point,
    to_pose,
    to_pose_array,
    to_vector,
)
from ragdoll_ros.ros.packed import Packed, packed_poses, poses_in
from ragdoll_ros.ros.stamps import Stamps

STAMPS = (0, 1, 999_999_999, 1_795_257_907_785_147_064)


@pytest.mark.parametrize('frame', ['', 'w', 'wo', 'wor', 'world', 'a/longer/frame'])
@pytest.mark.parametrize('count', [1, 10, 100])
def test_packed_messages_are_what_rclpy_serializes(frame, count):
    random = np.random.default_rng(count)
    names = tuple(f'bone_{"x" * (k % 5)}{k}' for k in range(count))
    poses, twists = random.normal(size=(count, 7)), random.normal(size=(count, 6))
    angles = random.normal(size=count)
    for make, values in ((functools.partial(to_pose_array, frame), (poses,)),
                         (functools.partial(to_multi_dof, frame, names), (poses, twists)),
                         (functools.partial(to_joint_state, frame, names), (angles,))):
        packed = Packed(make, *(value.shape for value in values))
        for stamp in STAMPS:
            assert_same(packed.message(stamp, *values), make(stamp, *values))


def assert_same(data, message):
    """Serialized as rclpy does it, but for the bytes between, which rclpy leaves to chance."""
    assert len(data) == len(serialize_message(message))
    assert deserialize_message(data, type(message)) == message


def test_a_doll_without_joints_has_an_empty_joint_state():
    make = functools.partial(to_joint_state, 'world', ())
    packed = Packed(make, (0,))
    assert_same(packed.message(5, np.zeros(0)), make(5, np.zeros(0)))


@pytest.mark.parametrize('frame', ['', 'w', 'wo', 'wor', 'world', 'Wörld'])
@pytest.mark.parametrize('count', [0, 1, 7])
def test_poses_of_any_number_are_what_rclpy_serializes(frame, count):
    poses = np.random.default_rng(count).normal(size=(count, 7))
    for stamp in STAMPS:
        data = packed_poses(frame, stamp, poses)
        assert_same(data, to_pose_array(frame, stamp, poses))
        assert poses_in(data)[0] == stamp
        np.testing.assert_array_equal(poses_in(data)[1], poses)


def test_a_message_that_has_its_numbers_in_another_order_is_not_packed():
    with pytest.raises(ValueError, match='order'):
        Packed(lambda stamp, poses: to_pose_array('world', stamp, poses[::-1]), (3, 7))


def plain_markers(frame, stamp, simulation, pushes=(), gone=0, before=()):
    """The MarkerArray of a simulation, in the message's own classes alone, from its meaning."""
    scene, state, header = simulation.scene, simulation.state, to_header(stamp, frame)
    array = MarkerArray(markers=[Marker(header=header, action=action) for action in before])
    for index, (name, bone) in enumerate(zip(scene.bone_names, scene.bones, strict=True)):
        for number, part in enumerate(bone.shape.primitives):
            pose = state.poses(index).compose(part.pose)
            marker = Marker(header=header, ns=name, id=number, type=KINDS[part.kind],
                            pose=to_pose(np.concatenate(pose).tolist()),
                            scale=to_vector(part.size))
            paint(marker, bone.color or DEFAULT_COLOR)
            array.markers.append(marker)
    if simulation.swings is not None:
        marker = Marker(header=header, ns='swings', type=Marker.LINE_LIST)
        marker.scale.x, marker.pose.orientation.w = ROD, 1.0
        marker.points = [to_point(end) for rod in zip(
            simulation.swings.roots, simulation.swings.positions, strict=True) for end in rod]
        paint(marker, BROWN)
        array.markers.append(marker)
    for number, push in enumerate(pushes):
        bone = scene.bone_index(push.bone)
        tail, tip = push.arrow(state.positions[bone], state.orientations[bone])
        marker = Marker(header=header, ns='push', id=number, type=Marker.ARROW, pose=to_pose(
            (*tail, *rotation.shortest_arc(np.array([1.0, 0, 0]), tip - tail))))
        marker.scale = to_vector((np.linalg.norm(tip - tail), 0.04, 0.06))
        paint(marker, RED)
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
        markers = Markers(simulation.scene, frame)
        for stamp, pushes, more in (
                (0, (), {'before': [Marker.DELETEALL]}), (1, (), {}), (STAMPS[-1], (first,), {}),
                (3, (first, second), {}), (4, (second,), {'gone': 1}), (5, (), {'gone': 1}),
                (6, (), {})):
            simulation.advance()
            data = markers.message(stamp, simulation.state, pushes, simulation.swings)
            assert_same(data, rounded(plain_markers(frame, stamp, simulation, pushes, **more)))


def rounded(message):
    """The message as it comes out of its serialized form: colours have fewer digits there."""
    return deserialize_message(serialize_message(message), type(message))


@pytest.mark.parametrize('frame', ['w', 'worl', 'world'])
@pytest.mark.parametrize('name', ['drop', 'crowd'])
def test_updates_of_handles_are_what_rclpy_serializes(frame, name):
    with Simulation(load_scene(name)) as simulation:
        scene = simulation.scene
        handles = Handles(scene, frame, '/stage/ragdoll')
        for number in (1, 2, 2 ** 53 + 1):
            state = simulation.advance()
            assert_same(handles.update(number, state), InteractiveMarkerUpdate(
                server_id='/stage/ragdoll', seq_num=number, type=InteractiveMarkerUpdate.UPDATE,
                poses=[InteractiveMarkerPose(header=Header(frame_id=frame), name=bone, pose=to_pose(
                    np.concatenate(state.poses(index)).tolist()))
                    for index, bone in enumerate(scene.bone_names)]))


def test_a_contact_s_pose_has_x_along_its_normal():
    class Contact:
        def __init__(self, normal):
            self.position, self.normal = np.arange(3.0), np.array(normal)

    assert contact_poses([]).shape == (0, 7)
    normals = np.array([(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0.6, 0, -0.8), (0, -2.0, 0)])
    poses = contact_poses([Contact(normal) for normal in normals])
    np.testing.assert_array_equal(poses[:, :3], np.arange(3.0)[None].repeat(5, 0))
    np.testing.assert_allclose(rotation.rotate(poses[:, 3:], np.array([1.0, 0, 0])),
                               rotation.normalized(normals), atol=1e-15)
    np.testing.assert_allclose(poses[:, 3:], [rotation.shortest_arc(
        np.array([1.0, 0, 0]), normal) for normal in normals], atol=1e-15)


def test_packing_is_worth_it():
    poses = np.random.default_rng(0).normal(size=(1000, 7))
    make = functools.partial(to_pose_array, 'world')
    packed = Packed(make, poses.shape)
    plain = min(timeit.repeat(lambda: serialize_message(make(1, poses)), number=1, repeat=5))
    quick = min(timeit.repeat(lambda: packed.message(1, poses), number=1, repeat=5))
    assert quick < plain / 20, 'measured: a hundredth'


class RosTime:
    """ROS time as a test sets it, ns, and stamps that go by it."""

    def __init__(self, now):
        self.now = now
        self.stamps = Stamps(lambda: self.now)

    def stamp(self, time):
        self.stamps.follow(time)
        return self.stamps.at(time, is_clock=False)


def test_stamps_rise_by_one_tick_over_a_new_start():
    ros = RosTime(100)
    before = [ros.stamp(time) for time in (0, 10, 20)]
    ros.stamps.begin_again(20, 10)
    after = [ros.stamp(time) for time in (0, 10)]
    assert before + after == [100, 110, 120, 130, 140]
    assert ros.stamps.at(0, is_clock=True) == 0


def test_stamps_are_set_to_ros_time_at_a_reset_and_after_a_pause_and_never_back():
    """And at no other time, as the steps between are to be ticks."""
    ros = RosTime(100)
    assert [ros.stamp(time) for time in (10, 20)] == [110, 120]
    ros.now = 500
    assert ros.stamp(30) == 130
    ros.stamps.catch_up(30)
    assert [ros.stamp(time) for time in (40, 50)] == [510, 520]
    ros.now = 900
    ros.stamps.begin_again(50, 10)
    ros.stamps.catch_up(0)
    assert [ros.stamp(time) for time in (0, 10)] == [900, 910]
    ros.now = 300
    ros.stamps.catch_up(10)
    assert ros.stamp(20) == 920


@pytest.mark.parametrize('first', [50, 504_770_000_000], ids=['behind', 'ahead'])
def test_stamps_begin_with_ros_time_also_where_it_begins_later(first):
    """A /clock that comes after the node; one that begins anew, as a recording's in a loop."""
    ros = RosTime(0)
    assert [ros.stamp(time) for time in (10, 20, 1000)] == [10, 20, 1000]
    ros.now = first
    assert [ros.stamp(time) for time in (1010, 1020)] == [first, first + 10]
    ros.now = first + 5_000_000_000
    assert ros.stamp(1030) == first + 20
    ros.now = 7
    assert [ros.stamp(time) for time in (1040, 1050)] == [7, 17]


def test_a_computer_s_clock_that_is_set_back_a_little_moves_no_stamp():
    ros = RosTime(5_000_000_000)
    ros.now -= 500_000_000
    assert ros.stamp(10) == 5_000_000_010


@pytest.fixture(params=SPECIMENS)
def lone(request):
    """A simulation of one bone of each shape, turned and away from the origin."""
    turn = tuple(rotation.from_rpy(0.3, -0.4, 0.5))
    bone = Bone('bone', SPECIMENS[request.param], 2.0, (1.0, 2.0, 3.0), turn, color=(1, 0, 0, 1))
    with Simulation(Scene('lone', (Placement(Ragdoll('lone', (bone,))),))) as simulation:
        yield simulation


def heard(data):
    """The MarkerArray of serialized markers."""
    return deserialize_message(data, MarkerArray)


def test_markers_fill_the_shape_of_a_bone(lone):
    """The markers' farthest points along any direction are those of the bone's own shape."""
    array = heard(Markers(lone.scene, 'map').message(7, lone.state, ()))
    assert {marker.header.frame_id for marker in array.markers} == {'map'}
    directions = rotation.normalized(np.random.default_rng(3).normal(size=(50, 3)))
    reach = np.max([_support(marker, directions) for marker in array.markers
                    if marker.action == Marker.ADD], axis=0)
    turn, centre = lone.state.orientations[0], lone.state.positions[0]
    inner = rotation.rotate(rotation.inverse(turn), directions)
    expected = directions @ centre + lone.scene.bones[0].shape.reach(inner)
    np.testing.assert_allclose(reach, expected, atol=1e-12)


def test_ghosts_to_drag_fill_the_shape_of_a_bone_too(lone):
    """In the bone's own frame, each part larger by GROWTH about its own middle."""
    handles = Handles(lone.scene, 'map', '/ragdoll')
    directions = rotation.normalized(np.random.default_rng(4).normal(size=(50, 3)))
    ghosts = handles.markers(lone.state)[0].controls[0].markers
    for ghost in ghosts:
        scale = ghost.scale
        scale.x, scale.y, scale.z = scale.x / GROWTH, scale.y / GROWTH, scale.z / GROWTH
    reach = np.max([_support(ghost, directions) for ghost in ghosts], axis=0)
    np.testing.assert_allclose(reach, lone.scene.bones[0].shape.reach(directions), atol=1e-12)


def _support(marker, directions):
    """How far a marker reaches along each direction, from the meaning RViz gives its scale."""
    pose, scale = marker.pose, marker.scale
    turn = np.array([pose.orientation.x, pose.orientation.y, pose.orientation.z,
                     pose.orientation.w])
    inner = rotation.rotate(rotation.inverse(turn), directions)
    half = np.array([scale.x, scale.y, scale.z]) / 2
    reach = {Marker.CUBE: lambda: np.abs(inner) @ half,
             Marker.SPHERE: lambda: np.linalg.norm(inner * half, axis=1),
             Marker.CYLINDER: lambda: np.abs(inner[:, 2]) * half[2]
             + np.linalg.norm(inner[:, :2] * half[:2], axis=1)}[marker.type]()
    return directions @ np.array([pose.position.x, pose.position.y, pose.position.z]) + reach


@pytest.mark.parametrize('local', [False, True])
def test_the_tip_of_a_push_s_arrow_is_where_it_attacks(local):
    with Simulation(load_scene('drop')) as simulation:
        state, name = simulation.state, 'left_shin'
        bone = simulation.scene.bone_index(name)
        push = Push(name, (300.0, -400.0, 0.0), point=(0.01, 0.02, 0.1), local=local)
        markers = Markers(simulation.scene, 'world')
        arrow = heard(markers.message(0, state, [push])).markers[-1]
        assert (arrow.type, arrow.action) == (Marker.ARROW, Marker.ADD)
        turn = np.array([arrow.pose.orientation.x, arrow.pose.orientation.y,
                         arrow.pose.orientation.z, arrow.pose.orientation.w])
        tail = np.array([arrow.pose.position.x, arrow.pose.position.y, arrow.pose.position.z])
        tip = tail + rotation.rotate(turn, [arrow.scale.x, 0, 0])
        point = push.point
        if local:
            point = rotation.rotate(state.orientations[bone], point)
        np.testing.assert_allclose(tip, state.positions[bone] + point, atol=1e-12)
        assert arrow.scale.x == pytest.approx(ARROW * 0.5 ** 0.5)
        gone = heard(markers.message(1, state, [])).markers[-1]
        assert (gone.ns, gone.id, gone.action) == (arrow.ns, arrow.id, Marker.DELETE)
        assert all(marker.action == Marker.ADD
                   for marker in heard(markers.message(2, state, [])).markers)


def test_each_marker_is_its_own():
    with Simulation(load_scene('crowd')) as simulation:
        array = heard(Markers(simulation.scene, 'world').message(0, simulation.state, ()))
        keys = [(marker.ns, marker.id) for marker in array.markers
                if marker.action == Marker.ADD]
        assert len(set(keys)) == len(keys) == len(simulation.scene.bone_names)


def shown(screen, array):
    """What RViz shows once it has taken an array in, by the meaning of each action."""
    for marker in array.markers:
        if marker.action == Marker.DELETEALL:
            screen.clear()
        elif marker.action == Marker.DELETE:
            screen.pop((marker.ns, marker.id), None)
        else:
            screen[marker.ns, marker.id] = marker
    return screen


def test_another_scene_leaves_nothing_of_the_last_one():
    """Also no arrow of a push that was in flight, and it erases once: RViz builds all anew then."""
    screen = {}
    for name in ('crowd', 'ponytail', 'drop'):
        with Simulation(load_scene(name)) as simulation:
            markers = Markers(simulation.scene, 'world')
            push = Push(simulation.scene.bone_names[0], (100.0, 0.0, 0.0))
            swings = simulation.swings if name == 'ponytail' else None
            for pushes in ([], [push]):
                array = heard(markers.message(0, simulation.state, pushes, swings))
                shown(screen, array)
            assert {name for name, _ in screen} - {'push', 'swings'} == set(
                simulation.scene.bone_names)
            assert ('swings' in {name for name, _ in screen}) == (name == 'ponytail')
            assert Marker.DELETEALL not in {marker.action for marker in array.markers}


def test_the_benchmark_times_all_parts(ros, monkeypatch):
    import rclpy

    from ragdoll_ros.ros import bench
    monkeypatch.setattr(bench, 'ROUNDS', 1)
    node = rclpy.create_node('bench')
    costs = bench.row(node, load_scene('drop'), 'draft', 0)
    node.destroy_node()
    assert set(costs) == {'simulation', 'conversion', 'messages', 'bare engine', 'bare publish'}
    assert min(costs.values()) > 0

"""Markers and interactive markers against the bones."""
from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from specimens import OCTAHEDRON, SPECIMENS
from visualization_msgs.msg import Marker, MarkerArray

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.plane import Plane
from ragdoll_ros.model.push import ARROW_LENGTH, Push
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Material, Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.model.static_body import StaticBody
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.messages.contact_wrenches import to_contact_wrenches
from ragdoll_ros.ros.messages.convert import contact_poses
from ragdoll_ros.ros.messages.interactive_markers import SCALE, InteractiveMarkers
from ragdoll_ros.ros.messages.markers import SceneMarkers
from ragdoll_ros.ros.ticker import PollThrottle

WITH_A_HULL = SPECIMENS | {'hull': OCTAHEDRON}


@pytest.fixture(params=WITH_A_HULL)
def lone(request):
    """A simulation of one bone of each shape, turned and away from the origin."""
    turn = tuple(rotation.from_rpy(0.3, -0.4, 0.5))
    bone = Bone('bone', WITH_A_HULL[request.param], 2.0, (1.0, 2.0, 3.0), turn, color=(1, 0, 0, 1))
    with Simulation(Scene('lone', (Placement(Ragdoll('lone', (bone,))),))) as simulation:
        yield simulation


def heard(data):
    """The MarkerArray of serialized markers."""
    return deserialize_message(data, MarkerArray)


def test_markers_fill_the_shape_of_a_bone(lone):
    """The markers' farthest points along any direction are those of the bone's own shape."""
    array = heard(SceneMarkers(lone.scene, 'map').serialize(7, lone.state, ()))
    assert {marker.header.frame_id for marker in array.markers} == {'map'}
    directions = rotation.normalized(np.random.default_rng(3).normal(size=(50, 3)))
    reach = np.max([_support(marker, directions) for marker in array.markers
                    if marker.action == Marker.ADD], axis=0)
    turn, centre = lone.state.orientations[0], lone.state.positions[0]
    inner = rotation.rotate(rotation.inverse(turn), directions)
    expected = directions @ centre + lone.scene.bones[0].shape.support(inner)
    np.testing.assert_allclose(reach, expected, atol=1e-12)


def test_markers_show_static_bodies_where_they_stand(lone):
    body = StaticBody('wall', Box((0.1, 2.0, 3.0)), (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 1.0))
    walled = dataclasses.replace(lone.scene, bodies=(body,))
    array = heard(SceneMarkers(walled, 'map').serialize(7, lone.state, ()))
    marker, = [marker for marker in array.markers if marker.ns == 'bodies/wall']
    place, turn, size = marker.pose.position, marker.pose.orientation, marker.scale
    assert (place.x, place.y, place.z) == body.position
    assert (turn.x, turn.y, turn.z, turn.w) == body.orientation
    assert (marker.type, size.x, size.y, size.z) == (Marker.CUBE, 0.1, 2.0, 3.0)


def test_markers_show_a_plane_as_a_square_whose_face_is_up(lone):
    body = StaticBody('slope', Plane(), (1.0, 2.0, 3.0), (0.0, 0.1, 0.0, 1.0))
    sloping = dataclasses.replace(lone.scene, bodies=(body,))
    array = heard(SceneMarkers(sloping, 'map').serialize(7, lone.state, ()))
    marker, = [marker for marker in array.markers if marker.ns == 'bodies/slope']
    assert marker.type == Marker.TRIANGLE_LIST
    place, turn = marker.pose.position, marker.pose.orientation
    assert (place.x, place.y, place.z) == body.position
    corners = rotation.rotate((turn.x, turn.y, turn.z, turn.w), np.array(
        [(point.x, point.y, point.z) for point in marker.points])).reshape(2, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(rotation.normalized(normals), [body.normal] * 2, atol=1e-12)
    assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(100.0 ** 2)


def test_contact_wrenches_name_what_touches_and_bear_the_weight():
    """A box of 1 kg on a table, another on it."""
    box = Ragdoll('box', (Bone('box', Box((0.2, 0.2, 0.2)), 1.0, (0, 0, 0)),))
    table = StaticBody('table', Box((1, 1, 1)))
    scene = Scene('pile', (Placement(box, 'low', (0, 0, 0.6)), Placement(box, 'high', (0, 0, 0.8))),
                  material=Material(restitution=0.0), bodies=(table,))
    with Simulation(scene) as simulation:
        simulation.run(10)
        message = to_contact_wrenches('map', scene, 5, simulation.contacts)
        places = contact_poses(simulation.contacts)[:, :3]
    assert (message.header.frame_id, message.header.stamp.nanosec) == ('map', 5)
    force = {}
    for name, wrench in zip(message.joint_names, message.wrench, strict=True):
        force[name] = force.get(name, 0.0) + wrench.force.z
    between = next(name for name in force if 'table' not in name)
    assert between in ('low/box//high/box', 'high/box//low/box')
    sign = -1 if between.startswith('low') else 1
    assert force == pytest.approx({'low/box//table': 2 * 9.8, between: sign * 9.8}, rel=1e-4)
    assert [(one.translation.x, one.translation.y, one.translation.z)
            for one in message.transforms] == [tuple(place) for place in places.tolist()]


def test_ghosts_to_drag_fill_the_shape_of_a_bone_too(lone):
    """In the bone's own frame, each part larger by SCALE about its own middle."""
    handles = InteractiveMarkers(lone.scene, 'map', '/ragdoll')
    directions = rotation.normalized(np.random.default_rng(4).normal(size=(50, 3)))
    ghosts = handles.at(lone.state)[0].controls[0].markers
    for ghost in ghosts:
        scale = ghost.scale
        scale.x, scale.y, scale.z = scale.x / SCALE, scale.y / SCALE, scale.z / SCALE
    reach = np.max([_support(ghost, directions) for ghost in ghosts], axis=0)
    np.testing.assert_allclose(reach, lone.scene.bones[0].shape.support(directions), atol=1e-12)


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
             + np.linalg.norm(inner[:, :2] * half[:2], axis=1),
             Marker.TRIANGLE_LIST: lambda: (inner @ np.array(
                 [[point.x * scale.x, point.y * scale.y, point.z * scale.z]
                  for point in marker.points]).T).max(axis=1)}[marker.type]()
    return directions @ np.array([pose.position.x, pose.position.y, pose.position.z]) + reach


@pytest.mark.parametrize('local', [False, True])
def test_the_tip_of_a_push_s_arrow_is_where_it_attacks(local):
    with Simulation(load_scene('drop')) as simulation:
        state, name = simulation.state, 'left_shin'
        bone = simulation.scene.bone_index(name)
        push = Push(name, (300.0, -400.0, 0.0), point=(0.01, 0.02, 0.1), local=local)
        markers = SceneMarkers(simulation.scene, 'world')
        arrow = heard(markers.serialize(0, state, [push])).markers[-1]
        assert (arrow.type, arrow.action) == (Marker.ARROW, Marker.ADD)
        turn = np.array([arrow.pose.orientation.x, arrow.pose.orientation.y,
                         arrow.pose.orientation.z, arrow.pose.orientation.w])
        tail = np.array([arrow.pose.position.x, arrow.pose.position.y, arrow.pose.position.z])
        tip = tail + rotation.rotate(turn, [arrow.scale.x, 0, 0])
        point = push.point
        if local:
            point = rotation.rotate(state.orientations[bone], point)
        np.testing.assert_allclose(tip, state.positions[bone] + point, atol=1e-12)
        assert arrow.scale.x == pytest.approx(ARROW_LENGTH * 0.5 ** 0.5)
        gone = heard(markers.serialize(1, state, [])).markers[-1]
        assert (gone.ns, gone.id, gone.action) == (arrow.ns, arrow.id, Marker.DELETE)
        assert all(marker.action == Marker.ADD
                   for marker in heard(markers.serialize(2, state, [])).markers)


def test_each_marker_is_its_own():
    with Simulation(load_scene('crowd')) as simulation:
        array = heard(SceneMarkers(simulation.scene, 'world').serialize(0, simulation.state, ()))
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
            markers = SceneMarkers(simulation.scene, 'world')
            push = Push(simulation.scene.bone_names[0], (100.0, 0.0, 0.0))
            swings = simulation.swings if name == 'ponytail' else None
            for pushes in ([], [push]):
                array = heard(markers.serialize(0, simulation.state, pushes, swings))
                shown(screen, array)
            assert {name for name, _ in screen} - {'push', 'swings'} == set(
                simulation.scene.bone_names)
            assert ('swings' in {name for name, _ in screen}) == (name == 'ponytail')
            assert Marker.DELETEALL not in {marker.action for marker in array.markers}


def test_the_benchmark_times_all_parts(ros, monkeypatch):
    import rclpy

    from ragdoll_ros.ros.tools import bench
    monkeypatch.setattr(bench, 'ROUNDS', 1)
    node = rclpy.create_node('bench')
    costs = bench.row(node, load_scene('drop'), 'draft', 0)
    node.destroy_node()
    assert set(costs) == {
        'simulation', 'guarded', 'conversion', 'messages', 'base engine', 'base publish'}
    assert min(costs.values()) > 0


def looks_of(throttle, period, wakes):
    """Whether a throttle is open before each wake of a timer and, after it, still is."""
    found = []
    for wake in range(1, wakes + 1):
        before = throttle.is_open
        throttle.wake(wake * period)
        found.append((before, throttle.is_open))
    return found


def test_a_throttle_is_open_now_and_then_and_always_where_wakes_are_rare():
    """What is gathered in time is also gone through, though the timer comes first."""
    often = looks_of(PollThrottle(50), 10, 40)
    assert 2 * 40 // 5 <= sum(before for before, _ in often) <= 2 * 40 // 4
    assert sum(before and after for before, after in often) >= 40 // 6
    assert all(before and after for before, after in looks_of(PollThrottle(50), 60, 40))

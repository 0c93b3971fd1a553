"""A client that speaks RViz's protocol drags bones of a running node, over DDS."""
from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion
from rclpy.parameter import Parameter
from rviz_client import QOS, RvizClient
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerUpdate,
    Marker,
)
from visualization_msgs.srv import GetInteractiveMarkers

from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.ros.inputs import interactive_marker_server

HERE = Pose(position=Point(x=0.0, y=0.0, z=1.0), orientation=Quaternion(w=1.0))


@pytest.fixture
def node(make_node, peer, monkeypatch):
    """A node without gravity that runs as it likes beside the peer, which may be slow."""
    monkeypatch.setattr(interactive_marker_server, 'CLIENT_TIMEOUT', 60 * SECOND)
    node = make_node(scene='flight')
    peer.executor_.add_node(node)
    return node


@pytest.fixture
def client(node, peer):
    client = RvizClient(peer)
    client.start()
    return client


def place(node, name):
    return node.simulation.state.positions[node.simulation.scene.bone_index(name)]


def at(message):
    return np.array((message.x, message.y, message.z))


def test_the_service_gives_a_marker_for_each_bone_that_rviz_can_drag(node, peer):
    client = RvizClient(peer)
    answer = client.start()
    assert [marker.name for marker in answer.markers] == list(node.simulation.scene.bone_names)
    for marker in answer.markers:
        # A stamp of zero: feedback comes in the same frame. No controls: RViz disconnects.
        assert (marker.header.frame_id, marker.header.stamp.sec) == ('world', 0)
        control, = marker.controls
        assert control.interaction_mode == InteractiveMarkerControl.MOVE_3D
        assert all(ghost.type in (Marker.CUBE, Marker.SPHERE, Marker.CYLINDER)
                   and ghost.header.frame_id == '' for ghost in control.markers)
        bone = node.simulation.scene.bones[node.simulation.scene.bone_index(marker.name)]
        assert max(at(control.markers[0].scale)) == pytest.approx(
            2 * max(bone.shape.half_extents), rel=0.05)


def test_quality_of_service_is_that_of_the_original_server(node, peer):
    update, = node.get_publishers_info_by_topic('/ragdoll/interactive/update')
    feedback, = node.get_subscriptions_info_by_topic('/ragdoll/interactive/feedback')
    for profile in (update.qos_profile, feedback.qos_profile):
        assert (profile.reliability, profile.durability) == (QOS.reliability, QOS.durability)


def test_updates_come_in_sequence_and_follow_the_bones(node, peer, client):
    client.press('torso')
    client.move(0.3, 0.0, 1.4)
    peer.wait(lambda: len(client.seen) > 30)
    client.release()
    assert client.resets == 0
    head = client.seen[-1].poses[1]
    assert head.name == 'head'
    node.pause(True)
    peer.wait(lambda: at(client.markers['head'].pose.position)
              == pytest.approx(place(node, 'head'), abs=1e-9))


def test_without_subscriber_no_update_is_made(node, peer):
    peer.wait(lambda: node.simulation.time > SECOND // 2)
    answer = peer.call(GetInteractiveMarkers, 'ragdoll/interactive/get_interactive_markers',
                       GetInteractiveMarkers.Request())
    assert answer.sequence_number == 1


def test_a_drag_takes_the_point_under_the_mouse_and_the_bone_follows(node, peer, client):
    forearm = client.markers['left_forearm'].pose
    tip = at(forearm.position) + rotation.rotate(
        np.array((forearm.orientation.x, forearm.orientation.y, forearm.orientation.z,
                  forearm.orientation.w)), np.array((0.0, 0.09, 0.01)))
    client.press('left_forearm', tuple(tip.tolist()))
    peer.wait(lambda: node.simulation.grabs)
    grab, = node.simulation.grabs
    assert grab.bone == 'left_forearm'
    assert grab.point == pytest.approx((0, 0.09, 0.01), abs=1e-9)
    assert grab.target == pytest.approx(tip, abs=1e-9)
    x, y, z = at(forearm.position)
    client.move(x + 0.3, y, z + 0.1)
    peer.wait(lambda: node.simulation.grabs[0].target != grab.target)
    start, target = node.simulation.time, tip + np.array((0.3, 0, 0.1))
    assert node.simulation.grabs[0].target == pytest.approx(target, abs=1e-9)

    def miss():
        index = node.simulation.scene.bone_index('left_forearm')
        state = node.simulation.state
        return np.linalg.norm(state.positions[index] + rotation.rotate(
            state.orientations[index], np.array(grab.point)) - target)

    peer.wait(lambda: miss() < 0.05)
    assert node.simulation.time - start < 0.3 * SECOND
    client.release()
    peer.wait(lambda: not node.simulation.grabs)
    assert node.input_counts.refused == {}


def test_a_still_marker_is_dragged_by_its_pose_alone(node, peer, client):
    """As a client without a point under its mouse does."""
    client.press('head')
    peer.wait(lambda: node.simulation.grabs)
    assert node.simulation.grabs[0].point == (0, 0, 0)
    client.move(0.0, 0.0, 2.0)
    peer.wait(lambda: place(node, 'head')[2] > 1.8)


def test_two_clients_drag_two_bones_and_two_rviz_are_not_taken_for_one(node, peer, client):
    other = RvizClient(peer)
    other.start()
    client.press('left_shin')
    other.press('right_forearm')
    peer.wait(lambda: len(node.simulation.grabs) == 2)
    left, right = place(node, 'left_shin').copy(), place(node, 'right_forearm').copy()
    for step in range(1, 11):
        client.move(*(left + step * np.array((0.03, 0, 0))).tolist())
        other.move(*(right + step * np.array((0, 0, 0.03))).tolist())
    peer.wait(lambda: place(node, 'left_shin')[0] > left[0] + 0.2
              and place(node, 'right_forearm')[2] > right[2] + 0.2)
    client.release()
    peer.wait(lambda: [grab.bone for grab in node.simulation.grabs] == ['right_forearm'])
    other.release()
    peer.wait(lambda: not node.simulation.grabs)


def test_a_client_that_is_gone_lets_go_and_one_that_only_rests_does_not(
        node, peer, client, monkeypatch):
    monkeypatch.setattr(interactive_marker_server, 'CLIENT_TIMEOUT', 2 * SECOND)
    resting = RvizClient(peer, client_id='resting')
    resting.start()
    client.press('head')
    resting.press('torso')
    peer.wait(lambda: len(node.simulation.grabs) == 2)

    def rest():
        resting.send(marker_name='torso', header=Header(frame_id='world'), pose=HERE,
                     event_type=InteractiveMarkerFeedback.KEEP_ALIVE)
        return len(node.simulation.grabs) < 2

    peer.wait(rest)
    assert [grab.bone for grab in node.simulation.grabs] == ['torso']


def test_another_scene_erases_the_old_markers(node, peer, client):
    client.press('head')
    peer.wait(lambda: node.simulation.grabs)
    client.release()
    # While it ticks, a slow machine would load for more updates than a client keeps.
    node.pause(True)
    node.set_parameters([Parameter('scene', value='crowd')])
    node.pause(False)
    names = set(node.simulation.scene.bone_names)
    peer.wait(lambda: set(client.markers) == names)
    client.press('doll_3/head' if 'doll_3/head' in names else sorted(names)[0])
    peer.wait(lambda: node.simulation.grabs)
    assert client.resets == 0
    change, = [update for update in client.seen if update.markers]
    assert set(change.erases).isdisjoint(marker.name for marker in change.markers)


def test_a_reset_lets_go_and_the_drag_that_goes_on_moves_nothing(node, peer, client):
    client.press('head')
    peer.wait(lambda: node.simulation.grabs)
    node.reset()
    client.move(0.0, 0.0, 5.0)
    client.release()
    client.send(marker_name='head', header=Header(frame_id='world'), event_type=99)
    peer.wait(lambda: node.input_counts.refused)
    assert 'event_type' in node.input_counts.last_reason, 'the last, and the first refused'
    assert node.simulation.grabs == () and node.input_counts.refused.total() == 1


@pytest.mark.parametrize('frame, name, kind, change, word', [
    ('world', 'tail', 4, {}, 'one of torso'),
    ('map', 'head', 4, {}, 'header.frame_id'),
    ('', 'head', 4, {}, 'header.frame_id'),
    ('world', 'head', 2, {}, 'event_type'),
    ('world', 'head', 99, {}, 'event_type'),
    ('world', 'head', 1, {'pose': Pose(position=Point(x=math.nan))}, 'pose.position'),
    ('world', 'head', 4, {'pose': Pose(position=Point(x=1e300))}, 'target'),
    ('world', 'head', 4, {'pose': Pose(orientation=Quaternion(w=math.inf))}, 'pose.orientation'),
    ('world', 'head', 4, {'mouse_point_valid': True, 'mouse_point': Point(y=-math.inf)},
     'mouse_point')])
def test_rubbish_is_refused_and_counted(node, peer, client, frame, name, kind, change, word):
    fields = {'pose': HERE, **change}
    client.send(header=Header(frame_id=frame), marker_name=name, event_type=kind, **fields)
    peer.wait(lambda: node.input_counts.refused)
    assert node.input_counts.refused == {'~/interactive/feedback': 1}
    assert word in node.input_counts.last_reason
    assert node.simulation.grabs == ()


def test_a_point_beside_the_bone_is_moved_onto_it(node, peer, client):
    """Else a force would have a lever as long as the client likes."""
    x, y, z = at(client.markers['head'].pose.position)
    client.press('head', (x, y, z + 50.0))
    peer.wait(lambda: node.simulation.grabs)
    assert node.simulation.grabs[0].point == pytest.approx((0, 0, 0.1))


def test_a_flood_of_clients_is_held_off(node, peer, client):
    numbers = itertools.count()

    def refused():
        # Again and again: a slow machine forgets the first hands before it has heard the last.
        for number in itertools.islice(numbers, 30):
            client.client_id = f'client {number}'
            client.press('head')
        for _ in range(200):
            peer.executor_.spin_once(timeout_sec=0.01)
            if node.input_counts.refused['~/interactive/feedback']:
                return True
        return False

    peer.wait(refused)
    assert 'hands' in node.input_counts.last_reason
    client.client_id = 'client 0'
    client.release()


def test_updates_are_of_the_documented_type(node, peer, client):
    peer.wait(lambda: client.seen)
    assert client.seen[0].server_id == '/ragdoll'
    assert client.seen[0].type == InteractiveMarkerUpdate.UPDATE

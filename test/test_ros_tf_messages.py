"""Frames on /tf and joint_states: against ~/poses and the URDF that is published.

The frames are made by link_tree.LinkTree, whether or not tf2_msgs is there to send them;
test_ros_tf.py hears them in another process.
"""
from __future__ import annotations

import io
from xml.etree import ElementTree

import numpy as np
import pytest
from rclpy.parameter import Parameter
from samples import SCENES, random_coordinates
from sensor_msgs.msg import JointState

from ragdoll_ros.files.robots.urdf_tree import parse_urdf
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.files.urdf import scene_to_urdf
from ragdoll_ros.model import rotation
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.push import Push
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.messages import tf
from ragdoll_ros.ros.messages.link_tree import LinkTree

TICK = 0.0002
"""s: the shortest, so that differences over two of them are rates."""


@pytest.fixture(params=SCENES)
def moving(request):
    """A simulation of dolls with joints of all kinds, bent at random, some ticks in flight."""
    yield from flight(SCENES[request.param])


def flight(scene):
    with Simulation(scene, TICK) as simulation:
        simulation.place(random_coordinates(scene, 5))
        for _ in range(20):
            simulation.advance()
        yield simulation


def frames_of(simulation, frame='map', roots_only=False):
    """Pose of every frame of /tf in the world, by name, going from parent to child."""
    tree = LinkTree(simulation.scene, frame, roots_only)
    poses = tree.poses(simulation.state, simulation.joint_angles)
    found = {frame: Pose()}
    for (parent, child), row in zip(tree.edges, poses, strict=True):
        found[child] = found[parent].compose(Pose(row[:3], row[3:]))
    return found


def assert_near(pose, expected):
    np.testing.assert_allclose(pose.position, expected.position, rtol=0, atol=1e-9)
    assert rotation.angle_between(pose.orientation, expected.orientation) < 1e-9


def assert_poses(simulation, frames):
    """The bones, where the URDF puts them into these frames, are where ~/poses has them."""
    links = parse_urdf(scene_to_urdf(simulation.scene, 'map')).links
    for index, name in enumerate(simulation.scene.bone_names):
        assert_near(frames[name].compose(links[name].centre), simulation.state.poses(index))


def test_frames_hold_the_bones_where_poses_have_them(moving):
    assert_poses(moving, frames_of(moving))


def test_joint_states_and_the_urdf_hold_the_bones_there_too(moving):
    """Forward kinematics by the reader of URDF, from the roots' frames on."""
    tree = parse_urdf(scene_to_urdf(moving.scene, 'map'))
    angles = dict(zip(moving.scene.angle_names, moving.joint_angles, strict=True))
    placed = tree.poses({child: angles.get(joint.name, 0.0)
                         for child, joint in tree.joints.items()})
    roots, frames = frames_of(moving, roots_only=True), {}
    for name in tree.order:
        joint = tree.joints.get(name)
        if name in roots:
            frames[name] = roots[name]
        else:
            frames[name] = frames[joint.parent].compose(placed[joint.parent].relative(placed[name]))
    assert_poses(moving, frames)


@pytest.mark.parametrize('name', ['drop', 'every_kind'])
def test_another_reader_of_urdf_places_the_links_likewise(name):
    yourdfpy = pytest.importorskip('yourdfpy')
    scene = SCENES[name] if name in SCENES else load_scene(name)
    with Simulation(scene, TICK) as simulation:
        simulation.place(random_coordinates(scene, 6))
        text = scene_to_urdf(scene)
        robot = yourdfpy.URDF.load(io.StringIO(text), load_meshes=False)
        robot.update_cfg(dict(zip(scene.angle_names, simulation.joint_angles, strict=True)))
        frames = frames_of(simulation)
        root = frames[scene.dolls[0].doll.root.name]
        for name in robot.link_map:
            found = robot.get_transform(name)
            assert_near(root.relative(frames[name]),
                        Pose(found[:3, 3], rotation.from_matrix(found[:3, :3])))


def test_frames_form_the_tree_of_the_urdf(moving):
    """Its floating joints, which robot_state_publisher leaves out, go from the world to a root."""
    scene = moving.scene
    urdf = parse_urdf(scene_to_urdf(scene, 'map'))
    roots = {('map', scene.qualified(placement, placement.doll.root.name))
             for placement in scene.dolls}
    edges = {(joint.parent, joint.child) for joint in urdf.joints.values()}
    found = LinkTree(scene, 'map').edges
    assert set(found) == edges | roots and len(found) == len(set(found))
    assert set(LinkTree(scene, 'map', roots_only=True).edges) == roots


def test_rates_are_what_the_angles_change_by():
    """Of joints of all kinds, none of which comes to its limit, where rates leap."""
    for simulation in flight(SCENES['every_kind']):
        before = simulation.joint_angles
        simulation.advance()
        rates = simulation.joint_rates
        simulation.advance()
        change = np.angle(np.exp(1j * (simulation.joint_angles - before)))
        assert np.abs(rates).min() > 0.01
        np.testing.assert_allclose(rates, change / (2 * TICK), rtol=1e-3, atol=1e-3)


def test_joint_states_have_angles_and_rates(make_node, peer):
    node = make_node(scene='flight')
    got = peer.collect(JointState, 'joint_states')
    peer.wait_heard(node, '/joint_states')
    node.simulation.push(Push('left_shin', (100.0, 0, 0)))
    for _ in range(30):
        node.tick()
    peer.wait(lambda: len(got) == 30)
    message = got[-1][1]
    assert tuple(message.name) == node.simulation.scene.angle_names
    np.testing.assert_array_equal(message.position, node.simulation.joint_angles)
    np.testing.assert_array_equal(message.velocity, node.simulation.joint_rates)
    assert np.abs(message.velocity).max() > 0.01


def test_limits_have_effort_and_velocity():
    """Zeros would be joints that can not move, to those who plan or drive them."""
    limits = ElementTree.fromstring(scene_to_urdf(load_scene('drop'))).findall('joint/limit')
    assert len(limits) > 9
    assert all(float(limit.get(key)) > 0 for limit in limits for key in ('effort', 'velocity'))


@pytest.mark.parametrize(('begin', 'lines'), [('all', 1), ('root', 1), ('none', 0)])
def test_a_node_without_tf2_msgs_runs_and_says_once_what_is_missing(make_node, capfd, begin, lines):
    if tf.TFMessage is not None:
        pytest.skip('tf2_msgs is installed')
    node = make_node(publish_tf=begin)
    assert capfd.readouterr().err.count('/tf is not published') == lines
    for tree in ('none', 'all', 'root', 'all'):
        assert node.set_parameters([Parameter('publish_tf', value=tree)])[0].successful
        node.tick()
    told = capfd.readouterr().err
    assert told.count('/tf is not published') == 1 - lines
    assert lines or "No module named 'tf2_msgs'" in told
    assert '/tf' not in {publisher.topic_name for publisher in node.publishers}


@pytest.mark.skipif(tf.TFMessage is None, reason='tf2_msgs is not installed')
def test_the_topic_is_there_while_it_is_wanted(make_node):
    node = make_node()
    for tree, offered in (('none', False), ('root', True), ('all', True), ('none', False)):
        assert node.set_parameters([Parameter('publish_tf', value=tree)])[0].successful
        node.tick()
        assert ('/tf' in {publisher.topic_name for publisher in node.publishers}) == offered

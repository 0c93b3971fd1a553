"""Persons after REP 155: frame, joints and URDF hold the bones where ~/poses has them."""
from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from message_packages import build
from peer import end, kill, start
from samples import random_coordinates

from ragdoll_ros.files.robots.urdf_tree import parse_urdf
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.people import person
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.humans import publishers
from ragdoll_ros.ros.humans.body import bodies
from ragdoll_ros.ros.humans.publishers import body_poses

SCENES = {
    'woman': load_scene('woman'), 'man': load_scene('man'),
    'three': Scene('three', (
        Placement(load_scene('drop').dolls[0].doll, name='no one', position=(3, 0, 2)),
        Placement(person(1.8, 80, 'male', 'tall'), name='a b'),
        Placement(person(1.5, 50, 'female', 'small'), name='a-b', position=(0, 2, 2),
                  orientation=tuple(rotation.from_rpy(0.3, 0.2, 2.0)))))}


@pytest.fixture(params=SCENES)
def moving(request):
    scene = SCENES[request.param]
    with Simulation(scene) as simulation:
        simulation.place(random_coordinates(scene, 3))
        simulation.advance()
        yield simulation


def assert_bones(body, row, angles, placement, pose_of):
    """The bones of a person, by the URDF from its frame on, are where ``pose_of(bone)`` is."""
    tree = parse_urdf(body.urdf)
    placed = tree.poses({child: angles.get(joint.name, 0.0)
                         for child, joint in tree.joints.items()})
    for bone in placement.doll.bones:
        link = f'{bone.name}_{body.id}'
        pose = Pose(row[:3], row[3:]).compose(placed[link]).compose(tree.links[link].centre)
        at = pose_of(bone.name)
        np.testing.assert_allclose(pose.position, at.position, rtol=0, atol=1e-9)
        assert rotation.angle_between(pose.orientation, at.orientation) < 1e-9


def test_kinematics_from_what_is_published_hold_the_bones_where_poses_have_them(moving):
    scene, found = moving.scene, bodies(moving.scene, 9)
    rows = body_poses(found, moving)
    people = [placement for placement in scene.dolls if placement.name != 'no one']
    for body, row, placement in zip(found, rows, people, strict=True):
        tree = parse_urdf(body.urdf)
        told = dict(zip(body.joint_names, moving.joint_angles[body.angles], strict=True))
        assert tree.order[0] == body.frame_name
        assert set(told) <= {joint.name for joint in tree.joints.values()}
        assert all(name.endswith(f'_{body.id}') for name in (*tree.links, *told))
        names = {bone.name: scene.bone_index(scene.qualified(placement, bone.name))
                 for bone in placement.doll.bones}
        assert_bones(body, row, told, placement,
                     lambda bone, at=names: moving.state.poses(at[bone]))


def test_the_frame_is_at_the_middle_of_the_hips_and_looks_forwards():
    """In the bind pose, in which a person stands on z = 0 and looks along x."""
    scene = SCENES['woman']
    with Simulation(scene) as simulation:
        row, = body_poses(bodies(scene, 9), simulation)
    lift = np.array(scene.dolls[0].position)
    hips = [joint.anchor for joint in scene.dolls[0].doll.joints if joint.child.endswith('thigh')]
    np.testing.assert_allclose(row[:3], np.mean(hips, axis=0) + lift, atol=1e-9)
    np.testing.assert_allclose(row[3:], (0, 0, 0, 1), atol=1e-9)


def test_ids_are_parts_of_topic_names_and_unique():
    assert [body.id for body in bodies(SCENES['three'], 9)] == ['a_b', 'a_b_2']
    assert [body.id for body in bodies(SCENES['three'], 1)] == ['a_b']
    assert bodies(load_scene('crowd'), 9) == []


@pytest.mark.skipif(publishers.IdsList is not None, reason='hri_msgs is installed')
def test_a_node_without_hri_msgs_says_what_is_missing(make_node, capfd):
    node = make_node(scene='woman')
    assert '/humans is not published, as hri_msgs is not installed' in capfd.readouterr().err
    assert "No module named 'hri_msgs'" in node._outputs.humans.status
    assert not [topic for topic, _ in node.get_topic_names_and_types() if 'humans' in topic]
    assert make_node()._outputs.humans.status == ''


@pytest.mark.slow
def test_who_knows_the_draft_s_names_alone_finds_the_person(ros, tmp_path, monkeypatch):
    """In another process, over DDS, with messages as installed or built for this test."""
    missing = [name for name in ('tf2_msgs', 'hri_msgs') if importlib.util.find_spec(name) is None]
    for name, path in (build(tmp_path, *missing) if missing else {}).items():
        monkeypatch.setenv(name, os.pathsep.join(filter(None, [path, os.environ.get(name)])))
    node = start('node', '--ros-args', '-p', 'scene:=woman', compiled=True)
    try:
        done = subprocess.run([sys.executable, str(Path(__file__).parent / 'humans_listener.py')],
                              capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert end(node, signal.SIGINT)[0] == 0
    finally:
        kill(node)
    heard = json.loads(done.stdout)
    assert heard['ids'] == ['woman']
    placement = SCENES['woman'].dolls[0]
    poses = dict(zip(SCENES['woman'].bone_names, np.array(heard['poses']), strict=True))
    assert_bones(SimpleNamespace(id='woman', urdf=heard['urdf']), np.array(heard['frame']),
                 heard['angles'], placement,
                 lambda bone: Pose(poses[bone][:3], poses[bone][3:]))

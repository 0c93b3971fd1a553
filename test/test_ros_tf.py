"""/tf as another process hears it, over DDS, with tf2_msgs as installed or built for this test."""
from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from message_packages import build
from peer import end, kill, start
from std_srvs.srv import SetBool

from ragdoll_ros.files.robots.urdf_tree import parse_urdf
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.pose import Pose

pytestmark = pytest.mark.slow
LISTENER = Path(__file__).parent / 'tf_listener.py'
BROADCASTER = LISTENER.with_name('tf_broadcaster.py')
HALF = np.sqrt(0.5)


@pytest.fixture(scope='module', autouse=True)
def tf2_msgs(ros, tmp_path_factory):
    """What processes that are started from now on need to import tf2_msgs."""
    with pytest.MonkeyPatch.context() as patch:
        if importlib.util.find_spec('tf2_msgs') is None:
            for name, path in build(tmp_path_factory.mktemp('built'), 'tf2_msgs').items():
                patch.setenv(name, os.pathsep.join(filter(None, [path, os.environ.get(name)])))
        yield


@pytest.fixture
def run_node():
    """Start nodes with parameters and remappings; ended in the end, without a complaint."""
    started = []

    def run(*words):
        started.append(start('node', '--ros-args', *words, compiled=True))

    yield run
    for process in started:
        try:
            assert end(process, signal.SIGINT)[0] == 0
        finally:
            kill(process)


def listen(count, namespace=''):
    """What another process hears of /tf, and of what tells the same, for so many stamps."""
    done = subprocess.run([sys.executable, str(LISTENER), str(count), namespace],
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def in_world(frames):
    """Pose of each frame in the world, from its pose in its parent's."""
    found = {'world': Pose()}
    for parent, child, row in frames:
        found[child] = found[parent].compose(Pose(np.array(row[:3]), np.array(row[3:])))
    return found


def by_joint_states(urdf, angles, root, pose):
    """Pose of each link in the world, by the URDF from the root on."""
    turns = {child: angles.get(joint.name, 0.0) for child, joint in urdf.joints.items()}
    placed = urdf.poses(turns)
    return {name: pose.compose(placed[root].relative(place)) for name, place in placed.items()}


def test_frames_joint_states_and_poses_are_one_doll_in_another_process(run_node):
    """Within 1e-9 m and rad, for 200 stamps of a doll that is pushed about by the ground."""
    run_node('-p', 'scene:=drop')
    heard = listen(200)
    urdf, scene = parse_urdf(heard['urdf']), load_scene('drop')
    root = scene.dolls[0].doll.root.name
    stamps = heard['frames'].keys() & heard['poses'].keys() & heard['angles'].keys()
    errors = []
    for stamp in stamps:
        frames = in_world(heard['frames'][stamp])
        links = by_joint_states(urdf, heard['angles'][stamp], root, frames[root])
        for name, row in zip(scene.bone_names, heard['poses'][stamp], strict=True):
            for found in (frames[name], links[name]):
                bone = found.compose(urdf.links[name].centre)
                errors.append((np.linalg.norm(bone.position - row[:3]),
                               rotation.angle_between(bone.orientation, np.array(row[3:]))))
    assert len(stamps) >= 200
    print('largest errors, m and rad:', np.max(errors, axis=0))
    assert np.max(errors) < 1e-9


def test_in_a_namespace_with_roots_alone(run_node):
    run_node('-p', 'scene:=crowd', '-p', 'publish_tf:=root', '-r', '__ns:=/stage', '-r', '/tf:=tf')
    frames = next(iter(listen(0, '/stage')['frames'].values()))
    roots = [placement.name + '/torso' for placement in load_scene('crowd').dolls]
    assert [tuple(names) for *names, _ in frames] == [('world', root) for root in roots]


def test_who_comes_while_the_time_stands_hears_the_frames_too(run_node, peer):
    run_node()
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True)).success
    first, second = (listen(0)['frames'] for _ in range(2))
    assert first == second and len(first) == 1


def test_a_body_follows_a_frame_that_another_process_broadcasts(run_node, tmp_path):
    path = tmp_path / 'cart.yaml'
    path.write_text("""ground: {}
dolls: [{doll: doll, position: [3, 0, 0.05]}]
bodies: [{name: cart, shape: {box: {size: [0.5, 0.4, 0.3]}}, follow: exact}]
""")
    run_node('-p', f'scene:={path}', '-p', "body_frames:=['cart base']")
    cart = load_scene(str(path)).bone_names.index('cart/cart')
    done = subprocess.run([sys.executable, str(BROADCASTER), str(cart)], capture_output=True,
                          text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    rows = np.array(json.loads(done.stdout))
    assert rows[-1] == pytest.approx((0, 0.5, 1, 0, 0, HALF, HALF), abs=1e-9)
    heights = rows[:, 2]
    # It is where the scene has it, then on the frame's line, where it moves on for at most 0.2 s.
    assert set(np.round(heights, 9)) <= {0.0, 1.0}
    assert rows[:, 1].min() >= -1e-9 and rows[:, 1].max() <= 0.5 + 0.2 * 0.5

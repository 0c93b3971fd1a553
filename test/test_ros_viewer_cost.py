"""What the page costs: CPU time of the viewer's process, and of the node beside it."""
from __future__ import annotations

import dataclasses
import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('viser')
from conftest import ROOT
from geometry_msgs.msg import PoseArray
from page_client import PageClient, wait
from peer import Peer, kill, start

from ragdoll_ros.scene_file import load_scene, save_scene
from ragdoll_ros.state import State
from ragdoll_ros.viewer.bodies import Bodies
from ragdoll_ros.viewer.command import free_port, server_at

pytestmark = pytest.mark.slow
SECONDS = 10


def cpu(process):
    """Seconds of CPU that a process has had (proc(5): utime and stime in ticks)."""
    with open(f'/proc/{process.pid}/stat') as file:
        fields = file.read().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def shares(seconds, *processes):
    """Share of one core that each process takes in so many seconds."""
    before = [cpu(process) for process in processes]
    begin = time.monotonic()
    time.sleep(seconds)
    passed = time.monotonic() - begin
    return [(cpu(process) - had) / passed for process, had in zip(processes, before, strict=True)]


@pytest.fixture
def spinning(tmp_path):
    """A doll that never comes to rest: no ground, no gravity, no damping."""
    scene = load_scene('flight')
    (placement,) = scene.dolls
    joints = tuple(dataclasses.replace(joint, damping=0.0) for joint in placement.doll.joints)
    doll = dataclasses.replace(placement.doll, joints=joints)
    path = tmp_path / 'spinning.yaml'
    save_scene(dataclasses.replace(scene, name='spinning', dolls=(
        dataclasses.replace(placement, doll=doll, spin=(1.0, 2.0, 3.0)),)), path)
    return path


def test_viewer_costs_little_and_the_node_keeps_its_rate(ros, spinning):
    """10 bones, 60 Hz: at most 15 % of a core; next to nothing without a page; node within 1 %."""
    node = start('node', '--ros-args', '-p', f'scene:={spinning}')
    viewer = subprocess.Popen([sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0'],
                              stdout=subprocess.PIPE, text=True, cwd=ROOT)
    peer = Peer()
    try:
        port = int(re.search(r':(\d+)\n', viewer.stdout.readline())[1])
        got = peer.collect(PoseArray, 'ragdoll/poses')
        peer.wait(lambda: got)
        alone, node_alone = shares(SECONDS, viewer, node)
        client = PageClient(port)
        wait(lambda: client.windows > 60)
        windows, begin = client.windows, time.monotonic()
        got.clear()
        with_page, node_watched = shares(SECONDS, viewer, node)
        rate = (client.windows - windows) / (time.monotonic() - begin)
        peer.wait(lambda: len(got) >= 990)
        first, last = got[0], got[-1]
        client.close()
    finally:
        viewer.terminate()
        viewer.wait(10)
        kill(node)
        peer.destroy_node()
    print(f'viewer {with_page:.3f} of a core at {rate:.1f} pages/s, {alone:.4f} without a page; '
          f'node {node_watched:.3f}, alone {node_alone:.3f}')
    assert rate > 50
    assert with_page < 0.15
    assert alone < 0.01
    stamps = [message.header.stamp for _, message in (first, last)]
    simulated = stamps[1].sec - stamps[0].sec + (stamps[1].nanosec - stamps[0].nanosec) / 1e9
    # Messages wait in a queue here: the node's own stamps are a tick apart, all of them there.
    assert len(got) == pytest.approx(simulated * 100, abs=2)


def test_node_holds_its_rate_while_it_is_watched(ros, spinning):
    """Arrivals of the poses over 10 s of the wall, a page being open: 100 Hz within 1 %."""
    node = start('node', '--ros-args', '-p', f'scene:={spinning}')
    viewer = subprocess.Popen([sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0'],
                              stdout=subprocess.PIPE, text=True, cwd=ROOT)
    peer = Peer()
    try:
        client = PageClient(int(re.search(r':(\d+)\n', viewer.stdout.readline())[1]))
        wait(lambda: client.windows > 60)
        got = peer.collect(PoseArray, 'ragdoll/poses')
        peer.wait(lambda: len(got) > 50)
        got.clear()
        peer.wait(lambda: len(got) > 100 * SECONDS, timeout=2 * SECONDS)
        rate = (len(got) - 1) / (got[-1][0] - got[0][0])
        print(f'{rate:.2f} Hz')
        client.close()
    finally:
        viewer.terminate()
        viewer.wait(10)
        kill(node)
        peer.destroy_node()
    assert rate == pytest.approx(100, rel=0.01)


def test_five_hundred_bones_are_drawn_at_60_hz():
    """50 dolls in two batches: at most 15 % of a core, all the way to an open page's socket."""
    crowd = load_scene('crowd')
    dolls = tuple(dataclasses.replace(crowd.dolls[k % 10], name=f'd{k}') for k in range(50))
    scene = dataclasses.replace(crowd, dolls=dolls)
    poses = [placement.bone_pose(bone) for placement in dolls for bone in placement.doll.bones]
    places, turns = (np.array(column) for column in zip(*poses, strict=True))
    state = State(places, turns, np.zeros((500, 3)), np.zeros((500, 3)))
    with server_at('127.0.0.1', free_port('127.0.0.1', 0)) as server:
        client = PageClient(server.get_port())
        bodies = Bodies(server, scene, state)
        wait(lambda: client.windows > 1)
        before, begin = client.windows, time.process_time()
        start_time = time.monotonic()
        for frame in range(600):
            moved = dataclasses.replace(state, positions=places + 0.001 * frame)
            with server.atomic():
                bodies.show(moved)
            time.sleep(max(0.0, start_time + (frame + 1) / 60 - time.monotonic()))
        share = (time.process_time() - begin) / (time.monotonic() - start_time)
        rate = (client.windows - before) / (time.monotonic() - start_time)
        client.close()
    print(f'{share:.3f} of a core, the client that listens included; {rate:.1f} windows/s')
    assert len(bodies.batches) == 2 and rate > 50
    assert share < 0.15

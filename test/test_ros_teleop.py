"""The teleop on a terminal: what a tap, a held key and other keys send, and to which node."""
from __future__ import annotations

import itertools
import signal
import time

import numpy as np
import pytest
from geometry_msgs.msg import Wrench
from peer import PATIENCE, Peer, end, kill, start, start_on_terminal
from screen import Screen
from sensor_msgs.msg import MultiDOFJointState

from ragdoll_ros import Bone, Joint, Placement, Ragdoll, Scene, Sphere, save_scene
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.ros.teleop.doll_motion import DollMotion
from ragdoll_ros.ros.teleop.teleop import NodeFinder

pytestmark = pytest.mark.usefixtures('nothing_runs_on')
MASSES = np.array([bone.mass for bone in load_scene('flight').bones])


@pytest.fixture(scope='module')
def peer(ros):
    peer = Peer('teleop_peer')
    yield peer
    peer.destroy_node()


def forces(got):
    return [(w.force.x, w.force.y, w.force.z) for _, w in got]


def stamp(message):
    return message.header.stamp.sec + message.header.stamp.nanosec / 1e9


def centre_speed(message):
    """Speed, m/s, of a doll's centre of mass."""
    twists = [(t.linear.x, t.linear.y, t.linear.z) for t in message.twist]
    return np.linalg.norm(MASSES @ np.array(twists)) / MASSES.sum()


def heard_teleop(peer, namespace):
    """What a teleop without a node sends, its process and its screen."""
    got = peer.collect(Wrench, f'{namespace}/ragdoll/force')
    process, terminal = start_on_terminal('teleop.teleop', '--ros-args', '-r', f'__ns:={namespace}')
    peer.wait(lambda: peer.count_publishers(f'{namespace}/ragdoll/force'))
    screen = Screen(terminal)
    screen.wait('waiting for the node')
    return got, process, screen


def test_the_teleop_sends_what_the_keys_say(peer):
    got, process, screen = heard_teleop(peer, '/typed')

    def tapped():
        """Told again and again: this listener may not have found the teleop yet."""
        screen.type(b'\x1b[B\x1b[D')
        screen.read(0.2)
        return (2000.0, -2000.0, 2.0) in forces(got) and got[-1][1] == Wrench()
    peer.wait(tapped)
    sent = forces(got)
    # Once zero, after each tap.
    assert all(any(one) or any(other) for one, other in itertools.pairwise(sent))
    code, _ = end(process, signal.SIGINT)
    assert code == 0


def test_a_key_that_a_terminal_repeats_pushes_without_a_gap(peer):
    """After the first repeats, 30 in a second, no zero comes until they end.

    A busy machine may hold the keys back for longer than a tap lasts: then they come once more.
    """
    got, _, screen = heard_teleop(peer, '/held')

    def held():
        got.clear()
        begin = time.monotonic()
        while time.monotonic() < begin + 1.0:
            screen.type(b'\x1b[A')
            screen.read()
            peer.executor_.spin_once(timeout_sec=1 / 30)
        peer.wait(lambda: got and got[-1][1] == Wrench())
        return len(got) > 20 and set(forces(got)[:-1]) == {(-2000.0, 0.0, 1.0)}
    # No node: its doll's speed is not known, and not limited.
    peer.wait(held)


@pytest.mark.parametrize('where', [
    ('-r', '__node:=puppet'), ('-r', '__ns:=/stage', '-r', '__node:=puppet')],
    ids=['renamed', 'namespaced'])
def test_a_tap_gives_a_metre_a_second_to_a_node_of_any_name(peer, where):
    """The middle of five taps, and of five more where a busy machine stretches them: by ticks, of
    0.4 m/s each. The first may come before the node has found the teleop.
    """
    name = ('/stage' if len(where) > 2 else '') + '/puppet'
    node = start('node', '--ros-args', *where, '-p', 'scene:=flight', compiled=True)
    states = peer.collect(MultiDOFJointState, f'{name}/state')
    peer.wait(lambda: states)
    process, terminal = start_on_terminal('teleop.teleop')
    screen = Screen(terminal)
    screen.wait(r'RTF \d')
    speeds = [0.0]

    def tapped():
        for _ in range(5):
            screen.type(b'\x1b[A')
            screen.wait(r'\(-2000 0 1\) N')
            # What was on its way is older than this, and the push has ended in 0.1 s at any rate.
            later = time.time() + 0.2
            peer.wait(lambda later=later: stamp(states[-1][1]) > later)
            speeds.append(centre_speed(states[-1][1]))
        return 0.5 < np.median(np.diff(speeds[-6:])) < 1.2
    peer.wait(tapped)
    assert end(process, signal.SIGINT)[0] == 0
    kill(node)


def held_for(screen, peer, key, states, seconds):
    """Repeat a key as a terminal does, for s of the node's clock; the last state."""
    begin = stamp(states[-1][1])
    while stamp(states[-1][1]) < begin + seconds:
        screen.type(key)
        screen.read()
        peer.executor_.spin_once(timeout_sec=1 / 60)
    return states[-1][1]


def test_a_held_key_goes_to_the_top_speed_and_not_beyond(peer):
    """0.8 s in free space, where 2000 N would make 28 m/s of it. + and - change the speed."""
    # Slow motion: a busy machine delays states and pushes by little simulated time.
    node = start('node', '--ros-args', '-r', '__node:=runner', '-p', 'scene:=flight', '-p',
                 'real_time_factor:=0.1', compiled=True)
    states = peer.collect(MultiDOFJointState, '/runner/state')
    peer.wait(lambda: states)
    process, terminal = start_on_terminal('teleop.teleop', '/runner', '--top-speed', '2')
    screen = Screen(terminal)
    screen.wait(r'RTF \d')
    # The node may find this teleop late.
    peer.wait(lambda: centre_speed(held_for(screen, peer, b'\x1b[A', states, 0.3)) > 1.5)
    assert centre_speed(held_for(screen, peer, b'\x1b[A', states, 0.8)) < 2.5
    screen.type(b'+++')
    screen.wait('top speed 3.5 m/s')
    peer.wait(lambda: centre_speed(held_for(screen, peer, b'\x1b[A', states, 0.3)) > 2.8)
    assert centre_speed(held_for(screen, peer, b'\x1b[A', states, 0.5)) < 4.0
    assert end(process, signal.SIGINT)[0] == 0
    process, terminal = start_on_terminal('teleop.teleop', '/runner', '--force')
    screen = Screen(terminal)
    screen.wait(r'RTF \d')
    peer.wait(lambda: centre_speed(held_for(screen, peer, b'\x1b[B', states, 0.5)) > 10)
    assert end(process, signal.SIGINT)[0] == 0
    kill(node)


def test_the_speed_that_is_limited_is_the_roots_wherever_its_bone_stands(make_node, peer, tmp_path):
    """The root of this doll, the last of its bones, swings backwards, the other one forwards,
    so slowly that a busy machine finds them much as they were.
    """
    bones = tuple(Bone(name, Sphere(0.1), 1.0, (0.0, 0.0, height))
                  for name, height in (('arm', 1.5), ('body', 0.5)))
    doll = Ragdoll('pair', bones, (Joint('body', 'arm', 'hinge', (0.0, 0.0, 1.0),
                                         ((0.0, 1.0, 0.0),)),))
    pair = Scene('pair', (Placement(doll, rates={'arm': 0.02}),), gravity=(0.0, 0.0, 0.0))
    save_scene(pair, tmp_path / 'pair.yaml')
    node = make_node(scene=str(tmp_path / 'pair.yaml'))
    peer.executor_.add_node(node)
    states = peer.collect(MultiDOFJointState, '/ragdoll/state')
    motion = DollMotion(peer, '/ragdoll', lambda: states[-1][1] if states else None)
    peer.wait(lambda: motion.mass)
    assert motion.mass == pytest.approx(2.0)
    assert motion.speed(np.array((1.0, 0.0, 0.0))) == pytest.approx(0.0, abs=1e-9)
    assert motion.speed(np.array((-1.0, 0.0, 0.0))) == pytest.approx(0.005, rel=0.1)


def test_a_top_speed_out_of_range_is_refused(peer):
    process, _ = start_on_terminal('teleop.teleop', '--top-speed', '90')
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2 and '--top-speed 90: expected 0.5 to 20' in said


def test_of_several_nodes_a_user_says_which(peer):
    for name in ('one', 'other'):
        start('node', '--ros-args', '-r', f'__node:={name}', '-r', '__ns:=/two', '-p',
              'scene:=flight', compiled=True)
    sent = peer.collect(Wrench, '/two/other/force')
    peer.wait(lambda: all(peer.count_publishers(f'/two/{name}/poses') for name in ('one', 'other')))
    finder = NodeFinder(peer, '')
    # Of a busy machine's nodes some are found later than others.
    peer.wait(lambda: not finder.update() and '/two/one, /two/other' in finder.problem)
    _, terminal = start_on_terminal('teleop.teleop', 'two/other', '--force')
    screen = Screen(terminal)

    def pushed():
        """Told again and again: the listener may not have found the teleop yet."""
        screen.type(b'\x1b[C')
        screen.read()
        return (0.0, 2000.0, 1.0) in forces(sent)
    peer.wait(pushed)


def test_a_name_that_no_node_can_have_is_refused(peer):
    process, _ = start_on_terminal('teleop.teleop', 'no/such name')
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert 'no/such name' in said and 'Traceback' not in said

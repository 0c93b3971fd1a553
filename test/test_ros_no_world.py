"""A node without a world: silent, refuses what is asked of one, until one is loaded."""
from __future__ import annotations

import json
import re
import threading
from types import SimpleNamespace

import pytest
from bags import write_bag
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, Twist, Wrench, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter
from recorder import PAST
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)
from visualization_msgs.srv import GetInteractiveMarkers

from ragdoll_ros.model.errors import Closed, RagdollError, Unreadable
from ragdoll_ros.replay.command import main
from ragdoll_ros.ros.event_log import HASH_INTERVAL
from ragdoll_ros.ros.latched_topic import LATCHED_HISTORY
from ragdoll_ros.ros.simulation_interfaces.codes import Refusal
from ragdoll_ros.ros.simulation_interfaces.resources.world_loader import WorldLoader

INPUTS = {'force': (Wrench, '~/force'), 'push': (WrenchStamped, '~/push'),
          '../cmd_vel': (Twist, 'cmd_vel'), 'wrench_at': (MultiDOFJointState, '~/wrench_at'),
          'set_state': (Odometry, '~/set_state'),
          'set_joint_states': (JointState, '~/set_joint_states'),
          'bodies/cart/odom': (Odometry, '~/bodies/cart/odom'),
          'bodies/cart/cmd_vel': (Twist, '~/bodies/cart/cmd_vel'),
          'interactive/feedback': (InteractiveMarkerFeedback, '~/interactive/feedback')}
"""Topics below the node, and how they are counted."""

CART = """
name: cart
dolls: [{doll: doll, position: [0, 0, 1]}]
ground: {}
bodies: [{name: cart, shape: {box: {size: [1, 1, 0.2]}}, position: [3, 0, 0.1], follow: exact}]
"""


def message_for(kind):
    """A message that is valid in the scene `cart`."""
    message = kind()
    if kind is Wrench:
        message.force.x = 1.0
    elif kind is WrenchStamped:
        message.header.frame_id, message.wrench.force.x = 'torso', 1.0
    elif kind is Twist:
        message.linear.x = 1.0
    elif kind is Odometry:
        message.header.frame_id, message.child_frame_id = 'world', 'doll'
    elif kind is JointState:
        message.name, message.position = ['doll/left_shin'], [0.1]
    elif kind is MultiDOFJointState:
        message.joint_names = ['doll/torso']
    return message


def test_what_is_asked_of_it_is_refused_with_a_sentence(make_node, peer, tmp_path):
    path = tmp_path / 'cart.yaml'
    path.write_text(CART)
    node = make_node(scene=str(path))
    peer.executor_.add_node(node)
    senders = {name: peer.sender(kind, f'/ragdoll/{name}'.replace('/ragdoll/..', ''))
               for name, (kind, _) in INPUTS.items()}
    updates = peer.collect(InteractiveMarkerUpdate, '/ragdoll/interactive/update')
    markers = peer.collect(MarkerArray, '/ragdoll/markers')
    peer.wait_heard(node, '/ragdoll/interactive/update', '/ragdoll/markers')
    names = sorted(node.simulation.scene.bone_names)
    node.unload_world()
    peer.wait(lambda: updates and list(updates[-1][1].erases) == names)
    peer.wait(lambda: markers and markers[-1][1].markers[0].action == Marker.DELETEALL)
    for name, (kind, source) in INPUTS.items():
        senders[name].publish(message_for(kind))
        peer.wait(lambda source=source: node.input_counts.refused[source])
        assert 'no world is loaded: load one' in node.input_counts.last_reason, source
    for kind, name in ((Trigger, 'reset'), (Trigger, 'step'), (Trigger, 'go_limp'),
                       (SetBool, 'pause')):
        answer = peer.call(kind, f'/ragdoll/{name}', kind.Request())
        assert not answer.success and 'no world is loaded' in answer.message
    answer = peer.call(GetInteractiveMarkers, '/ragdoll/interactive/get_interactive_markers',
                       GetInteractiveMarkers.Request())
    assert not answer.markers
    changes = [Parameter('rate', value=50.0), Parameter('accuracy', value='draft'),
               Parameter('frame_id', value='map'), Parameter('imu_rate', value=200.0)]
    assert all(each.successful for each in node.set_parameters(changes))
    node.unload_world()
    assert node.set_parameters([Parameter('scene', value='drop')])[0].successful
    assert node.has_world and node.paused and node.simulation.accuracy.step > 1e-3
    assert peer.call(SetBool, '/ragdoll/pause', SetBool.Request()).success
    peer.wait(lambda: node.simulation.time > 0)
    senders['force'].publish(message_for(Wrench))
    peer.wait(lambda: node.simulation.pushes)


def test_listeners_hear_that_there_is_none_and_then_the_next_one(make_node, peer, tmp_path,
                                                                 capsys):
    """Late ones as well; and the log repeats the runs before and after to the bit."""
    node = make_node(scene='drop')
    peer.executor_.add_node(node)
    scenes, events = (peer.collect(String, topic, PAST)
                      for topic in ('/ragdoll/scene', '/ragdoll/events'))
    early = peer.collect(PoseArray, '/ragdoll/poses', LATCHED_HISTORY)
    peer.wait_heard(node, '/ragdoll/scene', '/ragdoll/events', '/ragdoll/poses')
    peer.wait(lambda: node.simulation.time > HASH_INTERVAL * node.simulation.tick and early)
    node.unload_world()
    peer.wait(lambda: scenes[-1][1].data == '')
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    late, texts, urdfs = (peer.collect(kind, topic, qos) for kind, topic, qos in (
        (PoseArray, '/ragdoll/poses', LATCHED_HISTORY), (String, '/ragdoll/scene', PAST),
        (String, '/robot_description', PAST)))
    peer.wait(lambda: len(reports) > 1 and texts and urdfs)
    assert not late and texts[0][1].data == urdfs[0][1].data == ''
    status = reports[-1][1].status[0]
    assert status.message.startswith('no world is loaded') and status.hardware_id == ''
    assert list(node.get_parameter('bone_names').value) == []
    before = len(early)
    node.set_parameters([Parameter('scene', value='crowd')])
    node.pause(False)
    peer.wait(lambda: late and len(late[-1][1].poses) == 100 and len(early) > before)
    peer.wait(lambda: node.simulation.time > HASH_INTERVAL * node.simulation.tick)
    assert 'name: crowd' in texts[-1][1].data and urdfs[-1][1].data
    assert len(node.get_parameter('bone_names').value) == 100
    node.pause(True)
    last = node._event_log._number
    peer.wait(lambda: json.loads(events[-1][1].data)['number'] == last - 1)
    kinds = [json.loads(each.data)['kind'] for _, each in events]
    assert kinds.count('start') == 2 and kinds.count('unload') == 1
    bag = write_bag(tmp_path / 'bag', [(topic, each.data) for topic, messages in (
        ('/ragdoll/scene', scenes), ('/ragdoll/events', events)) for _, each in messages])
    assert main([str(bag)]) == 0
    assert re.search(r'(\d+) of \1 hashes equal', capsys.readouterr().out)


def test_a_loaded_world_fits_the_parameters_of_the_moment_it_comes(make_node):
    """They may change while it loads: then it is made anew, or refused."""
    node = make_node(scene='drop', start_paused=True)
    loaded = node.load_world('crowd')
    assert node.use_world(loaded).successful and node.simulation is loaded.simulation
    loaded = node.load_world('flight')
    node.set_parameters([Parameter('rate', value=50.0)])
    assert node.use_world(loaded).successful and node.simulation is not loaded.simulation
    assert node.simulation.step == 1 / 50 and node.simulation.scene.name == 'flight'
    loaded = node.load_world('crowd')
    node.set_parameters([Parameter('imus', value=['head 0 0 0.1'])])
    done = node.use_world(loaded)
    assert not done.successful and 'head' in done.reason
    assert node.simulation.scene.name == 'flight'
    with pytest.raises(Closed):
        loaded.simulation.advance()
    with pytest.raises(RagdollError, match='head'):
        node.load_world('crowd')


@pytest.fixture
def loading(peer):
    """A loader whose worlds are named; each comes once its event is set."""
    gates, discarded = {}, []

    def make(name):
        assert gates.setdefault(name, threading.Event()).wait(60)
        if name == 'broken':
            raise Unreadable('', name, 'a scene')
        return SimpleNamespace(name=name, simulation=SimpleNamespace(
            close=lambda: discarded.append(name)))

    loader = WorldLoader(peer, Clock(clock_type=ClockType.STEADY_TIME), make)

    async def load(name):
        """The world, or why there is none: an executor raises what a task does."""
        try:
            return await loader.load(name)
        except RagdollError as error:
            return error

    return (loader, lambda name: peer.executor_.create_task(load, name),
            lambda name: gates.setdefault(name, threading.Event()).set(), discarded)


def test_worlds_are_loaded_one_at_a_time_and_the_last_one_asked_for_comes(peer, loading):
    loader, load, release, discarded = loading
    tasks = [load('first')]
    peer.wait(lambda: loader.is_loading)
    for name in ('second', 'third'):
        tasks.append(load(name))
        peer.wait(tasks[-2].done)
    *cancelled, third = tasks
    for task in cancelled:
        assert isinstance(task.result(), Refusal)
        assert 'cancelled: another world is to be loaded' in str(task.result())
    assert loader.is_loading and not third.done()
    release('third')  # it waits for what the first one does, which ends in vain
    release('first')
    peer.wait(third.done)
    assert third.result().name == 'third' and not loader.is_loading
    assert discarded == ['first'] and not loader.cancel('late')


def test_a_load_is_cancelled_at_any_time_or_fails(peer, loading):
    loader, load, release, discarded = loading
    task = load('world')
    peer.wait(lambda: loader.is_loading)
    assert loader.cancel('enough')
    peer.wait(task.done)
    assert 'cancelled: enough' in str(task.result())
    release('world')
    peer.wait(lambda: discarded == ['world'])
    task = load('broken')
    release('broken')
    peer.wait(task.done)
    assert isinstance(task.result(), Unreadable) and not loader.is_loading

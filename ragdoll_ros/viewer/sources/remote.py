"""A source over ROS: shows what the node `ragdoll` publishes and sends it what the page asks for.

The node may be on another machine, may come later, end, and come again with another scene.
"""
from __future__ import annotations

import contextlib
import dataclasses
import operator
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, Twist, Vector3
from rcl_interfaces.msg import ParameterEvent
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from ...files.scene import save_scene
from ...model import errors
from ...model.scene import SECOND, Scene
from ...model.state import State
from ...model.vectors import Vector
from ...ros.diagnostics import status_name
from ...ros.inputs import Inputs
from ...ros.outputs import LATCHED
from ...ros.packed import poses_in
from ...ros.parameters import BONE_NAMES, SPECS, Settings
from .remote_hands import RemoteHands
from .remote_pushes import HeardPushes, Silent
from .remote_scene import scene_of_node
from .remote_services import Ask, Refused
from .remote_topic import Newest
from .rods import Rods
from .source import Frame, Report, Wanted

InvalidROSArguments = rclpy_implementation.RCLInvalidROSArgsError

NAME = 'ragdoll'

MISSING = ('no node `{}` yet: start it with `ros2 run ragdoll_ros ragdoll_node` (same '
           'ROS_DOMAIN_ID); this page goes on by itself')
SILENT = 'the node `{}` has been silent for {:.0f} s; this page goes on by itself'

SILENCE = 3.0
"""s without a word after which a node counts as gone: it reports once a second."""

RETRY = 0.5
"""s between two tries to learn what the node simulates."""

KEYS = ('work_of_pushes_J', 'work_of_grabs_J', 'energy_excess_J')
"""Measures that the page needs, of those that the diagnostics tell."""


class Remote:
    """Listens to the node in its own namespace, in a thread of its own, while a page is open."""

    def __init__(self, arguments: list[str]) -> None:
        self._context = rclpy.Context()
        try:
            rclpy.init(args=arguments, context=self._context,
                       signal_handler_options=SignalHandlerOptions.NO)
        except InvalidROSArguments as error:
            raise Refused(str(error)) from None
        self._node = Node('ragdoll_viewer', context=self._context)
        self._full = f'{self._node.get_namespace().rstrip("/")}/{NAME}'
        self._status = status_name(self._node.get_namespace(), NAME)
        self._ask = Ask(self._node, NAME)
        self._hands = RemoteHands(self._node, NAME)
        self._velocity = self._node.create_publisher(Twist, 'cmd_vel', 10)
        self._wanted = Wanted()
        self._subscriptions: dict[str, list] = {}
        self._newest: dict[str, Newest] = {}
        self._taking = threading.Lock()
        self._forget()
        self._heard = 0.0
        self._opened = time.monotonic()
        self._folder: Path | None = None
        self._ended = threading.Event()
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name='ros', daemon=True)
        self._thread.start()

    @property
    def frame(self) -> Frame | None:
        """Where the node's last message says that all is; the last one that fitted the scene."""
        with self._taking:
            return self._newest_frame()

    def _newest_frame(self) -> Frame | None:
        self._take()
        data, scene = self._poses, self._scene
        parts = (data, scene, self._masses, self._contacts, self._angles, self._hands.moves)
        if data is None or scene is None or all(map(operator.is_, parts, self._framed)):
            return self._frame
        try:
            stamp, poses = poses_in(data)
        except ValueError:
            return self._frame
        if len(poses) != len(scene.bones) or not np.isfinite(poses).all():
            return self._frame
        self._framed = parts
        self._frame = self._frame_of(scene, stamp, poses)
        return self._frame

    @property
    def report(self) -> Report:
        """What the node said last, and whether it says anything."""
        silence = time.monotonic() - max(self._heard, self._opened)
        problem = self._problem
        if not self._heard:
            problem = MISSING.format(self._full) if silence > 1.0 else ''
        elif silence > SILENCE:
            problem = SILENT.format(self._full, silence)
        return dataclasses.replace(self._told, problem=problem, note=self._note)

    def want(self, wanted: Wanted) -> None:
        """Subscribe to what is shown, and to nothing else."""
        if wanted != self._wanted:
            self._wanted = wanted
            self._executor.create_task(self._listen)

    def push(self, force: Vector) -> None:
        """Send the velocity that gives this force; the node holds it for its cmd_vel_timeout."""
        scale = self._settings.force_per_speed
        x, y, z = (value / scale if scale else 0.0 for value in force)
        self._velocity.publish(Twist(linear=Vector3(x=x, y=y, z=z)))

    def pause(self, wanted: bool) -> None:
        """Call ~/pause."""
        self._ask.pause(wanted)

    def step(self) -> None:
        """Call ~/step."""
        self._ask.trigger('step')

    def reset(self) -> None:
        """Call ~/reset."""
        self._ask.trigger('reset')

    def set_pace(self, pace: float) -> None:
        """Set real_time_factor."""
        self._ask.set('real_time_factor', float(pace))

    def load(self, name: str) -> None:
        """Set the parameter `scene`; Refused if the node will not take it."""
        self._ask.set_and_wait('scene', name)

    def use(self, scene: Scene) -> None:
        """Write a scene to a file and have the node take that, if it can read it."""
        if self._folder is None:
            # It stays: the node reads it again whenever the parameter is set again.
            self._folder = Path(tempfile.mkdtemp(prefix='ragdoll_viewer_'))
        stem = ''.join(c if c.isalnum() or c in '-_' else '_' for c in scene.name)[:60]
        path = self._folder / f'{stem or "scene"}.yaml'
        save_scene(scene, path)
        try:
            self.load(str(path))
        except Refused as error:
            if errors.Unreadable.__name__ not in str(error):
                raise
            raise Refused(f'the scene was written to {path} on the machine of this page; the node '
                          f'seems to be on another one, as it cannot read that: {error}') from None

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        """Let a hand hold a bone at a point."""
        frame = self._frame
        if frame is not None:
            self._hands.grab(hand, bone, np.array(point), np.array(target), frame)

    def drag(self, hand: str, target: Vector) -> None:
        """Move a hand."""
        self._hands.drag(hand, np.array(target))

    def let_go(self, hand: str) -> None:
        """Open a hand."""
        self._hands.let_go(hand)

    def close(self) -> None:
        """End the thread and leave ROS."""
        self._ended.set()
        self._executor.wake()
        self._thread.join(1.0)
        self._executor.shutdown(timeout_sec=0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        # ROS time may stand, and hands rest on all the same.
        self._node.create_timer(RETRY, self._learn_if_needed,
                                clock=Clock(clock_type=ClockType.STEADY_TIME))
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=1.0)

    def _forget(self) -> None:
        """Know nothing of the node."""
        self._scene: Scene | None = None
        self._settings = Settings()
        self._description: str | None = None
        self._learned = False
        self._told = Report()
        self._zero: int | None = None
        self._zero_of_poses: int | None = None
        self._simulated = 0.0
        self._note = self._problem = ''
        self._poses: bytes | None = None
        self._rods: Rods | None = None
        self._masses = self._contacts = self._angles = None
        self._frame: Frame | None = None
        self._framed: tuple = (None,) * 6
        self._pushes: HeardPushes | None = None

    def _listen(self) -> None:
        """Bring the subscriptions in line with what is wanted."""
        wanted = self._wanted
        if wanted.frames and 'frames' not in self._subscriptions:
            self._opened, self._heard = time.monotonic(), 0.0
        kinds = {'frames': wanted.frames, 'contacts': wanted.contacts, 'angles': wanted.angles,
                 'swings': wanted.frames and self._rods is not None and self._rods.count > 0,
                 'pushes': wanted.frames and self._pushes is not None}
        for kind, on in kinds.items():
            if on and kind not in self._subscriptions:
                self._subscriptions[kind] = getattr(self, f'_hear_{kind}')()
            elif not on:
                self._newest.pop(kind, None)
                for subscription in self._subscriptions.pop(kind, ()):
                    self._node.destroy_subscription(subscription)
        if 'contacts' not in self._subscriptions:
            self._contacts = None
        if 'angles' not in self._subscriptions:
            self._angles = None
        if not wanted.frames:
            self._description, self._learned = None, False

    def _hear_frames(self) -> list:
        create = self._node.create_subscription
        return [*self._hear('frames', PoseArray, f'{NAME}/poses', LATCHED),
                create(String, 'robot_description', self._take_description, LATCHED),
                create(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10),
                create(ParameterEvent, '/parameter_events', self._take_event, 10)]

    def _hear_contacts(self) -> list:
        return self._hear('contacts', PoseArray, f'{NAME}/contacts')

    def _hear_angles(self) -> list:
        return self._hear('angles', JointState, 'joint_states', raw=False)

    def _hear_swings(self) -> list:
        return self._hear('swings', PoseArray, f'{NAME}/swings')

    def _hear(self, kind: str, message: type, topic: str, qos: object = 1,
              raw: bool = True) -> list:
        """Subscribe to what comes with every tick; it is taken when the page draws."""
        self._newest[kind] = Newest(self._node, message, topic, qos, raw)
        return [self._newest[kind].subscription]

    def _hear_pushes(self) -> list:
        self._inputs = Inputs(self._node, Silent(), NAME)
        self._inputs.simulation, self._inputs.settings = self._pushes, self._settings
        return self._inputs.subscriptions

    def _take(self) -> None:
        """Take what has come of all that moves; what is no such message is left."""
        for kind, newest in list(self._newest.items()):
            message = newest.take()
            if message is not None:
                with contextlib.suppress(ValueError):
                    getattr(self, f'_take_{kind}')(message)

    def _take_frames(self, data: bytes) -> None:
        # With the time zero that holds for them: a report of another one comes before its poses.
        self._poses, self._zero_of_poses = data, self._zero
        self._heard = time.monotonic()

    def _take_contacts(self, data: bytes) -> None:
        self._contacts = poses_in(data)[1][:, :3]

    def _take_swings(self, data: bytes) -> None:
        self._masses = poses_in(data)[1][:, :3]

    def _take_angles(self, message: JointState) -> None:
        if self._scene is not None and tuple(message.name) == self._scene.angle_names:
            self._angles = np.array(message.position)

    def _take_description(self, message: String) -> None:
        self._description, self._learned = message.data, False
        self._learn_if_needed()

    def _take_event(self, message: ParameterEvent) -> None:
        """Learn anew when the node's parameters change."""
        if message.node == self._full:
            self._learned = False
            self._learn_if_needed()

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._status:
                self._heard = time.monotonic()
                values = {pair.key: pair.value for pair in status.values}
                self._told = told(self._told, values)
                with contextlib.suppress(KeyError, ValueError):
                    self._take_time(int(values['stamp_of_zero']), float(values['simulated_time']))

    def _take_time(self, zero: int, simulated: float) -> None:
        """Take the stamp of time zero, ns, and the time, s, which goes back at a new start."""
        if simulated < self._simulated:
            self._hands.forget()
        self._zero, self._simulated = zero, simulated

    def _learn_if_needed(self) -> None:
        """Ask what the node simulates, until it is known; called again and again."""
        if time.monotonic() - self._heard > SILENCE:
            self._hands.forget()
        self._hands.keep()
        if self._description is not None and not self._learned:
            self._ask.parameters((BONE_NAMES, *SPECS), self._learn)

    def _learn(self, values: dict) -> None:
        """Take the node's parameters, and its scene if that is another one."""
        names = values.pop(BONE_NAMES)
        if self._description is None or names is None or None in values.values():
            return
        self._settings = Settings(**values)
        self._hands.frame_id = self._settings.frame_id
        try:
            scene, self._note = scene_of_node(self._settings.scene, names, self._description,
                                              self._settings.frame_id)
            self._problem, self._learned = '', True
        except errors.RagdollError as error:
            # Between two scenes the names are those of one and the URDF that of the other.
            self._problem = f'what the node simulates is not clear: {error}'
            return
        if scene != self._scene:
            self._hands.forget()
            self._scene, self._rods = scene, Rods(scene)
            self._masses = self._angles = None
        if self._pushes is None or self._pushes.scene is not self._scene:
            self._pushes = HeardPushes(self._scene)
        if 'pushes' in self._subscriptions:
            self._inputs.simulation, self._inputs.settings = self._pushes, self._settings
        self._listen()

    def _frame_of(self, scene: Scene, stamp: int, poses: np.ndarray) -> Frame:
        unknown = np.full((len(poses), 3), np.nan)
        state = State(poses[:, :3], poses[:, 3:], unknown, unknown)
        # Before the first report the node's time zero is not known.
        self._zero = stamp if self._zero is None else self._zero
        zero = self._zero if self._zero_of_poses is None else self._zero_of_poses
        seconds = (stamp - zero) / SECOND
        rods, masses = None, self._masses
        if masses is not None and self._rods is not None and len(masses) == self._rods.count:
            rods = self._rods.between(masses, state)
        pushes = ()
        if self._pushes is not None and self._pushes.scene is scene:
            self._pushes.time = seconds
            pushes = self._pushes.pushes
        frame = Frame(scene, seconds, state, pushes, rods=rods, contacts=self._contacts,
                      angles=self._angles)
        return dataclasses.replace(frame, held=self._hands.held(frame))


def told(report: Report, values: dict[str, str]) -> Report:
    """Take over what the node's diagnostics tell; what cannot be read stays as it was."""
    try:
        measures = {key: float(values[key]) for key in KEYS if key in values}
        return dataclasses.replace(
            report, paused=values['paused'] == 'True',
            pace=float(values['real_time_factor']), measures=measures)
    except (KeyError, ValueError):
        return report

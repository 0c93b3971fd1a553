"""A source over ROS: shows what the node `ragdoll` publishes and sends it what the page asks for.

The node may be on another machine, may come later, end, and come again with another scene.
"""
from __future__ import annotations

import contextlib
import dataclasses
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterEvent
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from std_msgs.msg import String

from ....files.scene import save_scene
from ....model import errors
from ....model.scene import Scene
from ....model.vectors import Vector
from ....ros.diagnostics import status_name
from ....ros.inputs.subscriptions import PushSubscriptions
from ....ros.outputs import LATCHED
from ..source import Frame, Report, Source, Wanted
from .force import RemoteForce
from .frames import RemoteFrames
from .hands import RemoteHands
from .pushes import HeardPushes, Silent
from .scene import RemoteScene
from .services import Ask, Refused

NAME = 'ragdoll'

MISSING = ('no node `{}` yet: start it with `ros2 run ragdoll_ros ragdoll_node` (same '
           'ROS_DOMAIN_ID); this page goes on by itself')
SILENT = ('the node `{}` has been silent for {:.0f} s: if it has ended, start it again; this page '
          'goes on by itself')

TWINS = ('Several nodes are called `{}`, and the page shows now one, now another: end all but one, '
         'or start each in a namespace of its own.')

SILENCE = 3.0
"""s without a word after which a node counts as gone: it reports once a second."""

RETRY = 0.5
"""s between two tries to learn what the node simulates."""

KEYS = ('work_of_pushes_J', 'work_of_grabs_J', 'energy_excess_J')
"""Measures that the page needs, of those that the diagnostics tell."""


class Remote(Source):
    """Listens to the node in its own namespace, in a thread of its own, while a page is open."""

    def __init__(self, arguments: list[str]) -> None:
        self._context = rclpy.Context()
        try:
            rclpy.init(args=arguments, context=self._context,
                       signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:  # arguments, or a log that can not be written
            raise Refused(f'ROS does not start: {error}') from None
        self._node = Node('ragdoll_viewer', context=self._context)
        self._full = f'{self._node.get_namespace().rstrip("/")}/{NAME}'
        self._status = status_name(self._node.get_namespace(), NAME)
        self._ask = Ask(self._node, NAME)
        self._hands = RemoteHands(self._node, NAME)
        self._frames = RemoteFrames(self._node, NAME, self._hands)
        self._known = RemoteScene(self._ask, self._full, self._go_on)
        self._pushes: HeardPushes | None = None
        self._inputs: PushSubscriptions | None = None
        self._force = RemoteForce(self._node, NAME)
        self._wanted = Wanted()
        self._told = Report()
        self._simulated = 0.0
        self._subscriptions: list[Subscription] = []
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
        return self._frames.newest

    @property
    def report(self) -> Report:
        """What the node said last, and whether it says anything."""
        heard = self._last_word()
        silence = time.monotonic() - max(heard, self._opened)
        problem = self._known.problem
        if heard < self._opened:
            problem = MISSING.format(self._full) if silence > 1.0 else ''
        elif silence > SILENCE:
            problem = SILENT.format(self._full, silence)
        note = ' '.join(filter(None, (self._told.note, self._known.note)))
        return dataclasses.replace(self._told, problem=problem, note=note,
                                   engine=self._known.settings.engine,
                                   accuracy=self._known.settings.accuracy)

    def want(self, wanted: Wanted) -> None:
        if wanted != self._wanted:
            self._wanted = wanted
            self._executor.create_task(self._listen)

    def push(self, force: Vector, duration: float) -> None:
        self._force.send(force, duration / self._told.pace)

    def pause(self, wanted: bool) -> bool:
        return self._ask.pause(wanted)

    def step(self) -> None:
        self._ask.trigger('step')

    def reset(self) -> None:
        self._ask.trigger('reset')

    def set_pace(self, pace: float) -> None:
        self._ask.set('real_time_factor', float(pace))

    def load(self, name: str) -> None:
        """Set the parameter `scene`; Refused if the node will not take it."""
        self._ask.set_and_wait('scene', name)

    def take_engine(self, name: str) -> None:
        """Set the parameter `engine`; Refused if the node will not take it."""
        self._ask.set_and_wait('engine', name)

    def take_accuracy(self, name: str) -> None:
        """Set the parameter `accuracy`; Refused if the node will not take it."""
        self._ask.set_and_wait('accuracy', name)

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
        frame = self.frame
        if frame is not None:
            self._hands.grab(hand, bone, np.array(point), np.array(target), frame)

    def drag(self, hand: str, target: Vector) -> None:
        self._hands.drag(hand, np.array(target))

    def let_go(self, hand: str) -> None:
        self._hands.let_go(hand)

    def close(self) -> None:
        self._ended.set()
        self._force.close()
        self._executor.wake()
        self._thread.join(1.0)
        self._executor.shutdown(timeout_sec=0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        # ROS time may stand, and hands rest on all the same.
        self._node.create_timer(RETRY, self._stay_in_touch,
                                clock=Clock(clock_type=ClockType.STEADY_TIME))
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=1.0)

    def _last_word(self) -> float:
        """Instant at which the node was heard last, s of the steady clock; 0 for never."""
        return max(self._heard, self._frames.heard)

    def _listen(self) -> None:
        """Bring the subscriptions in line with what is wanted."""
        wanted = self._wanted
        if wanted.frames and not self._subscriptions:
            self._opened = time.monotonic()
            create = self._node.create_subscription
            self._subscriptions = [
                create(String, 'robot_description', self._known.take_description, LATCHED),
                create(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10),
                create(ParameterEvent, '/parameter_events', self._known.take_event, 10)]
        elif not wanted.frames:
            self._end(self._subscriptions)
            self._subscriptions = []
            self._known.forget_description()
        self._listen_to_pushes(wanted.frames and self._pushes is not None)
        self._frames.listen(wanted)

    def _listen_to_pushes(self, wanted: bool) -> None:
        if not wanted and self._inputs is not None:
            self._end(self._inputs.subscriptions)
            self._inputs = None
        elif wanted:
            self._inputs = self._inputs or PushSubscriptions(self._node, Silent(), NAME)
            self._inputs.simulation, self._inputs.settings = self._pushes, self._known.settings

    def _end(self, subscriptions: list[Subscription]) -> None:
        for subscription in subscriptions:
            self._node.destroy_subscription(subscription)

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._status:
                self._heard = time.monotonic()
                values = {pair.key: pair.value for pair in status.values}
                # What cannot be read stays as it was.
                with contextlib.suppress(KeyError, ValueError):
                    is_alone = values.get('namesakes', '0') == '0'
                    self._told = dataclasses.replace(
                        self._told, paused=values['paused'] == 'true',
                        note='' if is_alone else TWINS.format(self._full),
                        pace=float(values['real_time_factor']),
                        engine_name=values['engine'], reached=float(values['pace']),
                        tick_cost=float(values['tick_cost_ms']) / 1e3,
                        measures={key: float(values[key]) for key in KEYS if key in values})
                with contextlib.suppress(KeyError, ValueError):
                    zero = int(values['stamp_of_zero']), float(values['stamp_pace'])
                    simulated = float(values['simulated_time'])
                    if simulated < self._simulated:
                        self._hands.forget()
                    self._frames.zero, self._simulated = zero, simulated

    def _stay_in_touch(self) -> None:
        """Hold on with the hands, and learn what is not known; called again and again."""
        if time.monotonic() - self._last_word() > SILENCE:
            self._hands.forget()
        self._hands.keep()
        self._known.ask()

    def _go_on(self) -> None:
        """Go on with what the node is known to simulate now."""
        self._hands.frame_id = self._known.settings.frame_id
        if self._pushes is None or self._pushes.scene != self._known.scene:
            self._hands.forget()
            self._pushes = HeardPushes(self._known.scene)
            self._frames.begin(self._pushes)
        self._listen()

"""A source over ROS: shows what the node `ragdoll` publishes and sends it the page's commands.

The node may run on another machine, start later, end, and restart with another scene.
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
from ....ros.latched_topic import LATCHED
from ..source import Frame, RequestedData, Source, SourceStatus
from .frames import NodeFrames
from .hands import NodeHands
from .motors import StrengthPublisher
from .pushes import ForcePublisher, NoInputCounts, ObservedPushes
from .scene import NodeScene
from .services import NodeServices, Refused
from .states import StatePublisher

NAME = 'ragdoll'

MISSING = ('no node `{}` yet: start it with `ros2 run ragdoll_ros ragdoll_node` (same '
           'ROS_DOMAIN_ID); this page will connect by itself')
SILENT = ('the node `{}` has been silent for {:.0f} s: if it has ended, start it again; this page '
          'will reconnect by itself')

DUPLICATES = ('Several nodes are called `{}`, and the page mixes their messages: end all but one, '
              'or start each in a namespace of its own.')

SILENCE = 3.0
"""s without a message after which a node counts as gone: it reports once a second."""

RETRY = 0.5
"""s between two requests for the scene and between two confirmations of grabs."""

KEYS = ('work_of_pushes_J', 'work_of_grabs_J', 'energy_excess_J')
"""Measures in the diagnostics that the page needs."""


class NodeSource(Source):
    """Subscribes to the node in the viewer's namespace, in a thread, while a page is open."""

    def __init__(self, arguments: list[str]) -> None:
        self._context = rclpy.Context()
        try:
            rclpy.init(args=arguments, context=self._context,
                       signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:  # arguments, or a log that can not be written
            raise Refused(f'ROS does not start: {error}') from None
        self._node = Node('ragdoll_viewer', context=self._context)
        self._full_name = f'{self._node.get_namespace().rstrip("/")}/{NAME}'
        self._diagnostics_name = status_name(self._node.get_namespace(), NAME)
        self._services = NodeServices(self._node, NAME)
        self._hands = NodeHands(self._node, NAME)
        self._frames = NodeFrames(self._node, NAME, self._hands)
        self._scene = NodeScene(self._services, self._full_name, self._use_scene)
        self._pushes: ObservedPushes | None = None
        self._inputs: PushSubscriptions | None = None
        self._force = ForcePublisher(self._node, NAME)
        self._states = StatePublisher(self._node, NAME)
        self._strength = StrengthPublisher(self._node, NAME)
        self._requested = RequestedData()
        self._reported = SourceStatus()
        self._simulated_time = 0.0
        self._subscriptions: list[Subscription] = []
        self._last_report = 0.0
        self._opened = time.monotonic()
        self._folder: Path | None = None
        self._ended = threading.Event()
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name='ros', daemon=True)
        self._thread.start()

    @property
    def frame(self) -> Frame | None:
        """Frame of the last messages that fitted the scene."""
        return self._frames.newest

    def take_frames(self) -> list[Frame]:
        return self._frames.take()

    @property
    def status(self) -> SourceStatus:
        """What the node reported last, and whether it is silent."""
        last = self._last_message()
        silence = time.monotonic() - max(last, self._opened)
        problem, silent = self._scene.problem, silence > SILENCE
        if last < self._opened:
            silent = silence > 1.0
            problem = MISSING.format(self._full_name) if silent else ''
        elif silent:
            problem = SILENT.format(self._full_name, silence)
        note = ' '.join(filter(None, (self._reported.note, self._scene.note)))
        return dataclasses.replace(self._reported, problem=problem, silent=silent, note=note,
                                   engine=self._scene.settings.engine,
                                   accuracy=self._scene.settings.accuracy)

    @property
    def pushed_bone(self) -> str:
        return self._scene.settings.pushed_bone

    def request(self, requested: RequestedData) -> None:
        if requested != self._requested:
            self._requested = requested
            self._executor.create_task(self._update_subscriptions)

    def push(self, force: Vector, duration: float) -> None:
        self._force.send(force, duration / self._reported.real_time_factor)

    def push_bone(self, bone: str) -> None:
        self._services.set_parameter('pushed_bone', bone)

    def pause(self, paused: bool) -> bool:
        return self._services.pause(paused)

    def step(self) -> None:
        self._services.trigger('step')

    def reset(self) -> None:
        self._services.trigger('reset')

    def go_limp(self) -> None:
        self._services.trigger('go_limp')

    def set_strength(self, strength: float) -> None:
        self._strength.send(strength)

    def set_real_time_factor(self, factor: float) -> None:
        self._services.set_parameter('real_time_factor', float(factor))

    def load(self, name: str) -> None:
        self._services.set_parameter_and_wait('scene', name)

    def set_engine(self, name: str) -> None:
        self._services.set_parameter_and_wait('engine', name)

    def set_accuracy(self, name: str) -> None:
        self._services.set_parameter_and_wait('accuracy', name)

    def set_scene(self, scene: Scene) -> None:
        """Write the scene to a temporary file and let the node load that; Refused."""
        if self._folder is None:
            # Kept: the node reads the file again whenever the parameter is set again.
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
                          f'seems to run on another one, as it cannot read it: {error}') from None

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        frame = self.frame
        if frame is not None:
            self._hands.grab(hand, bone, np.array(point), np.array(target), frame)

    def drag(self, hand: str, target: Vector) -> None:
        self._hands.drag(hand, np.array(target))

    def let_go(self, hand: str) -> None:
        self._hands.let_go(hand)

    def set_state(self, doll: str, position: Vector, velocity: Vector) -> None:
        self._states.send(self._scene.settings.frame_id, doll, position, velocity)

    def close(self) -> None:
        self._ended.set()
        self._force.close()
        self._executor.wake()
        self._thread.join(1.0)
        self._executor.shutdown(timeout_sec=0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        # A steady clock: ROS time may stop while hands still hold something.
        self._node.create_timer(RETRY, self._keep_in_touch,
                                clock=Clock(clock_type=ClockType.STEADY_TIME))
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=1.0)

    def _last_message(self) -> float:
        """When the node's last message came, s of the steady clock; 0 for never."""
        return max(self._last_report, self._frames.last_poses)

    def _update_subscriptions(self) -> None:
        """Subscribe to the requested data, and end other subscriptions."""
        requested = self._requested
        if requested.frames and not self._subscriptions:
            self._opened = time.monotonic()
            create = self._node.create_subscription
            self._subscriptions = [
                create(String, f'{NAME}/scene', self._scene.take_text, LATCHED),
                create(String, 'robot_description', self._scene.take_description, LATCHED),
                create(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10),
                create(ParameterEvent, '/parameter_events', self._scene.take_event, 10)]
        elif not requested.frames:
            self._end(self._subscriptions)
            self._subscriptions = []
            self._scene.forget()
        self._update_inputs(requested.frames and self._pushes is not None)
        self._frames.subscribe(requested)

    def _update_inputs(self, requested: bool) -> None:
        """Subscribe to the topics that push, or end these subscriptions."""
        if not requested and self._inputs is not None:
            self._end(self._inputs.subscriptions)
            self._inputs = None
        elif requested:
            self._inputs = self._inputs or PushSubscriptions(self._node, NoInputCounts(), NAME)
            self._inputs.simulation, self._inputs.settings = self._pushes, self._scene.settings

    def _end(self, subscriptions: list[Subscription]) -> None:
        for subscription in subscriptions:
            self._node.destroy_subscription(subscription)

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._diagnostics_name:
                self._last_report = time.monotonic()
                values = {pair.key: pair.value for pair in status.values}
                # Values that cannot be read stay as they were.
                with contextlib.suppress(KeyError, ValueError):
                    is_alone = values.get('namesakes', '0') == '0'
                    self._reported = dataclasses.replace(
                        self._reported, paused=values['paused'] == 'true',
                        note='' if is_alone else DUPLICATES.format(self._full_name),
                        real_time_factor=float(values['real_time_factor']),
                        engine_name=values['engine'],
                        measured_real_time_factor=float(values['pace']),
                        tick_cost=float(values['tick_cost_ms']) / 1e3,
                        measures={key: float(values[key]) for key in KEYS if key in values})
                with contextlib.suppress(KeyError, ValueError):
                    simulated = float(values['simulated_time'])
                    if simulated < self._simulated_time:
                        self._hands.clear()
                    self._simulated_time = simulated

    def _keep_in_touch(self) -> None:
        """Timer callback: confirm grabs, send what waits, and request what is unknown."""
        if time.monotonic() - self._last_message() > SILENCE:
            self._hands.clear()
        self._hands.keep_alive()
        self._strength.retry()
        self._services.retry()
        self._scene.request()

    def _use_scene(self) -> None:
        """Use the scene and parameters that the node is known to have now."""
        self._hands.frame_id = self._scene.settings.frame_id
        if self._pushes is None or self._pushes.scene != self._scene.scene:
            self._hands.clear()
            self._pushes = ObservedPushes(self._scene.scene)
        self._frames.set_scene(self._pushes, self._scene.checksum)
        self._update_subscriptions()

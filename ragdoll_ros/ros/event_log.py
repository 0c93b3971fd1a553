"""The event log of a run: what acts on the simulation on ~/events, the scene on ~/scene.

An event is a JSON object in a String. ``number`` counts events since the node's start, so a gap
shows; ``tick`` is the number of ticks made before it; the other fields depend on ``kind``:

- start: a new simulation: SHA-256 of its scene, engine, accuracy, step in s, samples per tick as
  ``parts``, and SHA-256 of its first state as ``state``
- reset: the simulation is back at its start; the same fields without the state, and ``keep_time``
  if simulated time continues
- push, drive, release, grab, drag, let_go, drive_body, set_state, set_pose_target, set_strength,
  go_limp, remove, step, parts, accuracy, go_back: a call of the simulation
  (physics/logged_simulation.py) with its arguments
- add: such a call; ``placement`` is YAML, a scene of this doll alone
- state: ``sha256`` of the state, every HASH_INTERVAL ticks, while there is a subscriber
- unload: the end of the world; no ticks are made until the next start
- limp: for information: which dolls went limp from their animations, when, s, and why
- pause, parameters: for information; their effects on the simulation are events of their own

Floats are written so that they are read back to the same bits.
"""
from __future__ import annotations

import json
from typing import NamedTuple

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from ..files.run_scene import SceneTexts, placement_text, run_scene_text, scene_digest
from ..model.scene import Scene
from ..physics.logged_simulation import LoggedSimulation, state_digest
from .latched_topic import LATCHED

HASH_INTERVAL = 100
"""Ticks between two SHA-256 of the state."""

EVENTS_QOS = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""A late recorder gets the past events: without them a run cannot be repeated."""


class RunScene(NamedTuple):
    """A scene as it is published, and the digest by which events refer to it."""

    text: str
    digest: str


class EventLog:
    """Publisher of ~/events and ~/scene."""

    def __init__(self, node: Node) -> None:
        self._events = node.create_publisher(String, '~/events', EVENTS_QOS)
        self._scenes = node.create_publisher(String, '~/scene', LATCHED)
        self._scene: Scene | None = None
        self._simulation: LoggedSimulation | None = None
        self._texts = SceneTexts()
        self._number = self._tick = 0

    def prepare(self, scene: Scene) -> RunScene:
        """Return the text of a scene and its digest, for set_simulation(). This may run beside the
        ticks.
        """
        self._texts.keep(scene)
        text = run_scene_text(scene, self._texts)
        return RunScene(text, scene_digest(text))

    def set_simulation(self, simulation: LoggedSimulation, prepared: RunScene) -> None:
        """Log this simulation from now on. Publish its scene unless that was published last."""
        if simulation.scene is not self._scene:
            self._scene, self._digest = simulation.scene, prepared.digest
            self._scenes.publish(String(data=prepared.text))
        if simulation is self._simulation:
            return
        self._simulation, simulation.on_event = simulation, self.publish
        self.publish('start', {**simulation.conditions, 'state': state_digest(simulation.state)})

    def unload(self) -> None:
        """Log that there is no world; the text on ~/scene is empty."""
        self.publish('unload', {})
        if self._simulation is not None:
            del self._simulation.on_event
        self._scene = self._simulation = None
        self._scenes.publish(String())

    def publish(self, kind: str, fields: dict) -> None:
        """Publish an event."""
        if kind in ('start', 'reset'):
            fields = {'scene': self._digest, **fields}
        elif kind == 'add':
            fields = {'placement': placement_text(fields['placement'], self._texts)}
        event = {'number': self._number, 'tick': self._tick, 'kind': kind, **fields}
        self._number += 1
        self._events.publish(String(data=json.dumps(event)))

    def count_tick(self) -> None:
        """Count a tick, and publish the digest of the state when it is due."""
        self._tick += 1
        if self._tick % HASH_INTERVAL == 0 and self._events.get_subscription_count():
            self.publish('state', {'sha256': state_digest(self._simulation.state)})

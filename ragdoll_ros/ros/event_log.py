"""A run as a log: what acts on the simulation on ~/events, the scene on ~/scene.

An event is a JSON object in a String. ``number`` counts events from the node's start, so that a gap
is seen, ``tick`` the ticks made before it, ``kind`` says what the rest is:

- start: a simulation is new; its scene's SHA-256, engine, accuracy, step in s, its first state's
  SHA-256 as ``state``
- reset: it is back at its start; the same, but for the state
- push, drive, release, grab, drag, let_go, step, accuracy, go_back: an act of
  physics/logged_simulation.py, its arguments
- state: ``sha256`` of the state, every HASHED ticks, while somebody listens
- pause, parameters: for who reads along; what they do to the simulation is told by the others

Numbers are written so that they read back to the same bits.
"""
from __future__ import annotations

import json

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from ..files.run_scene import run_scene_text, scene_digest
from ..physics.logged_simulation import LoggedSimulation, state_digest
from .outputs import LATCHED

HASHED = 100
"""Ticks from one SHA-256 of the state to the next."""

PAST = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""A recorder that comes late gets what has acted so far: without it no run can be repeated."""


class RunLog:
    """Publishes what acts on the node's simulation, and what it is."""

    def __init__(self, node: Node) -> None:
        self._events = node.create_publisher(String, '~/events', PAST)
        self._scene = node.create_publisher(String, '~/scene', LATCHED)
        self._simulation: LoggedSimulation | None = None
        self._number = self._tick = 0

    def follow(self, simulation: LoggedSimulation) -> None:
        """Tell of this simulation from now on; of the same one again, nothing new."""
        if simulation is self._simulation:
            return
        self._simulation, simulation.on_event = simulation, self.tell
        text = run_scene_text(simulation.scene)
        self._digest = scene_digest(text)
        self._scene.publish(String(data=text))
        self.tell('start', {**simulation.conditions, 'state': state_digest(simulation.state)})

    def tell(self, kind: str, fields: dict) -> None:
        """Publish an event."""
        if kind in ('start', 'reset'):
            fields = {'scene': self._digest, **fields}
        event = {'number': self._number, 'tick': self._tick, 'kind': kind, **fields}
        self._number += 1
        self._events.publish(String(data=json.dumps(event)))

    def count_tick(self) -> None:
        """Count a tick that was made."""
        self._tick += 1
        if self._tick % HASHED == 0 and self._events.get_subscription_count():
            self.tell('state', {'sha256': state_digest(self._simulation.state)})

"""The node's log lines at start and end."""
from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rclpy.node import Node

from ..model.scene import SECOND
from .parameters.node_settings import NodeSettings

if TYPE_CHECKING:
    from ..physics.simulation import Simulation

MOST_DRIVEN = 3
"""Bodies and robots whose topics the first line has."""


def start_line(simulation: Simulation, settings: NodeSettings, node: Node,
               moved_by: Mapping[str, Sequence[str]]) -> str:
    """Scene, engine, with the reason if it is not the requested one, accuracy and topics.
    ``moved_by``: topics that move bodies and robots, by the names of these.
    """
    scene, reason = simulation.scene, simulation.engine_reason
    dolls = [placement.doll for placement in scene.dolls if placement.follow is None]
    driven = ''.join(f', {name} moved by {" and ".join(topics)}'
                     for name, topics in itertools.islice(moved_by.items(), MOST_DRIVEN))
    if len(moved_by) > MOST_DRIVEN:
        driven += f', and {len(moved_by) - MOST_DRIVEN} more'
    return (f'scene {scene.name}: {counted(len(dolls), "doll")} of '
            f'{counted(sum(len(doll.bones) for doll in dolls), "bone")}{driven}, '
            f'engine {simulation.engine_name}'
            + (f' (as {reason})' if reason else '')
            + f', accuracy {settings.accuracy}; poses on '
            f'{node.resolve_topic_name("~/poses")}, '
            f'status on {node.resolve_topic_name("/diagnostics")}')


def end_line(simulation: Simulation, refused: int, dropped: int) -> str:
    """Simulated time, refused inputs and dropped ticks."""
    return (f'ended at {simulation.time / SECOND:.9g} s of simulated time; '
            f'{counted(refused, "input")} refused, {counted(dropped, "tick")} dropped')


def counted(count: int, noun: str) -> str:
    """A number with its noun, in the plural unless it is one."""
    return f'{count} {noun}' + ('' if count == 1 else 's')

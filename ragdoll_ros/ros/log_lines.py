"""The node's log lines at start and end."""
from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.node import Node

from ..model.scene import SECOND
from .parameters.node_settings import NodeSettings

if TYPE_CHECKING:
    from ..physics.simulation import Simulation


def start_line(simulation: Simulation, settings: NodeSettings, node: Node) -> str:
    """Scene, engine, with the reason if it is not the requested one, accuracy and topics."""
    scene, reason = simulation.scene, simulation.engine_reason
    return (f'scene {scene.name}: {counted(len(scene.dolls), "doll")} of '
            f'{counted(len(scene.bones), "bone")}, engine {simulation.engine_name}'
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

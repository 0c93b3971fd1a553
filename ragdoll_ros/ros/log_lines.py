"""What the node says of itself in the log: one line as it begins, one as it ends."""
from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.node import Node

from ..model.scene import SECOND
from .parameters import Settings

if TYPE_CHECKING:
    from ..physics.simulation import Simulation


def start_line(simulation: Simulation, settings: Settings, node: Node) -> str:
    """What is simulated, by which engine, and why that one where another was wanted."""
    scene, reason = simulation.scene, simulation.engine_reason
    return (f'scene {scene.name}: {counted(len(scene.dolls), "doll")} of '
            f'{counted(len(scene.bones), "bone")}, engine {simulation.engine_name}'
            + (f' (as {reason})' if reason else '')
            + f', accuracy {settings.accuracy}; poses are on '
            f'{node.get_fully_qualified_name()}/poses, how it goes on /diagnostics')


def end_line(simulation: Simulation, refused: int, dropped: int) -> str:
    """How far it came, and what did not go as asked."""
    return (f'ended at {simulation.time / SECOND:.9g} s of simulated time; '
            f'{counted(refused, "input")} refused, {counted(dropped, "tick")} dropped')


def counted(count: int, thing: str) -> str:
    """A number with its noun."""
    return f'{count} {thing}' + ('' if count == 1 else 's')

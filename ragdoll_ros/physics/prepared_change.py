"""PreparedChange: what a change of dolls needs that no state determines, made before it."""
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..model.coordinates import GeneralizedState
from ..model.scene_change import SceneChange
from .engine.protocol import Engine
from .sleeping import SleepDetector
from .stability import StabilityTest

if TYPE_CHECKING:
    from .swing.swings import SwingSimulation


@dataclass(frozen=True)
class PreparedChange:
    """A change of a simulation's dolls, and what simulates the scene after it, at its start."""

    change: SceneChange
    placed: GeneralizedState | None
    """Where the scene after the change starts, unless that is as its dolls are placed."""
    engine: Engine
    start: object
    """The engine's snapshot of the start."""
    sleep_detector: SleepDetector
    stability_test: StabilityTest
    swings: SwingSimulation | None

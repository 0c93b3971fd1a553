"""PreparedChange: the parts of a change of dolls that need no state, made before the change."""
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
    """A change of a simulation's dolls, and all that simulates the scene after the change, at the
    start of that scene.
    """

    change: SceneChange
    placed: GeneralizedState | None
    """Where the scene after the change starts, unless that is as its dolls are placed."""
    engine: Engine
    start: object
    """The engine's snapshot of the start."""
    sleep_detector: SleepDetector
    stability_test: StabilityTest
    swings: SwingSimulation | None

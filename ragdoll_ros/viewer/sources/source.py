"""What a page shows and controls: one protocol for a simulation here, a node, and a recording.

A source has its own clock and threads. It keeps its newest frame ready for the page to draw.
Commands of the page are queued and do not block, unless a method says that it waits.
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...model.push import Push
from ...model.scene import Scene
from ...model.state import State
from ...model.vectors import Vector
from ...physics.sensors.impact_arrow import ImpactArrow
from ...recordings.recording import Recording

REAL_TIME_FACTORS = (0.001, 100.0)
"""Lowest and highest, as the node's parameter real_time_factor."""


@dataclass(frozen=True)
class GrabbedPoint:
    """A point of a bone that a hand holds, and the target it is pulled to; (3,) m, world frame."""

    bone: str
    point: np.ndarray
    target: np.ndarray


@dataclass(frozen=True)
class Frame:
    """All that is drawn, at one instant. What was not requested may be None or empty."""

    scene: Scene
    """Compared by identity: another scene is another object."""
    time: float
    """s simulated since the start of the run."""
    state: State
    """Velocities are NaN where the source has poses only."""
    pushes: tuple[Push, ...] = ()
    grabs: tuple[GrabbedPoint, ...] = ()
    rods: np.ndarray | None = None
    """(m, 2, 3) m: both ends of every rod of the swings."""
    contacts: np.ndarray | None = None
    """(c, 3) m: contact points."""
    angles: np.ndarray | None = None
    """(k,) rad: joint angles, in the order of Scene.angle_names."""
    forces: np.ndarray | None = None
    """(c, 3) N: normal force at each contact; a node does not publish them."""
    impacts: tuple[ImpactArrow, ...] = ()
    """Arrows of the impacts of the last second; none unless requested."""
    pairs: np.ndarray | None = None
    """(c, 3) a, b and bodies of Contacts; where forces are known."""
    run: int = 0
    """Number of the run: another one after each reset and restart."""
    energy: float = math.nan
    """Energy of all dolls since the start, J; NaN: unknown."""
    work: float = math.nan
    """Work of pushes and hands since the start, J; NaN: unknown."""


@dataclass(frozen=True)
class SourceStatus:
    """State of a source besides its frames."""

    problem: str = ''
    """What is wrong, as text for the page; empty if nothing is."""
    silent: bool = False
    """Whether it is a node of which no messages come."""
    note: str = ''
    """Information on what is shown; may be empty."""
    paused: bool = False
    real_time_factor: float = 1.0
    """Requested simulated time per wall time."""
    engine: str = ''
    """Name of the requested engine; empty if there is none."""
    engine_name: str = ''
    """Name of the engine in use; empty if unknown."""
    accuracy: str = ''
    """Name of the accuracy; empty if there is none."""
    measured_real_time_factor: float = math.nan
    """Over the last second of wall time; NaN: unknown."""
    tick_cost: float = math.nan
    """Mean wall time of computing a tick over the last second, s; NaN: unknown."""
    measures: dict[str, float] = field(default_factory=dict)
    """Simulation.measures(), at most about a second old; older in a crowd."""


@dataclass(frozen=True)
class RequestedData:
    """Data that the page needs; a source need not produce anything else."""

    frames: bool = False
    """Whether any page is open."""
    contacts: bool = False
    angles: bool = False
    impacts: bool = False


class Source(Protocol):
    """Provides frames and takes commands, from any thread.

    Ignores commands that it does not support, or refuses them with a RagdollError.
    """

    @property
    def frame(self) -> Frame | None:
        """The newest frame, a new object for each instant; None before the first."""

    def take_frames(self) -> Sequence[Frame]:
        """All new frames since the last call, oldest first; the oldest of many are lost."""

    @property
    def recording(self) -> Recording | None:
        """The whole run, where it is known from the start."""
        return None

    def frame_at(self, instant: float) -> Frame:
        """Frame of the recording at an instant, s."""

    def seek(self, instant: float) -> None:
        """Pause the recording at an instant, s."""

    @property
    def status(self) -> SourceStatus:
        """The current status."""

    @property
    def pushed_bone(self) -> str:
        """Name of the bone that pushes act on; empty if unknown."""
        return ''

    def request(self, requested: RequestedData) -> None:
        """Set which data the page needs from now on."""

    def push(self, force: Vector, duration: float) -> None:
        """Push the pushed bone with ``force``, N, world axes, for ``duration`` s simulated or until
        the next push.
        """

    def push_bone(self, bone: str) -> None:
        """Let pushes act on another bone of the scene."""

    def pause(self, paused: bool) -> bool:
        """Pause or resume; False if that is not possible yet, because no node is running."""

    def step(self) -> None:
        """Advance by one tick while paused."""

    def reset(self) -> None:
        """Go back to the start."""

    def go_limp(self) -> None:
        """Let all dolls go limp that animations or motors move."""

    def set_strength(self, strength: float) -> None:
        """Set the strength of all motors, 0 to 1, until the next reset."""

    def set_real_time_factor(self, factor: float) -> None:
        """Set the simulated time per wall time."""

    def load(self, name: str) -> None:
        """Load a scene by its name in config/ or its path; waits; RagdollError if refused."""

    def set_engine(self, name: str) -> None:
        """Restart with another engine; waits; RagdollError if refused."""

    def set_accuracy(self, name: str) -> None:
        """Continue with another accuracy; waits; RagdollError if refused."""

    def set_scene(self, scene: Scene) -> None:
        """Restart with a scene; waits; RagdollError with the reason if refused."""

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        """Hold a bone at ``point``, m, bone frame; pull this point to ``target``, m, world frame. A
        point that is not finite is ignored, also by `drag`.
        """

    def drag(self, hand: str, target: Vector) -> None:
        """Move the target of a hand, m, world frame."""

    def let_go(self, hand: str) -> None:
        """Release what a hand holds, if anything."""

    def set_state(self, doll: str, position: Vector, velocity: Vector) -> None:
        """Set the ``position``, m, and ``velocity``, m/s, of a doll's root in the world frame, and
        align its axes with the world's; joint angles stay.
        """

    def close(self) -> None:
        """End the threads and release all resources."""

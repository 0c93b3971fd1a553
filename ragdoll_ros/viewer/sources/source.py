"""What a page shows and steers: one protocol for a doll in this process, a node's, a recording.

A source has its own time and threads. It holds its newest frame ready, and the page takes that
when it draws; what the page asks for is queued and never blocks, but for `use`.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...model.push import Push
from ...model.scene import Scene
from ...model.state import State
from ...model.vectors import Vector
from ...recordings.recording import Recording

PACES = (0.001, 100.0)
"""Slowest and fastest, as the node's real_time_factor."""


@dataclass(frozen=True)
class Held:
    """What a hand holds: the grabbed point and where it is pulled to, (3,) m, world frame."""

    bone: str
    point: np.ndarray
    target: np.ndarray


@dataclass(frozen=True)
class Frame:
    """Everything that moves, at one instant. What was not asked for is None."""

    scene: Scene
    """What it is of. Another scene, another object."""
    time: float
    """s simulated since the start."""
    state: State
    """A node tells no velocities with its poses: they are NaN then."""
    pushes: tuple[Push, ...] = ()
    held: tuple[Held, ...] = ()
    rods: np.ndarray | None = None
    """(m, 2, 3) m: both ends of every rod of the swings."""
    contacts: np.ndarray | None = None
    """(c, 3) m: where something touches."""
    angles: np.ndarray | None = None
    """(k,) rad, in the order of Scene.angle_names."""
    forces: np.ndarray | None = None
    """(c, 3) N: what presses at each of the contacts, along its normal; a node does not tell it."""


@dataclass(frozen=True)
class Report:
    """How the source does, besides its frames."""

    problem: str = ''
    """What is wrong, in words for who looks at the page; empty if nothing is."""
    note: str = ''
    """What should be known of what is shown."""
    paused: bool = False
    pace: float = 1.0
    """s simulated for each s on the wall that are asked for."""
    engine: str = ''
    """The engine that was asked for, by its name; empty where there is none."""
    engine_name: str = ''
    """The engine that simulates; empty where that is not known."""
    accuracy: str = ''
    """The accuracy that it computes with, by its name; empty where there is none."""
    reached: float = math.nan
    """s simulated for each s on the wall, over the last second; NaN: not known."""
    tick_cost: float = math.nan
    """Mean s on the wall that a tick takes to compute, over the last second; NaN: not known."""
    measures: dict[str, float] = field(default_factory=dict)
    """As Simulation.measures() has them, no older than a second, or some more in a crowd."""


@dataclass(frozen=True)
class Wanted:
    """What is shown: a source need not work for anything else."""

    frames: bool = False
    """Whether any page is open."""
    contacts: bool = False
    angles: bool = False


class Source(Protocol):
    """Where frames come from and commands go to; what a source has not, does nothing.

    All may be called from any thread.
    """

    @property
    def frame(self) -> Frame | None:
        """The newest frame; None before the first. Another instant, another object."""

    @property
    def recording(self) -> Recording | None:
        """All that it will ever show, where that is known from the start."""
        return None

    def frame_at(self, instant: float) -> Frame:
        """What its recording has at an instant, s."""

    @property
    def report(self) -> Report:
        """How it does now."""

    def want(self, wanted: Wanted) -> None:
        """Say what is shown from now on."""

    def push(self, force: Vector, duration: float) -> None:
        """Push the pushed bone with a force, N, world axes, for so many s of simulated time.

        The next push takes its place.
        """

    def pause(self, wanted: bool) -> bool:
        """Hold the time, or let it go on; False if there is none yet, as no node is there."""

    def step(self) -> None:
        """Make one tick while paused."""

    def reset(self) -> None:
        """Go back to the start."""

    def set_pace(self, pace: float) -> None:
        """Ask for ``pace`` simulated s for each s on the wall."""

    def load(self, name: str) -> None:
        """Take another scene, by its name in config/ or its path; waits; RagdollError if not."""

    def take_engine(self, name: str) -> None:
        """Start anew with another engine, by its name; waits; RagdollError if not."""

    def take_accuracy(self, name: str) -> None:
        """Go on with another accuracy, by its name; waits; RagdollError if not."""

    def use(self, scene: Scene) -> None:
        """Start anew with a scene; waits until it is so; RagdollError with the reason if not."""

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        """Let a hand hold a bone at ``point`` (m, from its centre of mass, its axes).

        It is pulled to ``target``, m, world frame.
        """

    def drag(self, hand: str, target: Vector) -> None:
        """Pull what the hand holds to ``target``, m, world frame."""

    def let_go(self, hand: str) -> None:
        """Open a hand; one that holds nothing stays as it is."""

    def close(self) -> None:
        """End its threads and give everything back."""

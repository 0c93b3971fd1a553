"""What an engine must be able to do. Everything is SI, world frame, quaternions x, y, z, w."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.state import State

GROUND = -1
"""Index that stands for the ground where a bone's would stand."""

PRESSED = 0.025
"""Overlap, as a share of half the thinnest bone's thickness, up to which bones rest or slide on
each other where a motion starts. What overlaps by more was put there, and would burst apart."""


@dataclass(frozen=True)
class Contact:
    """Two things that touch: bone ``a`` with bone ``b``, or with the GROUND.

    ``position`` (3,) m on a's surface, ``normal`` (3,) from b to a, ``depth`` m (negative: a gap),
    ``force`` N along the normal in the last substep.
    """

    a: int
    b: int
    position: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


@dataclass(frozen=True)
class AppliedWrench:
    """A force (3,) N and a torque (3,) N m on a bone, for one step.

    ``point`` (3,) m is where the force attacks, from the bone's centre of mass along the bone's
    own axes. ``local``: so are force and torque, else they are along the world's.
    """

    bone: int
    force: np.ndarray
    torque: np.ndarray
    point: np.ndarray
    local: bool = False


Wrenches = Sequence[AppliedWrench]
"""All that acts during one step."""


class Engine(Protocol):
    """A scene in motion. ``free``: nothing touches and no joint has a limit."""

    scene: Scene
    layout: DofLayout

    def __init__(self, scene: Scene, free: bool = False) -> None: ...

    def step(self, duration: float, substeps: int, loads: Wrenches = ()) -> None:
        """Go on by ``duration`` s in equal substeps, under ``loads`` that do not turn."""

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        """Rates of change of ``coordinates.v``; leaves the engine in no state to go on from."""

    def read(self) -> State:
        """Poses and velocities of all bones."""

    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates of all dolls."""

    def place(self, coordinates: GeneralizedState) -> None:
        """Put all dolls where ``coordinates`` says."""

    def joint_angles(self) -> np.ndarray:
        """All joint angles in rad, in the order of Scene.angle_names."""

    def touching(self) -> set[tuple[int, int]]:
        """Pairs of dolls that touch where they are now; GROUND stands for the ground."""

    def touched(self) -> set[tuple[int, int]]:
        """Pairs of dolls that touched in the last substep, as it saw them."""

    def set_solver_iterations(self, wanted: bool) -> None:
        """Solve contacts that bear on each other, or as fast as is enough for others."""

    def set_ground_friction(self, wanted: bool) -> None:
        """Take the ground's friction away, or give it back."""

    def exclude_initial_penetrations(self) -> None:
        """Let bones of one doll that overlap by more than pressed() now collide no more."""

    def contacts(self) -> list[Contact]:
        """What touches at the end of the last substep."""

    def save(self) -> object:
        """A snapshot that restore brings back to the bit."""

    def restore(self, snapshot: object) -> None:
        """Go back to a snapshot."""

    def forget(self, snapshot: object) -> None:
        """Release what a snapshot holds."""

    def close(self) -> None:
        """Release everything."""


def pressed(scene: Scene) -> float:
    """Depth, m, up to which a scene's bones may rest in each other and in the ground."""
    return PRESSED * min(min(part.shape.half_extents)
                         for bone in scene.bones for part in bone.shape.parts)

"""What an engine must be able to do. Everything is SI, world frame, quaternions x, y, z, w."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..scene import Scene
from ..state import State

GROUND = -1
"""Index that stands for the ground where a bone's would stand."""


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
class Coordinates:
    """Generalised coordinates of all dolls, one behind the other (Featherstone's q and q').

    For each doll ``q`` holds the root's position (3) and orientation (4), then the joints' from
    root to leaf: one angle (rad) an axis, a quaternion (4) for a free ball joint, which takes
    the child's vectors to the joint's frame. ``v`` holds the root's linear (3) and angular (3)
    velocity in the world frame, then the joints' rates (rad/s), a free ball joint's three along
    the child's side of the joint's frame.
    """

    q: np.ndarray
    v: np.ndarray


class Engine(Protocol):
    """A scene in motion."""

    scene: Scene
    most_substeps: int

    def step(self, duration: float, substeps: int) -> None:
        """Go on by ``duration`` s in equal substeps; pushes act on all of them and then end."""

    def push(self, bone: int, force: np.ndarray, torque: np.ndarray, point: np.ndarray) -> None:
        """Let a force (N) at a point (m) and a torque (N m) act in the next step."""

    def read(self) -> State:
        """Poses and velocities of all bones."""

    def coordinates(self) -> Coordinates:
        """Generalised coordinates of all dolls."""

    def place(self, coordinates: Coordinates) -> None:
        """Put all dolls where ``coordinates`` says."""

    def shift_velocity(self, doll: int, linear: np.ndarray, angular: np.ndarray) -> None:
        """Add a velocity (m/s) and a spin (rad/s) to a doll's root: the whole doll gains both."""

    def joint_angles(self) -> np.ndarray:
        """All joint angles in rad, in the order of Scene.angle_names."""

    def contacts(self) -> list[Contact]:
        """What touches at the end of the last substep."""

    def save(self) -> object:
        """Give a snapshot that restore brings back to the bit."""

    def restore(self, snapshot: object) -> None:
        """Go back to a snapshot."""

    def close(self) -> None:
        """Give everything back to the system."""

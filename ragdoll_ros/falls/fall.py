"""One fall: how it began, what it went through, when it began, hit and ended."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model import rotation
from ..model.scene import Scene


@dataclass(frozen=True)
class Phases:
    """Frames at which a fall begins, hits and ends; None where it does not."""

    onset: int | None = None
    """First from which on the centre of mass sinks faster than the recipe's onset_speed for 0.1 s,
    or until the impact; the impact's where none before it is."""
    impact: int | None = None
    """First in which a bone touches the ground that is none of the recipe's feet."""
    rest: int | None = None
    """First, after the impact, from which on no bone is faster than the recipe's rest_speed."""


@dataclass(frozen=True)
class Fall:
    """Fall ``number`` of a recipe, t frames of n bones and k joint angles, world frame, SI units.

    Of a fall that failed, all frames from the failure on hold NaN, and ``failure`` says why.
    """

    number: int
    drawn: dict
    """What was drawn for it, as Recipe.draw tells."""
    scene: Scene
    """What it was simulated in; its order of bones and of joint angles is that of all arrays."""
    times: np.ndarray
    """(t,) s from the start."""
    states: np.ndarray
    """(t, n, 13): position m, orientation x, y, z, w, linear m/s and angular rad/s velocity of
    each bone, as State.rows."""
    angles: np.ndarray
    """(t, k) rad, in the order of Scene.angle_names."""
    rates: np.ndarray
    """(t, k) rad/s."""
    touching: np.ndarray
    """(t, n) whether each bone touches the ground."""
    imus: list[dict]
    """The recipe's w sensors."""
    parts: int
    """Their samples in each frame."""
    worn: np.ndarray
    """((t - 1) parts + 1, w, 13) as ``states``, of the bones that wear them, at the instants of
    their samples."""
    valid: int
    """Frames before a failure; all of them if there was none."""
    failure: str
    phases: Phases
    energy_excess: float
    """J that nothing put in, at the last valid frame; losses make it negative."""
    noise_key: int = 0
    """Philox's, for what sensors add: the recipe's, 128 bits."""

    @property
    def masses(self) -> np.ndarray:
        """(n,) kg."""
        return np.array([bone.mass for bone in self.scene.bones])

    @property
    def direction(self) -> float:
        """Degrees, from -180 to 180, in which the centre of mass goes from the start to the impact,
        as seen from where the doll faces at the start: 0 forwards, 90 to its left; NaN without an
        impact.
        """
        if self.phases.impact is None:
            return math.nan
        ends = self.states[[0, self.phases.impact], :, :2]
        x, y = np.diff(np.einsum('tnk,n->tk', ends, self.masses), axis=0)[0]
        faced = rotation.rotate(self.scene.dolls[0].orientation, (1.0, 0.0, 0.0))
        turned = math.degrees(math.atan2(y, x) - math.atan2(faced[1], faced[0]))
        return (turned + 180) % 360 - 180

    @property
    def impact_velocities(self) -> np.ndarray:
        """(n, 3) m/s: of each bone's centre of mass in the last frame before it first touches the
        ground; NaN for bones that never do, or do from the start.
        """
        first = self.touching[:self.valid].argmax(axis=0)
        return np.where((first > 0)[:, None],
                        self.states[first - 1, np.arange(len(first)), 7:10], np.nan)

"""What the bones of a scene can reach: the ground, and each other's doll, within a time."""
from __future__ import annotations

import math

import numpy as np

from ...model.scene import Scene
from ...model.shapes import support_distance
from ...model.state import State
from ..engine.protocol import GROUND

MARGIN = 0.005
"""m: as near as this counts as reached."""


class Reach:
    """Sizes of all bones of a scene as arrays, and what follows from them."""

    def __init__(self, scene: Scene) -> None:
        bones = scene.bones
        self._sizes = np.array([bone.shape.support for bone in bones])
        self._radii = np.array([math.hypot(*bone.shape.half_extents) for bone in bones])
        self._thinnest = min(min(bone.shape.half_extents) for bone in bones)
        self._ground = scene.ground
        self._normal = np.array(scene.ground.normal if scene.ground else (0, 0, 1))
        self._bounds = np.array([0, *(own.stop for own in scene.bone_slices)], np.int64)
        self._last: tuple[State | None, np.ndarray] = (None, np.zeros(0))
        """The heights told last, and of which state."""

    def heights(self, state: State) -> np.ndarray:
        """Distances (n,) m of the bones' lowest points from the ground; infinity without one."""
        if self._ground is None:
            return np.full(len(self._radii), math.inf)
        if self._last[0] is not state:
            reach = support_distance(self._sizes, self._normal @ state.rotation_matrices)
            self._last = (state, state.positions @ self._normal - self._ground.offset - reach)
        return self._last[1]

    def clearance(self, state: State) -> float:
        """Distance, m, that all bones keep from the ground at the least: a lower bound if far."""
        if self._ground is None:
            return math.inf
        bound = float((state.positions @ self._normal - self._radii).min()) - self._ground.offset
        return bound if bound > MARGIN else float(self.heights(state).min())

    def falling(self, state: State, soon: float) -> float:
        """Largest speed, m/s, at which any point of a bone that can reach the ground sinks."""
        if self._ground is None:
            return 0.0
        spins = np.sqrt(np.einsum('ij,ij->i', state.angular_velocities, state.angular_velocities))
        speeds = self._radii * spins - state.linear_velocities @ self._normal
        lowest = state.positions @ self._normal - self._ground.offset - self._radii
        if (lowest > speeds * soon + MARGIN).all():
            return 0.0
        return float(speeds[self.heights(state) < speeds * soon + MARGIN].max(initial=0.0))

    def broadphase_pairs(self, state: State, duration: float, acceleration: float,
             touching: set[tuple[int, int]]) -> set[tuple[int, int]]:
        """Pairs of dolls that may touch within ``duration`` s; GROUND stands for the ground.

        A bound: bounding spheres, at twice the speed they have and may gain by gravity and
        pushes (``acceleration`` m/s^2), and the boxes around each doll's. Where it is plain from
        what is ``touching`` now, nothing is computed.
        """
        if len(self._bounds) == 2:
            if self._ground is None:
                return set()
            if any(GROUND in pair for pair in touching):
                return {(0, GROUND)}
        far = self._far(state, duration, acceleration)
        found = set()
        if self._ground is not None:
            low = state.positions @ self._normal - self._ground.offset < far
            if low.any():
                found = {(int(doll), GROUND) for doll in np.flatnonzero(
                    np.logical_or.reduceat(low, self._bounds[:-1]))}
        return found if len(self._bounds) == 2 else found | self._close(state.positions, far)

    def closing(self, state: State) -> float:
        """Largest difference, m/s, of two bones' speeds along one of the axes."""
        low, high = state.linear_velocities.min(axis=0), state.linear_velocities.max(axis=0)
        return float((high - low).max())

    def change(self, before: State, after: State) -> float:
        """Largest change, m/s, of a velocity at a bone's centre or, by turning, at its surface."""
        turned = np.abs(after.angular_velocities - before.angular_velocities).max(axis=1)
        return float(max(np.abs(after.linear_velocities - before.linear_velocities).max(),
                         (turned * self._radii).max()))

    def max_angular_speed(self, state: State) -> float:
        """Fastest spin of a bone, rad/s."""
        return math.sqrt(np.einsum('ij,ij->i', state.angular_velocities,
                                   state.angular_velocities).max())

    def max_tip_speed(self, state: State) -> float:
        """Fastest speed, m/s, of a bone's end about its centre."""
        spins = np.sqrt(np.einsum('ij,ij->i', state.angular_velocities, state.angular_velocities))
        return float((self._radii * spins).max())

    def ccd_steps(self, state: State, duration: float) -> int:
        """Parts of ``duration`` s in each of which no bone, nor its end that turns, passes through
        the thinnest.
        """
        speed = self.closing(state) + 2 * self.max_tip_speed(state)
        return max(1, math.ceil(speed * duration / (4 * self._thinnest)))

    def _far(self, state: State, duration: float, acceleration: float) -> np.ndarray:
        """Radii (n,) m of the spheres that hold what the bones may come to."""
        speeds = np.sqrt(np.einsum('ij,ij->i', state.linear_velocities, state.linear_velocities))
        return 2 * duration * (speeds + acceleration * duration) + self._radii + MARGIN

    def _close(self, positions: np.ndarray, far: np.ndarray) -> set[tuple[int, int]]:
        """Pairs of dolls whose boxes, ``far`` m wider, overlap."""
        starts = self._bounds[:-1]
        low = np.minimum.reduceat(positions - far[:, None], starts)
        high = np.maximum.reduceat(positions + far[:, None], starts)
        overlap = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
        return set(zip(*(places.tolist() for places in np.nonzero(np.triu(overlap, 1))),
                       strict=True))

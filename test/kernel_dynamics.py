"""The kernels of flight as Python sees them: what engines call only within a whole tick."""
from __future__ import annotations

import numba
import numpy as np

from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import DofLayout, GeneralizedState
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.kernels.advance import observe
from ragdoll_ros.physics.kernels.dynamics import accelerations
from ragdoll_ros.physics.kernels.flight import LENGTH, Path, along, path_step
from ragdoll_ros.physics.kernels.mass import integrate
from ragdoll_ros.physics.kernels.system import make_room
from ragdoll_ros.physics.system import system_of


@numba.njit
def _observe(s, r, q, v, rows):
    observe(s, r, q, v, rows)


@numba.njit
def _accelerate(s, r, loads, q, v, out):
    accelerations(s.tree, s.gravity, loads, q, v, r.work, out)


@numba.njit
def _integrate(s, q, v, h, out):
    integrate(s.tree, q, v, h, out)


@numba.njit
def _step(s, r, loads, q, v, h, path, k, y):
    path_step(s.tree, s.gravity, r.work, loads, q, v, h, path, k, y)


@numba.njit
def _along(s, path, time, q, v):
    along(s.tree, path, time, q, v)


class KernelDynamics:
    """A scene's dynamics, without any choice of steps; coordinates are those of engines."""

    def __init__(self, scene):
        self._system = system_of(scene)
        self._room = make_room(self._system, 1)
        self._layout = DofLayout([placement.doll for placement in scene.dolls])

    def state(self, coordinates):
        rows = np.empty((len(self._system.tree), 13))
        _observe(self._system, self._room, *self._inwards(coordinates), rows)
        return State.of(rows)

    def acceleration(self, coordinates, wrenches=()):
        q, v = self._inwards(coordinates)
        out = np.empty_like(v)
        _accelerate(self._system, self._room, packed(wrenches), q, v, out)
        return self._outwards(q, out).v

    def moved(self, coordinates, duration):
        """The coordinates after a while at these velocities."""
        q, v = self._inwards(coordinates)
        out = np.empty_like(q)
        _integrate(self._system, q, v, duration, out)
        return GeneralizedState(out, coordinates.v)

    def step(self, start, duration, wrenches=()):
        """Where one step leads, as a function of the share of it."""
        q, v = self._inwards(start)
        size = len(q) + len(v)
        path = Path(np.zeros((8, size)), np.zeros((2, size)), np.zeros(8))
        _step(self._system, self._room, packed(wrenches), q, v, duration, path,
              np.empty((16, size)), np.empty(size))
        path.times[LENGTH] = duration

        def at(share):
            _along(self._system, path, share * duration, q, v)
            return self._outwards(q.copy(), v.copy())
        return at

    def fly(self, start, duration, steps, wrenches=()):
        """The coordinates ``duration`` s later, in equal steps."""
        for _ in range(steps):
            start = self.step(start, duration / steps, wrenches)(1.0)
        return start

    def _inwards(self, coordinates):
        """Copies of q and v, roots' angular velocities along their own axes."""
        q = coordinates.q.copy()
        return q, self._turned(q, coordinates.v, rotation.inverse)

    def _outwards(self, q, v):
        return GeneralizedState(q, self._turned(q, v, lambda turns: turns))

    def _turned(self, q, v, way):
        v, spins = v.copy(), self._layout.root_spins
        v[spins] = rotation.rotate(way(q[self._layout.root_orientations]), v[spins])
        return v


def packed(wrenches):
    """Wrenches as a table (m, 11) for the kernels."""
    return np.array([[wrench.bone, *wrench.force, *wrench.torque, *wrench.point, wrench.local]
                     for wrench in wrenches], float).reshape(-1, 11)

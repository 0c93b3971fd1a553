"""The kernels of flight as Python sees them: what engines call only within a whole tick."""
from __future__ import annotations

import numba
import numpy as np

from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import DofLayout, GeneralizedState
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.engine.rigid.build_system import system_of
from ragdoll_ros.physics.kernels.advance import observe
from ragdoll_ros.physics.kernels.compiling.bundle import bind, bundle_at
from ragdoll_ros.physics.kernels.dynamics.bias import integrate
from ragdoll_ros.physics.kernels.dynamics.forward import accelerations
from ragdoll_ros.physics.kernels.flight.path import along, path_step
from ragdoll_ros.physics.kernels.system import COURSE, ROOM, SYSTEM, make_course, make_room

SYSTEM_AT, ROOM_AT, COURSE_AT = bundle_at(SYSTEM), bundle_at(ROOM), bundle_at(COURSE)


@numba.njit
def _observe(s, r, course, rows):
    course = COURSE_AT(course)
    observe(SYSTEM_AT(s), ROOM_AT(r), course.q, course.v, rows)


@numba.njit
def _accelerate(s, r, course, loads, out):
    s, course = SYSTEM_AT(s), COURSE_AT(course)
    accelerations(s.tree, s.gravity, loads, course.q, course.v, ROOM_AT(r).work, out)


@numba.njit
def _integrate(s, r, course, h, out):
    course = COURSE_AT(course)
    integrate(SYSTEM_AT(s).tree, course.q, course.v, h, out)


@numba.njit
def _step(s, r, course, loads, h):
    path_step(SYSTEM_AT(s), ROOM_AT(r), loads, COURSE_AT(course), h)


@numba.njit
def _along(s, r, course, time, q, v):
    along(SYSTEM_AT(s).tree, COURSE_AT(course), time, q, v)


class KernelDynamics:
    """A scene's dynamics, without any choice of steps; coordinates are those of engines."""

    def __init__(self, scene):
        system = system_of(scene)
        self._course = make_course(system)
        self._parts = system, make_room(system, self._course), self._course
        self._rows = [bind(part) for part in self._parts]
        self._addresses = [rows[0].ctypes.data for rows in self._rows]
        self._layout = DofLayout([placement.doll for placement in scene.dolls])

    def state(self, coordinates):
        rows = np.empty((len(self._parts[0].tree), 13))
        self._put(coordinates)
        _observe(*self._addresses, rows)
        return State.of(rows)

    def acceleration(self, coordinates, wrenches=()):
        self._put(coordinates)
        out = np.empty_like(self._course.v)
        _accelerate(*self._addresses, packed(wrenches), out)
        return self._outwards(self._course.q, out).v

    def moved(self, coordinates, duration):
        """The coordinates after a while at these velocities."""
        self._put(coordinates)
        out = np.empty_like(self._course.q)
        _integrate(*self._addresses, duration, out)
        return GeneralizedState(out, coordinates.v)

    def step(self, start, duration, wrenches=()):
        """Where one step leads, as a function of the share of it."""
        self._put(start)
        self._course.path[:] = 0
        _step(*self._addresses, packed(wrenches), duration)
        self._course.path['length'] = duration

        def at(share):
            q, v = np.empty_like(self._course.q), np.empty_like(self._course.v)
            _along(*self._addresses, share * duration, q, v)
            return self._outwards(q, v)
        return at

    def fly(self, start, duration, steps, wrenches=()):
        """The coordinates ``duration`` s later, in equal steps."""
        for _ in range(steps):
            start = self.step(start, duration / steps, wrenches)(1.0)
        return start

    def _put(self, coordinates):
        """Enter q and v, roots' angular velocities along their own axes."""
        self._course.q[:] = coordinates.q
        self._course.v[:] = self._turned(coordinates.q, coordinates.v, rotation.inverse)

    def _outwards(self, q, v):
        return GeneralizedState(q, self._turned(q, v, lambda turns: turns))

    def _turned(self, q, v, way):
        v, spins = v.copy(), self._layout.root_angular_velocities
        v[spins] = rotation.rotate(way(q[self._layout.root_orientations]), v[spins])
        return v


def packed(wrenches):
    """Wrenches as a table (m, 11) for the kernels."""
    return np.array([[wrench.bone, *wrench.force, *wrench.torque, *wrench.point, wrench.local]
                     for wrench in wrenches], float).reshape(-1, 11)

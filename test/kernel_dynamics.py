"""The kernels of flight as Python sees them: what engines call only within a whole tick."""
from __future__ import annotations

import numpy as np
from kept_code import kept

from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import DofLayout, GeneralizedState
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.engine.rigid.build_system import build_system
from ragdoll_ros.physics.engine.rigid.loads import load_records
from ragdoll_ros.physics.kernels.advance import write_bone_states
from ragdoll_ros.physics.kernels.cluster_state import CLUSTER_STATE, make_cluster_state
from ragdoll_ros.physics.kernels.compiling.bundle import bind, bundle_at
from ragdoll_ros.physics.kernels.dynamics.forward_dynamics import forward_dynamics
from ragdoll_ros.physics.kernels.dynamics.kinematics import integrate_positions
from ragdoll_ros.physics.kernels.flight.dense_step import dop853_step, evaluate_dense_step
from ragdoll_ros.physics.kernels.system import SYSTEM
from ragdoll_ros.physics.kernels.workspace import WORKSPACE, make_workspace

SYSTEM_AT, WORKSPACE_AT, CLUSTER_STATE_AT = (bundle_at(SYSTEM), bundle_at(WORKSPACE),
                                             bundle_at(CLUSTER_STATE))


@kept
def _bone_states(s, ws, cluster, states):
    cluster = CLUSTER_STATE_AT(cluster)
    write_bone_states(SYSTEM_AT(s), WORKSPACE_AT(ws).step.end, cluster.q, cluster.v, states)


@kept
def _accelerate(s, ws, cluster, out):
    s, ws, cluster = SYSTEM_AT(s), WORKSPACE_AT(ws), CLUSTER_STATE_AT(cluster)
    forward_dynamics(s.tree, s.gravity, cluster.loads, cluster.q, cluster.v, ws.flight.kinematics,
                     ws.step.dynamics, out)


@kept
def _integrate(s, ws, cluster, h, out):
    cluster = CLUSTER_STATE_AT(cluster)
    integrate_positions(SYSTEM_AT(s).tree, cluster.q, cluster.v, h, out)


@kept
def _step(s, ws, cluster, h):
    dop853_step(SYSTEM_AT(s), WORKSPACE_AT(ws), CLUSTER_STATE_AT(cluster), h)


@kept
def _evaluate(s, ws, cluster, time, q, v):
    evaluate_dense_step(SYSTEM_AT(s).tree, CLUSTER_STATE_AT(cluster), time, q, v)


class KernelDynamics:
    """A scene's dynamics, without any choice of steps; coordinates are those of engines."""

    def __init__(self, scene):
        self._system = build_system(scene)
        self._bones = list(range(len(scene.bones)))
        self._bind(make_cluster_state(self._system))
        self._layout = DofLayout([placement.doll for placement in scene.dolls])

    def _bind(self, state):
        self._state = state
        self._parts = self._system, make_workspace(self._system, state), state
        self._rows = [bind(part) for part in self._parts]
        self._addresses = [rows[0].ctypes.data for rows in self._rows]

    def state(self, coordinates):
        states = np.empty((len(self._system.tree), 13))
        self._put(coordinates)
        _bone_states(*self._addresses, states)
        return State.of(states)

    def acceleration(self, coordinates, wrenches=()):
        self._put(coordinates, wrenches)
        out = np.empty_like(self._state.v)
        _accelerate(*self._addresses, out)
        return self._outwards(self._state.q, out).v

    def moved(self, coordinates, duration):
        """The coordinates after a while at these velocities."""
        self._put(coordinates)
        out = np.empty_like(self._state.q)
        _integrate(*self._addresses, duration, out)
        return GeneralizedState(out, coordinates.v)

    def step(self, start, duration, wrenches=()):
        """Where one step leads, as a function of the share of it."""
        self._put(start, wrenches)
        self._state.dense_step[:] = 0
        _step(*self._addresses, duration)
        self._state.dense_step['length'] = duration

        def at(share):
            q, v = np.empty_like(self._state.q), np.empty_like(self._state.v)
            _evaluate(*self._addresses, share * duration, q, v)
            return self._outwards(q, v)
        return at

    def fly(self, start, duration, steps, wrenches=()):
        """The coordinates ``duration`` s later, in equal steps."""
        for _ in range(steps):
            start = self.step(start, duration / steps, wrenches)(1.0)
        return start

    def _put(self, coordinates, wrenches=()):
        """Enter q and v, roots' angular velocities along their own axes, and what acts."""
        self._bind(self._state._replace(loads=load_records(wrenches, self._bones)))
        self._state.q[:] = coordinates.q
        self._state.v[:] = self._turned(coordinates.q, coordinates.v, rotation.inverse)

    def _outwards(self, q, v):
        return GeneralizedState(q, self._turned(q, v, lambda turns: turns))

    def _turned(self, q, v, way):
        v, spins = v.copy(), self._layout.root_angular_velocities
        v[spins] = rotation.rotate(way(q[self._layout.root_orientations]), v[spins])
        return v

"""Accelerations out of what steps: engines asked by one small step, kernels step by step."""
from __future__ import annotations

import dataclasses

import numpy as np

from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.settings import NORMAL

PROBE = 2.0 ** -10
"""s: the step that measures accelerations; a power of two, so that dividing by it is exact."""

PLAIN = dataclasses.replace(NORMAL, substeps=1, energy=False)
"""One substep in 10 ms or less, and no account."""


def bullet_acceleration(engine, coordinates, wrenches=()):
    """Rates of change of ``coordinates.v``, from one small step of a BulletEngine at PLAIN.

    PyBullet's step takes v to v + a h with a from where the step begins, so the quotient is exact
    but for rounding. It holds where nothing touches and no limit is reached.
    """
    engine.place(coordinates)
    engine.advance(PROBE, wrenches)
    return (engine.coordinates.v - coordinates.v) / PROBE


def unlimited(scene):
    """The same scene, its hinges and universal joints without limits, which would take part."""
    def freed(joint):
        return joint if joint.kind == 'ball' else dataclasses.replace(joint, limits=())
    return dataclasses.replace(scene, dolls=tuple(
        dataclasses.replace(placement, doll=dataclasses.replace(
            placement.doll, joints=tuple(map(freed, placement.doll.joints))))
        for placement in scene.dolls))


def mujoco_acceleration(engine, coordinates, wrenches=()):
    """Rates of change of ``coordinates.v`` by a MujocoEngine in the air: MuJoCo's own."""
    engine.place(coordinates)
    engine._apply(wrenches)
    engine._mujoco.mj_forward(engine._model, engine._data)
    engine._data.xfrc_applied[:] = 0
    return engine._outwards(engine._data.qpos, engine._data.qacc)


class KernelDynamics:
    """The kernels of flight as Python sees them, without any choice of steps."""

    def __init__(self, scene):
        from ragdoll_ros.physics.kernels.loaded import kernels
        from ragdoll_ros.physics.tree import table
        self._kernels = kernels
        self._tree, self._gravity = table(scene), np.array(scene.gravity, float)

    def state(self, coordinates):
        rows = np.empty((len(self._tree), 13))
        self._kernels.forward_kinematics(self._tree, coordinates.q, coordinates.v, rows)
        return State.of(rows)

    def acceleration(self, coordinates, wrenches=()):
        out = np.empty_like(coordinates.v)
        self._kernels.accelerate(self._tree, self._gravity, packed(wrenches), coordinates.q,
                                 coordinates.v, out)
        return out

    def integrate_configuration(self, coordinates, displacement):
        """The coordinates after a small displacement along the directions of v."""
        q = coordinates.q.copy()
        self._kernels.integrate_configuration(self._tree, q, displacement)
        return GeneralizedState(q, coordinates.v)

    def step(self, start, duration, wrenches=()):
        """Where one step leads, as a function of the share of it."""
        sizes = (len(start.q), len(start.v))
        dense, rates = np.empty((8, sum(sizes))), np.empty((2, sum(sizes)))
        self._kernels.step(self._tree, self._gravity, packed(wrenches), start.q, start.v, duration,
                           False, dense, rates)

        def at(share):
            q, v = (np.empty(size) for size in sizes)
            self._kernels.interpolate(self._tree, dense, share, q, v)
            return GeneralizedState(q, v)
        return at

    def fly(self, start, duration, steps, wrenches=()):
        """The coordinates ``duration`` s later, in equal steps."""
        for _ in range(steps):
            start = self.step(start, duration / steps, wrenches)(1.0)
        return start


def packed(wrenches):
    """Wrenches as a table (m, 11) for the kernels."""
    return np.array([[wrench.bone, *wrench.force, *wrench.torque, *wrench.point, wrench.local]
                     for wrench in wrenches], float).reshape(-1, 11)

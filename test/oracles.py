"""Accelerations out of what steps: engines asked by one small step."""
from __future__ import annotations

import dataclasses

from ragdoll_ros.physics.accuracy import NORMAL

PROBE = 2.0 ** -10
"""s: the step that measures accelerations; a power of two, so that dividing by it is exact."""

PLAIN = dataclasses.replace(NORMAL, substeps=1, energy=False)
"""One substep in 10 ms or less, and no account."""


def bullet_acceleration(engine, coordinates, wrenches=()):
    """Rates of change of ``coordinates.v``, from one small step of a BulletEngine at PLAIN.

    PyBullet's step takes v to v + a h with a from where the step begins, so the quotient is exact
    but for rounding. It holds where nothing touches and no limit is reached.
    """
    engine.set_coordinates(coordinates)
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
    engine.set_coordinates(coordinates)
    engine._apply(wrenches)
    engine._mujoco.mj_forward(engine._model, engine._data)
    engine._data.xfrc_applied[:] = 0
    return engine._outwards(engine._data.qpos, engine._data.qacc)

"""PyBullet as in its quickstart guide: load a URDF, set gravity, step at 1/240 s.

Inertia, damping, joint motors, contact margins and solver are PyBullet's defaults, on purpose
unlike in physics/engine/substepped/bullet.py.
"""
import os
import tempfile

import numpy as np
import pybullet

from ...files.urdf import to_urdf
from ...model.scene import finite_friction
from ...model.state import State
from ...physics.engine.substepped.bullet import BREAKING_DISTANCE
from ..cases.trial import Trial

STEP = 1 / 240

DEFAULT_BREAKING_DISTANCE = 0.02
"""m. PyBullet has one value for all clients of a process; this is its default."""


class Quickstart:
    """A trial in PyBullet with default settings."""

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(contactBreakingThreshold=DEFAULT_BREAKING_DISTANCE,
                                           physicsClientId=self._client)
        self._time = 0.0
        pybullet.setGravity(*trial.scene.gravity, physicsClientId=self._client)
        self._add_ground()
        placement, = trial.scene.dolls
        with tempfile.TemporaryDirectory(prefix='ragdoll_ros_') as folder:
            path = os.path.join(folder, 'doll.urdf')
            with open(path, 'w', encoding='utf-8') as file:
                file.write(to_urdf(placement.doll, 'bullet'))
            position, _ = placement.bone_pose(placement.doll.root)
            self._body = pybullet.loadURDF(path, list(position), list(placement.orientation),
                                           physicsClientId=self._client)
        self._find_links()
        self._set_material()
        self._place()

    def advance(self) -> None:
        """Advance by one step."""
        for load in self._trial.loads(self._time, self._time + STEP):
            link = self._links[load.bone]
            place = self._pose(link)
            pybullet.applyExternalForce(self._body, link, list(load.force), place,
                                        pybullet.WORLD_FRAME, physicsClientId=self._client)
        pybullet.stepSimulation(physicsClientId=self._client)
        self._time += STEP

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""
        base = (*pybullet.getBasePositionAndOrientation(self._body, self._client),
                *pybullet.getBaseVelocity(self._body, self._client))
        rows = []
        for link in self._links:
            if link < 0:
                rows.append(sum(base, ()))
                continue
            found = pybullet.getLinkState(self._body, link, 1, 1, self._client)
            rows.append(found[0] + found[1] + found[6] + found[7])
        return State.of(np.array(rows))

    def close(self) -> None:
        """Disconnect, and restore the breaking distance for other clients of this process."""
        pybullet.setPhysicsEngineParameter(contactBreakingThreshold=BREAKING_DISTANCE,
                                           physicsClientId=self._client)
        pybullet.disconnect(self._client)

    def _pose(self, link: int) -> tuple[float, ...]:
        if link < 0:
            return pybullet.getBasePositionAndOrientation(self._body, self._client)[0]
        return pybullet.getLinkState(self._body, link, computeForwardKinematics=1,
                                     physicsClientId=self._client)[0]

    def _add_ground(self) -> None:
        ground = self._trial.scene.ground
        if ground is None:
            return
        plane = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, planeNormal=ground.normal, physicsClientId=self._client)
        self._plane = pybullet.createMultiBody(
            0, plane, -1, [n * ground.offset for n in ground.normal], physicsClientId=self._client)

    def _find_links(self) -> None:
        links, self._joints = {}, {}
        for index in range(pybullet.getNumJoints(self._body, self._client)):
            info = pybullet.getJointInfo(self._body, index, self._client)
            links[info[12].decode()] = index
            self._joints[info[1].decode()] = index
        doll = self._trial.scene.dolls[0].doll
        self._links = [links.get(bone.name, -1) for bone in doll.bones]

    def _set_material(self) -> None:
        """Set friction and restitution, which belong to the trial and not to the method."""
        material = self._trial.scene.material
        bodies = [(self._body, link) for link in self._links]
        if self._trial.scene.ground is not None:
            bodies.append((self._plane, -1))
        for body, link in bodies:
            pybullet.changeDynamics(
                body, link, lateralFriction=finite_friction(material.friction) ** 0.5,
                restitution=material.restitution ** 0.5, physicsClientId=self._client)

    def _place(self) -> None:
        """Set the trial's initial state; its joint coordinates are in the order of the links."""
        start = self._trial.start
        if start is None:
            return
        q, v = start.q.tolist(), start.v.tolist()
        pybullet.resetBasePositionAndOrientation(self._body, q[:3], q[3:7], self._client)
        pybullet.resetBaseVelocity(self._body, v[:3], v[3:6], physicsClientId=self._client)
        moving = [index for index in sorted(self._joints.values())
                  if pybullet.getJointInfo(self._body, index, self._client)[2]
                  != pybullet.JOINT_FIXED]
        for joint, angle, rate in zip(moving, q[7:], v[6:], strict=True):
            pybullet.resetJointState(self._body, joint, angle, rate, self._client)

"""PyBullet as in its quickstart guide: load a URDF, set gravity, step at 1/240 s.

Inertia, damping, joint motors, contact margins and solver are PyBullet's defaults, on purpose
unlike in physics/engine/substepped/bullet.py.
"""
import os
import tempfile

import numpy as np
import pybullet

from ...files.urdf import to_urdf
from ...model.coordinates import DofLayout, placed_coordinates
from ...model.scene import Placement, finite_friction
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
        self._bodies = [self._load(placement) for placement in trial.scene.dolls]
        self._find_links()
        self._set_material()
        self._place()

    def advance(self) -> None:
        """Advance by one step."""
        for load in self._trial.loads(self._time, self._time + STEP):
            body, link = self._links[load.bone]
            pybullet.applyExternalForce(body, link, list(load.force), self._position(body, link),
                                        pybullet.WORLD_FRAME, physicsClientId=self._client)
        pybullet.stepSimulation(physicsClientId=self._client)
        self._time += STEP

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""
        rows = []
        for body, link in self._links:
            if link < 0:
                rows.append(sum((*pybullet.getBasePositionAndOrientation(body, self._client),
                                 *pybullet.getBaseVelocity(body, self._client)), ()))
                continue
            found = pybullet.getLinkState(body, link, 1, 1, self._client)
            rows.append(found[0] + found[1] + found[6] + found[7])
        return State.of(np.array(rows))

    def close(self) -> None:
        """Disconnect, and restore the breaking distance for other clients of this process."""
        pybullet.setPhysicsEngineParameter(contactBreakingThreshold=BREAKING_DISTANCE,
                                           physicsClientId=self._client)
        pybullet.disconnect(self._client)

    def _load(self, placement: Placement) -> int:
        """Load a doll at its initial pose. Returns PyBullet's index of the body."""
        with tempfile.TemporaryDirectory(prefix='ragdoll_ros_') as folder:
            path = os.path.join(folder, 'doll.urdf')
            with open(path, 'w', encoding='utf-8') as file:
                file.write(to_urdf(placement.doll, 'bullet'))
            position, _ = placement.bone_pose(placement.doll.root)
            return pybullet.loadURDF(path, list(position), list(placement.orientation),
                                     physicsClientId=self._client)

    def _position(self, body: int, link: int) -> tuple[float, ...]:
        """Position (3,) m of the centre of mass of a link, or of the base, link -1."""
        if link < 0:
            return pybullet.getBasePositionAndOrientation(body, self._client)[0]
        return pybullet.getLinkState(body, link, computeForwardKinematics=1,
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
        """Set the body and link of each bone of the scene; the link of a root is -1."""
        self._links = []
        for body, placement in zip(self._bodies, self._trial.scene.dolls, strict=True):
            infos = [pybullet.getJointInfo(body, index, self._client)
                     for index in range(pybullet.getNumJoints(body, self._client))]
            links = {info[12].decode(): info[0] for info in infos}
            self._links += [(body, links.get(bone.name, -1)) for bone in placement.doll.bones]

    def _set_material(self) -> None:
        """Set friction and restitution, which belong to the trial and not to the method."""
        material = self._trial.scene.material
        planes = [] if self._trial.scene.ground is None else [(self._plane, -1)]
        for body, link in self._links + planes:
            pybullet.changeDynamics(
                body, link, lateralFriction=finite_friction(material.friction) ** 0.5,
                restitution=material.restitution ** 0.5, physicsClientId=self._client)

    def _place(self) -> None:
        """Set the trial's initial state; joint coordinates are in the order of a body's joints."""
        dolls = self._trial.scene.dolls
        start = self._trial.start or placed_coordinates(dolls)
        layout = DofLayout([placement.doll for placement in dolls])
        for body, at_q, at_v in zip(self._bodies, layout.doll_q, layout.doll_v, strict=True):
            q, v = start.q[at_q].tolist(), start.v[at_v].tolist()
            pybullet.resetBasePositionAndOrientation(body, q[:3], q[3:7], self._client)
            pybullet.resetBaseVelocity(body, v[:3], v[3:6], physicsClientId=self._client)
            moving = [index for index in range(pybullet.getNumJoints(body, self._client))
                      if pybullet.getJointInfo(body, index, self._client)[2]
                      != pybullet.JOINT_FIXED]
            for joint, angle, rate in zip(moving, q[7:], v[6:], strict=True):
                pybullet.resetJointState(body, joint, angle, rate, self._client)

"""MuJoCo behind the engine protocol: the same doll, to stand beside PyBullet in the report.

The package works without it: `pip install ragdoll_ros[report]` brings it.
"""
from __future__ import annotations

import numpy as np

from .. import faults, rotation
from ..mjcf import to_mjcf
from ..ragdoll import Joint
from ..scene import Placement, Scene
from ..state import State
from ..urdf import joint_frame
from .protocol import GROUND, Contact, Coordinates

INTEGRATORS = ('euler', 'implicitfast', 'rk4')
"""Order 1 with implicit joint damping; order 1, implicit in all velocities; order 4."""


XYZW, WXYZ = [1, 2, 3, 0], [3, 0, 1, 2]
"""From MuJoCo's order of a quaternion to ours, and back."""


class MissingEngine(faults.RagdollError):
    """MuJoCo is not installed."""


class MujocoEngine:
    """A scene in MuJoCo."""

    most_substeps = 10_000

    def __init__(self, scene: Scene, integrator: str = 'implicitfast') -> None:
        if integrator not in INTEGRATORS:
            raise faults.OutOfRange('integrator', integrator, 'one of ' + ', '.join(INTEGRATORS))
        try:
            import mujoco
        except ImportError as error:
            raise MissingEngine('MuJoCo is missing: pip install "ragdoll_ros[report]"') from error
        self.scene = scene
        self._mujoco = mujoco
        self._build(self._overlaps())
        self._model.opt.integrator = getattr(
            mujoco.mjtIntegrator, 'mjINT_' + integrator.upper())
        for index, placement in enumerate(scene.dolls):
            self._set_in_motion(index, placement)

    def step(self, duration: float, substeps: int) -> None:
        """Go on by ``duration`` s in equal substeps; pushes act on all of them and then end."""
        self._model.opt.timestep = duration / substeps
        self._mujoco.mj_step(self._model, self._data, substeps)
        self._data.xfrc_applied[:] = 0
        self._stale = True

    def push(self, bone: int, force: np.ndarray, torque: np.ndarray, point: np.ndarray) -> None:
        """Let a force (N) at a point (m) and a torque (N m) act in the next step."""
        self._refresh()
        body = self._bodies[bone]
        arm = np.asarray(point, float) - self._data.xipos[body]
        self._data.xfrc_applied[body, :3] += force
        self._data.xfrc_applied[body, 3:] += torque + np.cross(arm, force)

    def read(self) -> State:
        """Poses and velocities of all bones."""
        self._refresh()
        data, bodies = self._data, self._bodies
        # cvel is given in the centre of mass of the whole tree
        angular = data.cvel[bodies, :3].copy()
        arms = data.xipos[bodies] - data.subtree_com[self._model.body_rootid[bodies]]
        return State(data.xipos[bodies].copy(), data.xquat[bodies][:, [1, 2, 3, 0]],
                     data.cvel[bodies, 3:] + np.cross(angular, arms), angular)

    def coordinates(self) -> Coordinates:
        """Generalised coordinates of all dolls."""
        q, v = self._data.qpos.copy(), self._data.qvel.copy()
        for iq, iv in self._roots:
            q[iq + 3:iq + 7] = self._data.qpos[iq + 3:iq + 7][XYZW]
            v[iv + 3:iv + 6] = rotation.rotate(q[iq + 3:iq + 7], v[iv + 3:iv + 6])
        for iq, iv, seat in self._balls:
            turn = rotation.multiply(seat, self._data.qpos[iq:iq + 4][XYZW])
            q[iq:iq + 4] = rotation.multiply(turn, rotation.inverse(seat))
            v[iv:iv + 3] = rotation.rotate(seat, v[iv:iv + 3])
        return Coordinates(q, v)

    def place(self, coordinates: Coordinates) -> None:
        """Put all dolls where ``coordinates`` says."""
        q, v = coordinates.q.copy(), coordinates.v.copy()
        for iq, iv in self._roots:
            turn = coordinates.q[iq + 3:iq + 7]
            q[iq + 3:iq + 7] = turn[WXYZ]
            v[iv + 3:iv + 6] = rotation.rotate(rotation.inverse(turn), v[iv + 3:iv + 6])
        for iq, iv, seat in self._balls:
            back = rotation.inverse(seat)
            turn = rotation.multiply(back, coordinates.q[iq:iq + 4])
            q[iq:iq + 4] = rotation.multiply(turn, seat)[WXYZ]
            v[iv:iv + 3] = rotation.rotate(back, v[iv:iv + 3])
        self._data.qpos[:], self._data.qvel[:] = q, v
        self._stale = True

    def shift_velocity(self, doll: int, linear: np.ndarray, angular: np.ndarray) -> None:
        """Add a velocity (m/s) and a spin (rad/s) to a doll's root: the whole doll gains both."""
        iq, iv = self._roots[doll]
        turn = self._data.qpos[iq + 3:iq + 7][XYZW]
        self._data.qvel[iv:iv + 3] += linear
        self._data.qvel[iv + 3:iv + 6] += rotation.rotate(rotation.inverse(turn), angular)
        self._stale = True

    def joint_angles(self) -> np.ndarray:
        """All joint angles in rad, in the order of Scene.angle_names."""
        values = []
        q = self.coordinates().q
        for kind, adr in self._angles:
            values += rotation.to_xyz(q[adr:adr + 4]) if kind == 'ball' else [q[adr]]
        return np.array(values)

    def contacts(self) -> list[Contact]:
        """What touches now."""
        self._mujoco.mj_forward(self._model, self._data)
        self._stale = False
        found, force = [], np.zeros(6)
        for index in range(self._data.ncon):
            contact = self._data.contact[index]
            a, b = (self._bone_of.get(geom, GROUND) for geom in contact.geom)
            self._mujoco.mj_contactForce(self._model, self._data, index, force)
            # MuJoCo's normal points from the first geom to the second, ours from b to a
            normal, position = -contact.frame[:3].copy(), contact.pos.copy()
            if a == GROUND:
                a, b, normal = b, GROUND, -normal
            position -= normal * contact.dist / 2
            found.append(Contact(a, b, position, normal, -contact.dist, float(force[0])))
        return found

    def save(self) -> object:
        """Give a snapshot that restore brings back to the bit."""
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self._mujoco.mj_stateSize(self._model, kind))
        self._mujoco.mj_getState(self._model, self._data, state, kind)
        return state

    def restore(self, snapshot: object) -> None:
        """Go back to a snapshot."""
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        self._mujoco.mj_setState(self._model, self._data, snapshot, kind)
        self._stale = True

    def close(self) -> None:
        """Nothing to give back: the memory goes with the object."""

    def _overlaps(self) -> set[frozenset[str]]:
        """Names of the pairs of one doll that overlap at the start; they would burst."""
        model = self._mujoco.MjModel.from_xml_string(to_mjcf(self.scene))
        data = self._mujoco.MjData(model)
        self._mujoco.mj_forward(model, data)
        pairs = set()
        for contact in data.contact:
            if contact.dist < 0:
                bodies = model.geom_bodyid[contact.geom]
                if bodies.all() and np.ptp(model.body_rootid[bodies]) == 0:
                    pairs.add(frozenset(model.body(int(body)).name for body in bodies))
        return pairs

    def _build(self, apart: set[frozenset[str]]) -> None:
        self._model = self._mujoco.MjModel.from_xml_string(to_mjcf(self.scene, apart))
        self._data = self._mujoco.MjData(self._model)
        self._bodies = np.array([self._model.body(name).id for name in self.scene.bone_names])
        self._bone_of = {self._model.geom(name).id: bone
                         for bone, name in enumerate(self.scene.bone_names)}
        self._roots, self._balls, self._angles = [], [], []
        for placement in self.scene.dolls:
            self._roots.append(self._address(placement, placement.doll.root.name + '/free'))
            for joint in placement.doll.joints:
                self._find(placement, joint)
        self._stale = True

    def _find(self, placement: Placement, joint: Joint) -> None:
        """Note where a joint's coordinates stand."""
        if joint.kind != 'ball' or any(joint.limits):
            self._angles += [('angle', self._address(placement, name)[0])
                             for name in joint.angle_names]
            return
        iq, iv = self._address(placement, joint.child)
        child = placement.doll.bone(joint.child)
        seat = rotation.multiply(rotation.inverse(joint_frame(joint)), child.orientation)
        self._balls.append((iq, iv, seat))
        self._angles.append(('ball', iq))

    def _address(self, placement: Placement, name: str) -> tuple[int, int]:
        joint = self._model.joint(self.scene.qualified(placement, name))
        return int(joint.qposadr[0]), int(joint.dofadr[0])

    def _set_in_motion(self, index: int, placement: Placement) -> None:
        """Give a doll its velocity at the start, as one rigid body about its centre of mass."""
        doll = placement.doll
        centre = sum(bone.mass * np.array(bone.position) for bone in doll.bones) / doll.mass
        arm = rotation.rotate(placement.orientation, doll.root.position - centre)
        spin = np.array(placement.spin)
        self.shift_velocity(index, placement.velocity + np.cross(spin, arm), spin)

    def _refresh(self) -> None:
        """Bring poses and velocities of the bodies up to the coordinates, once."""
        if self._stale:
            self._mujoco.mj_kinematics(self._model, self._data)
            self._mujoco.mj_comPos(self._model, self._data)
            self._mujoco.mj_comVel(self._model, self._data)
            self._stale = False

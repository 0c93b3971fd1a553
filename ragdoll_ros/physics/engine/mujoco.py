"""MuJoCo behind the engine protocol: the same doll, to stand beside PyBullet in the report.

The package works without it: `pip install ragdoll_ros[report]` brings it.
"""
from __future__ import annotations

import contextlib

import numpy as np

from ...files.mjcf import to_mjcf
from ...model import errors, rotation
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.ragdoll import Joint, joint_frame
from ...model.scene import Placement, Scene
from ...model.state import State
from .protocol import GROUND, Contact, Wrenches, pressed

INTEGRATORS = ('euler', 'implicitfast', 'rk4')
"""Order 1 with implicit joint damping; order 1, implicit in all velocities; order 4."""


XYZW, WXYZ = [1, 2, 3, 0], [3, 0, 1, 2]
"""From MuJoCo's order of a quaternion to ours, and back."""


class MissingEngine(errors.RagdollError):
    """MuJoCo is not installed."""


class MujocoEngine:
    """A scene in MuJoCo. ``free``: nothing touches and no joint has a limit."""

    def __init__(self, scene: Scene, free: bool = False, integrator: str = 'implicitfast') -> None:
        if integrator not in INTEGRATORS:
            raise errors.OutOfRange('integrator', integrator, 'one of ' + ', '.join(INTEGRATORS))
        try:
            import mujoco
        except ImportError as error:
            raise MissingEngine('MuJoCo is missing: pip install "ragdoll_ros[report]"') from error
        self.scene = scene
        self._mujoco = mujoco
        self._integrator = getattr(mujoco.mjtIntegrator, 'mjINT_' + integrator.upper())
        self._free = free
        self._apart: set[frozenset[str]] = set()
        self._build()
        self._set_in_motion()
        self.exclude_initial_penetrations()

    def step(self, duration: float, substeps: int, loads: Wrenches = ()) -> None:
        self._model.opt.timestep = duration / substeps
        self._apply(loads)
        self._mujoco.mj_step(self._model, self._data, substeps)
        self._data.xfrc_applied[:] = 0
        self._stale = True

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        """Rates of change of ``coordinates.v`` where nothing touches and no limit is reached."""
        self.place(coordinates)
        self._apply(loads)
        disabled = self._model.opt.disableflags
        self._model.opt.disableflags |= self._mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._mujoco.mj_forward(self._model, self._data)
        self._model.opt.disableflags = disabled
        self._data.xfrc_applied[:] = 0
        return self._outwards(self._data.qpos, self._data.qacc)

    def read(self) -> State:
        self._refresh()
        data, bodies = self._data, self._bodies
        # cvel is given in the centre of mass of the whole tree
        angular = data.cvel[bodies, :3].copy()
        arms = data.xipos[bodies] - data.subtree_com[self._model.body_rootid[bodies]]
        return State(data.xipos[bodies].copy(), data.xquat[bodies][:, [1, 2, 3, 0]],
                     data.cvel[bodies, 3:] + np.cross(angular, arms), angular)

    def coordinates(self) -> GeneralizedState:
        q = self._data.qpos.copy()
        for iq, _ in self._roots:
            q[iq + 3:iq + 7] = q[iq + 3:iq + 7][XYZW]
        for iq, _, seat in self._balls:
            turn = rotation.multiply(seat, q[iq:iq + 4][XYZW])
            q[iq:iq + 4] = rotation.multiply(turn, rotation.inverse(seat))
        return GeneralizedState(q, self._outwards(self._data.qpos, self._data.qvel))

    def place(self, coordinates: GeneralizedState) -> None:
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

    def joint_angles(self) -> np.ndarray:
        q, values = self.coordinates().q, []
        for place in self._angles:
            values += rotation.to_xyz(q[place:place + 4]) if isinstance(place, int) \
                else [q[index] for index in place]
        return np.array(values)

    def touching(self) -> set[tuple[int, int]]:
        self._refresh()
        self._mujoco.mj_collision(self._model, self._data)
        return self.touched()

    def touched(self) -> set[tuple[int, int]]:
        if not self._data.ncon:
            return set()
        return {tuple(pair) for pair in self._doll_of[self._data.contact.geom].tolist()}

    def set_solver_iterations(self, wanted: bool) -> None:
        """Nothing to do: this solver goes on until it has an answer."""

    def set_ground_friction(self, wanted: bool) -> None:
        """Nothing to do: this solver finds an answer with any friction."""

    def exclude_initial_penetrations(self) -> None:
        self._refresh()
        self._mujoco.mj_collision(self._model, self._data)
        bodies, roots = self._model.geom_bodyid, self._model.body_rootid
        pairs, depth = set(), pressed(self.scene)
        for contact in self._data.contact:
            a, b = bodies[contact.geom]
            if contact.dist < -depth and a and b and roots[a] == roots[b]:
                pairs.add(frozenset(self._model.body(int(body)).name for body in (a, b)))
        if pairs:
            here = self.coordinates()
            self._apart |= pairs
            self._build()
            self.place(here)

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
            position += normal * contact.dist / 2
            found.append(Contact(a, b, position, normal, -contact.dist, float(force[0])))
        return found

    def save(self) -> object:
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self._mujoco.mj_stateSize(self._model, kind))
        self._mujoco.mj_getState(self._model, self._data, state, kind)
        return state

    def restore(self, snapshot: object) -> None:
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        self._mujoco.mj_setState(self._model, self._data, snapshot, kind)
        self._stale = True

    def forget(self, snapshot: object) -> None:
        """Nothing to give back: the memory goes with the object."""

    def close(self) -> None:
        """Nothing to give back: the memory goes with the object."""

    def _build(self) -> None:
        mujoco = self._mujoco
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(self.scene, self._apart))
        self._data = mujoco.MjData(self._model)
        self._model.opt.integrator = self._integrator
        # a scene that explodes shall be seen to: MuJoCo would put it back to its start
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        if self._free:
            self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._bodies = np.array([self._model.body(name).id for name in self.scene.bone_names])
        bones = {int(body): bone for bone, body in enumerate(self._bodies)}
        self._bone_of = {geom: bones[body] for geom, body in enumerate(self._model.geom_bodyid)
                         if body in bones}
        self._doll_of = np.full(self._model.ngeom, GROUND)
        self._doll_of[list(self._bone_of)] = self.scene.doll_of_bone[list(self._bone_of.values())]
        self._roots, self._balls, self._angles = [], [], []
        for placement in self.scene.dolls:
            doll = placement.doll
            self._roots.append(self._address(placement, doll.root.name + '/free'))
            self._angles += [self._place_of(placement, joint) for joint in doll.joints]
        self.layout = DofLayout([placement.doll for placement in self.scene.dolls])
        self._stale = True

    def _place_of(self, placement: Placement, joint: Joint) -> int | list[int]:
        """Where a free ball joint's coordinates begin, or where a joint's angles stand."""
        if not joint.is_free_ball:
            return [self._address(placement, name)[0] for name in joint.angle_names]
        iq, iv = self._address(placement, joint.child)
        child = placement.doll.bone(joint.child)
        seat = rotation.multiply(rotation.inverse(joint_frame(joint)), child.orientation)
        self._balls.append((iq, iv, seat))
        return iq

    def _address(self, placement: Placement, name: str) -> tuple[int, int]:
        joint = self._model.joint(self.scene.qualified(placement, name))
        return int(joint.qposadr[0]), int(joint.dofadr[0])

    def _set_in_motion(self) -> None:
        """Set each doll in motion as at the start, as one rigid body about its centre of mass."""
        start = self.coordinates()
        for placement, (_, iv) in zip(self.scene.dolls, self._roots, strict=True):
            start.v[iv:iv + 3] = placement.root_velocity()
            start.v[iv + 3:iv + 6] = placement.spin
        self.place(start)

    def _apply(self, loads: Wrenches) -> None:
        for load in loads:
            self._refresh()
            body = self._bodies[load.bone]
            turn = self._data.xmat[body].reshape(3, 3)
            force, torque, arm = load.force, load.torque, turn @ load.point
            if load.local:
                force, torque = turn @ force, turn @ torque
            self._data.xfrc_applied[body, :3] += force
            self._data.xfrc_applied[body, 3:] += torque + np.cross(arm, force)

    def _outwards(self, qpos: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Velocities or accelerations with each spin turned from MuJoCo's axes to ours."""
        v = rates.copy()
        for iq, iv in self._roots:
            v[iv + 3:iv + 6] = rotation.rotate(qpos[iq + 3:iq + 7][XYZW], v[iv + 3:iv + 6])
        for _, iv, seat in self._balls:
            v[iv:iv + 3] = rotation.rotate(seat, v[iv:iv + 3])
        return v

    def _refresh(self) -> None:
        """Bring poses and velocities of the bodies up to the coordinates, once."""
        if self._stale:
            self._mujoco.mj_kinematics(self._model, self._data)
            self._mujoco.mj_comPos(self._model, self._data)
            self._mujoco.mj_comVel(self._model, self._data)
            self._stale = False


def silence_warnings() -> None:
    """Keep MuJoCo's warnings about diverging runs off the terminal, where it is installed."""
    with contextlib.suppress(ImportError):
        import mujoco
        mujoco.set_mju_user_warning(lambda message: None)

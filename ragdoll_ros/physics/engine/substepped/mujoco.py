"""MujocoEngine: the engine protocol on MuJoCo, for comparison in the accuracy report.

MuJoCo is optional: `pip install ragdoll_ros[report]`.
"""
import contextlib

import numpy as np

from ....files.mjcf import static_geoms, to_mjcf
from ....model import errors, rotation
from ....model.coordinates import GeneralizedState
from ....model.ragdoll import Joint, joint_frame
from ....model.scene import Placement, Scene
from ....model.state import State
from ...accuracy import Accuracy
from ..protocol import GROUND, Contacts, MissingEngine, Wrenches, allowed_penetration
from .engine import SubsteppedEngine

INTEGRATORS = ('euler', 'implicitfast', 'rk4')
"""Semi-implicit Euler with implicit joint damping; Euler implicit in all velocities; order 4."""

CONTACT_SUBSTEPS, LIMIT_SUBSTEPS = 4.0, 2.0
"""Time constants (solref) of joint limits and of contacts without restitution, in substeps; with
restitution contacts have the same frequency. Shorter ones add energy, longer ones allow more
penetration and overshoot."""

XYZW, WXYZ = [1, 2, 3, 0], [3, 0, 1, 2]
"""Permutations from MuJoCo's quaternion order w, x, y, z to x, y, z, w, and back."""


class MujocoEngine(SubsteppedEngine):
    """A scene in MuJoCo, without correction of energy."""

    energy_error = 1.0
    """See Engine; the largest gain measured, under hard pushes, is 0.5."""

    def __init__(self, scene: Scene, accuracy: Accuracy, integrator: str = 'implicitfast', *,
                 workers: int = 1) -> None:
        if integrator not in INTEGRATORS:
            raise errors.OutOfRange('integrator', integrator, 'one of ' + ', '.join(INTEGRATORS))
        try:
            import mujoco
        except ImportError as error:
            raise MissingEngine('MuJoCo is missing: pip install "ragdoll_ros[report]"') from error
        super().__init__(scene, accuracy, workers=workers)
        self.lags = integrator != 'rk4'
        self._mujoco = mujoco
        self._integrator = getattr(mujoco.mjtIntegrator, 'mjINT_' + integrator.upper())
        self._excluded_pairs: set[frozenset[str]] = set()
        self._build()
        self.set_coordinates(self._initial_coordinates())

    def contacts(self) -> Contacts:
        self._mujoco.mj_forward(self._model, self._data)
        self._stale = False
        found, force = [], np.zeros(6)
        for index in range(self._data.ncon):
            contact = self._data.contact[index]
            a, b = (self._bone_of.get(geom, GROUND) for geom in contact.geom)
            self._mujoco.mj_contactForce(self._model, self._data, index, force)
            # MuJoCo's normal points from the first geom to the second, ours from b to a
            frame, body = -contact.frame.reshape(3, 3), contact.geom[1]
            if a == GROUND:
                a, b, frame, body = b, GROUND, -frame, contact.geom[0]
            arm = frame[0] * contact.dist / 2
            pull, torque = force[:3] @ frame, force[3:] @ frame
            found.append([a, b, self._static.get(body, GROUND), *contact.pos + arm, *frame[0],
                          -contact.dist, force[0], *pull, *torque - np.cross(arm, pull)])
        return Contacts.of(found)

    def close(self) -> None:
        """Do nothing: memory is freed with the object."""

    def _run_substeps(self, duration: float, substeps: int,
                      loads: Wrenches) -> set[tuple[int, int]]:
        """Take equal substeps by one call to MuJoCo; no pairs, which only _conserve() needs."""
        step = duration / substeps
        if step != self._substep:
            self._model.opt.timestep = self._substep = step
            # A contact's frequency is 1 / (time constant * damping ratio). A high restitution has a
            # small ratio: undivided by it, the time constant would give a period below a substep.
            self._model.geom_solref[:, 0] = CONTACT_SUBSTEPS * step / self._model.geom_solref[:, 1]
            self._model.jnt_solref[:, 0] = LIMIT_SUBSTEPS * step
        self._apply(loads)
        self._mujoco.mj_step(self._model, self._data, substeps)
        if loads:
            self._data.xfrc_applied[:] = 0
        self._stale = True
        return set()

    def _read_state(self) -> State:
        self._refresh()
        data, bodies = self._data, self._bodies
        # cvel is expressed at the centre of mass of the kinematic tree
        angular = data.cvel[bodies, :3].copy()
        arms = data.xipos[bodies] - data.subtree_com[self._model.body_rootid[bodies]]
        return State(data.xipos[bodies].copy(), data.xquat[bodies][:, [1, 2, 3, 0]],
                     data.cvel[bodies, 3:] + np.cross(angular, arms), angular)

    def _read_coordinates(self) -> GeneralizedState:
        q = self._data.qpos.copy()
        for iq, _ in self._roots:
            q[iq + 3:iq + 7] = q[iq + 3:iq + 7][XYZW]
        for iq, _, seat in self._balls:
            turn = rotation.multiply(seat, q[iq:iq + 4][XYZW])
            q[iq:iq + 4] = rotation.multiply(turn, rotation.inverse(seat))
        return GeneralizedState(q, self._outwards(self._data.qpos, self._data.qvel))

    def _write_coordinates(self, coordinates: GeneralizedState) -> None:
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

    def _touching_pairs(self) -> set[tuple[int, int]]:
        if not self._data.ncon:
            return set()
        return {tuple(pair) for pair in self._doll_of[self._data.contact.geom].tolist()}

    def _exclude_overlaps(self) -> None:
        self._refresh()
        self._mujoco.mj_collision(self._model, self._data)
        bodies, roots = self._model.geom_bodyid, self._model.body_rootid
        pairs, depth = set(), allowed_penetration(self.scene)
        for contact in self._data.contact:
            a, b = bodies[contact.geom]
            if contact.dist < -depth and a and b and roots[a] == roots[b]:
                pairs.add(frozenset(self._model.body(int(body)).name for body in (a, b)))
        if pairs:
            here = self._read_coordinates()
            self._excluded_pairs |= pairs
            self._build()
            self._write_coordinates(here)

    def _save(self) -> object:
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self._mujoco.mj_stateSize(self._model, kind))
        self._mujoco.mj_getState(self._model, self._data, state, kind)
        return state

    def _restore(self, held: object) -> None:
        kind = self._mujoco.mjtState.mjSTATE_INTEGRATION
        self._mujoco.mj_setState(self._model, self._data, held, kind)
        self._stale = True

    def _discard(self, held: object) -> None: ...

    def _build(self) -> None:
        mujoco = self._mujoco
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(self.scene, self._excluded_pairs))
        self._data = mujoco.MjData(self._model)
        self._model.opt.integrator = self._integrator
        # no automatic reset of diverged states: Guard must see them
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self._bodies = np.array([self._model.body(name).id for name in self.scene.bone_names])
        bones = {int(body): bone for bone, body in enumerate(self._bodies)}
        self._bone_of = {geom: bones[body] for geom, body in enumerate(self._model.geom_bodyid)
                         if body in bones}
        self._static = {
            self._model.geom(f'bodies/{body.name}/{number}').id: index
            for index, body in enumerate(self.scene.bodies)
            for number, _ in enumerate(static_geoms(body), 1)}
        self._doll_of = np.full(self._model.ngeom, GROUND)
        self._doll_of[list(self._bone_of)] = self.scene.doll_of_bone[list(self._bone_of.values())]
        self._roots, self._balls = [], []
        for placement in self.scene.dolls:
            doll = placement.doll
            self._roots.append(self._address(placement, doll.root.name + '/free'))
            self._balls += [self._ball(placement, joint) for joint in doll.joints
                            if joint.is_free_ball]
        self._stale, self._substep = True, 0.0

    def _ball(self, placement: Placement, joint: Joint) -> tuple[int, int, np.ndarray]:
        """Addresses in q and v of a free ball joint, and its child's orientation at rest in the
        joint's frame.
        """
        child = placement.doll.bone(joint.child)
        seat = rotation.multiply(rotation.inverse(joint_frame(joint)), child.orientation)
        return *self._address(placement, joint.child), seat

    def _address(self, placement: Placement, name: str) -> tuple[int, int]:
        joint = self._model.joint(self.scene.qualified(placement, name))
        return int(joint.qposadr[0]), int(joint.dofadr[0])

    def _initial_coordinates(self) -> GeneralizedState:
        """Initial coordinates with the placements' velocities, each doll moving as a rigid body."""
        start = self._read_coordinates()
        for placement, (_, iv) in zip(self.scene.dolls, self._roots, strict=True):
            start.v[iv:iv + 3] = placement.root_velocity()
            start.v[iv + 3:iv + 6] = placement.spin
        return start

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
        """Rotate angular velocities or accelerations from MuJoCo's axes to the protocol's."""
        v = rates.copy()
        for iq, iv in self._roots:
            v[iv + 3:iv + 6] = rotation.rotate(qpos[iq + 3:iq + 7][XYZW], v[iv + 3:iv + 6])
        for _, iv, seat in self._balls:
            v[iv:iv + 3] = rotation.rotate(seat, v[iv:iv + 3])
        return v

    def _refresh(self) -> None:
        """Update the kinematics of the bodies if the coordinates have changed."""
        if self._stale:
            self._mujoco.mj_kinematics(self._model, self._data)
            self._mujoco.mj_comPos(self._model, self._data)
            self._mujoco.mj_comVel(self._model, self._data)
            self._stale = False


def silence_warnings() -> None:
    """Discard all warnings of MuJoCo, such as those about diverging runs, if MuJoCo is
    installed.
    """
    with contextlib.suppress(ImportError):
        import mujoco
        mujoco.set_mju_user_warning(lambda message: None)

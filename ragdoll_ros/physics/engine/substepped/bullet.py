"""PyBullet behind the engine protocol, the one file that knows it.

Built from what was measured: dolls are Featherstone multibodies read from URDF with explicit
inertia; universal joints are two hinges with a link of no mass between; joint motors, link
damping and velocity clamps, which are on by default, are off.
"""
from __future__ import annotations

import math
import os
import tempfile
from dataclasses import dataclass

import numpy as np

from ....files.urdf import to_urdf
from ....model import errors, rotation
from ....model.coordinates import GeneralizedState
from ....model.ragdoll import Bone, Ragdoll
from ....model.scene import Placement, Scene, finite_friction
from ....model.state import State
from ...accuracy import Accuracy
from ...motion import damping_rate
from ..protocol import GROUND, AppliedWrench, Contacts, Wrenches, pressed
from .conservation import ConservationProjection
from .engine import SubsteppedEngine
from .silence import hushed

with hushed():  # PyBullet prints when it was built
    import pybullet

BREAKING_DISTANCE = 2e-3
"""m at which a contact point is let go. A gap is room to move in within a substep, so that it eats
of a bounce: the default, 0.02 m, eats half of every small one."""

LEAST_BOUNCE = 0.05
"""m/s: approach speed below which nothing bounces, if the material and the substep don't ask for
more. It must lie above the speed that gravity gives within a substep, or a resting bone
chatters for ever; twice that is taken."""

SOLVER_ITERATIONS = 20
"""20 are as good as 50; 5 to 10 leave 1 to 5 mm of sinking."""

RETURN = 0.01
"""s: time constant with which a joint past its limit, and bones that overlap, come back. Bullet's
own shares of 0.2 and 0.08 a step return them faster the finer the steps, a blow that makes energy;
its split impulse never does for limits."""

LARGEST_RATE = 1e4
"""rad/s and m/s at which PyBullet clamps; its default of 100 makes energy in a 50 m drop."""

MOST_COORDINATES = 128
"""Numbers in q of one doll that PyBullet tells of; it drops more without a word."""

STIFFEST = 1.5
"""Substep times the fastest rate at which damping ends a motion: from 2 on, explicit steps make
energy of it."""

_FLAGS = (pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER)


@dataclass
class _Doll:
    """A doll in the engine: its body, and the links that are its bones and joints."""

    body: int
    links: list[int]
    """Link of each bone in the doll's order; -1 for the root."""
    children: list[int]
    """Links of the bones but the root, in the doll's order."""
    root: int
    """Index of the root among the doll's bones."""
    joints: list[int]
    """Joints that move, in the engine's order, root to leaf."""
    widths: list[tuple[int, int]]
    """Numbers in q and in v of each joint."""


class _World:
    """The scene in a client of PyBullet: ground and dolls, as they stand and move at the start."""

    def __init__(self, scene: Scene, client: int) -> None:
        self.scene, self._client = scene, client
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=SOLVER_ITERATIONS, contactBreakingThreshold=BREAKING_DISTANCE,
            deterministicOverlappingPairs=1, enableFileCaching=0, useSplitImpulse=0, contactSlop=0,
            physicsClientId=client)
        pybullet.setGravity(*scene.gravity, physicsClientId=client)
        self.ground = self._add_ground()
        self.dolls = [self._add_doll(placement) for placement in scene.dolls]

    def _add_ground(self) -> int | None:
        ground = self.scene.ground
        if ground is None:
            return None
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, planeNormal=ground.normal, physicsClientId=self._client)
        body = pybullet.createMultiBody(0, shape, -1, [n * ground.offset for n in ground.normal],
                                        physicsClientId=self._client)
        self._set_material(body, -1, None)
        return body

    def _add_doll(self, placement: Placement) -> _Doll:
        doll = placement.doll
        flags = _FLAGS | (pybullet.URDF_USE_SELF_COLLISION if self.scene.self_collision else 0)
        position, _ = placement.bone_pose(doll.root)
        with tempfile.TemporaryDirectory(prefix='ragdoll_ros_') as folder:
            path = os.path.join(folder, 'doll.urdf')
            with open(path, 'w', encoding='utf-8') as file:
                file.write(to_urdf(doll, 'bullet'))
            body = pybullet.loadURDF(path, _list(position), placement.orientation, flags=flags,
                                     physicsClientId=self._client)
        if any(placement.velocity + placement.spin):
            pybullet.resetBaseVelocity(body, _list(placement.root_velocity()), placement.spin,
                                       physicsClientId=self._client)
        return self._set_up(doll, body)

    def _set_up(self, doll: Ragdoll, body: int) -> _Doll:
        """Find links and joints by name, and switch off what PyBullet switches on."""
        links, joints, widths = {doll.root.name: -1}, [], []
        damping = {name: joint.damping for joint in doll.joints
                   for name in (joint.child, *joint.angle_names)}
        for index in range(pybullet.getNumJoints(body, self._client)):
            info = pybullet.getJointInfo(body, index, self._client)
            name, kind, link = info[1].decode(), info[2], info[12].decode()
            links[link] = index
            if kind == pybullet.JOINT_FIXED:
                continue
            joints.append(index)
            ball = kind == pybullet.JOINT_SPHERICAL
            widths.append((4, 3) if ball else (1, 1))
            self._free_joint(body, index, ball)
            loss = damping.get(name, 0.0)
            pybullet.changeDynamics(body, index, jointDamping=loss, physicsClientId=self._client)
        for link in range(-1, pybullet.getNumJoints(body, self._client)):
            pybullet.changeDynamics(
                body, link, linearDamping=0, angularDamping=0, maxJointVelocity=LARGEST_RATE,
                physicsClientId=self._client)
        order = [links[bone.name] for bone in doll.bones]
        for bone, link in zip(doll.bones, order, strict=True):
            self._set_material(body, link, bone)
        for pair in doll.excluded_pairs:
            pybullet.setCollisionFilterPair(body, body, *(links[name] for name in pair), 0,
                                            physicsClientId=self._client)
        return _Doll(body, order, [link for link in order if link >= 0], order.index(-1),
                     joints, widths)

    def _free_joint(self, body: int, joint: int, ball: bool) -> None:
        """Take PyBullet's default motor off a joint."""
        if ball:
            pybullet.setJointMotorControlMultiDof(
                body, joint, pybullet.POSITION_CONTROL, targetPosition=[0, 0, 0, 1],
                positionGain=0, velocityGain=0, force=[0, 0, 0], physicsClientId=self._client)
        else:
            pybullet.setJointMotorControl2(body, joint, pybullet.VELOCITY_CONTROL, force=0,
                                           physicsClientId=self._client)

    def _set_material(self, body: int, link: int, bone: Bone | None) -> None:
        """Set what a bone, or the ground, brings to a contact.

        PyBullet multiplies the two parts, so take roots; for rolling it adds each one's lever arm
        times the other's friction.
        """
        friction, rolling, restitution = self.scene.material.on(bone)
        sliding = math.sqrt(finite_friction(friction))
        pybullet.changeDynamics(
            body, link, lateralFriction=sliding,
            rollingFriction=rolling / (2 * sliding) if sliding else 0.0, spinningFriction=0,
            restitution=math.sqrt(restitution), physicsClientId=self._client)


class BulletEngine(SubsteppedEngine):
    """A scene in PyBullet, with an account of energy and momentum.

    Runs in a client of its own, so that many can live side by side.
    """

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        super().__init__(scene, accuracy, workers=workers)
        self._check_sizes()
        self._client = pybullet.connect(pybullet.DIRECT)
        self._timing: tuple[float, int] | None = None
        self._gravity = math.hypot(*scene.gravity)
        self._damping_rate = damping_rate(scene)
        self._projection = ConservationProjection(scene, self.layout)
        try:
            self._take(_World(scene, self._client))
        except BaseException:
            self.close()
            raise

    def contacts(self) -> Contacts:
        """What touched in the last substep."""
        found = []
        # PyBullet divides a substep's impulse by the time of all.
        substeps = self._timing[1] if self._timing else 1
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            a, b = self._bone_of.get(point[1:4:2]), self._bone_of.get(point[2:5:2])
            position, normal = point[5], np.array(point[7])
            if a is None:
                a, b, position, normal = b, GROUND, point[6], -normal
            found.append([a, GROUND if b is None else b, *position, *normal, -point[8],
                          point[9] * substeps])
        return Contacts.of(found)

    def close(self) -> None:
        """Release the client; a second time does nothing."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def _take(self, world: _World) -> None:
        """Note what the world holds, and let it begin."""
        self._ground, self._dolls = world.ground, world.dolls
        self._links = [(doll.body, link) for doll in self._dolls for link in doll.links]
        self._doll_of = {doll.body: index for index, doll in enumerate(self._dolls)}
        if self._ground is not None:
            self._doll_of[self._ground] = GROUND
        self._bone_of = {link: bone for bone, link in enumerate(self._links)}
        self.place(self.coordinates)

    def _check_sizes(self) -> None:
        """Refuse what PyBullet would cut off without a word."""
        for placement, own in zip(self.scene.dolls, self.layout.doll_q, strict=True):
            count = own.stop - own.start
            if count > MOST_COORDINATES:
                raise errors.OutOfRange(
                    f'joints of {placement.name}', count, f'at most {MOST_COORDINATES} coordinates '
                    'for engine bullet, 7 for the root')

    def _run(self, duration: float, substeps: int, loads: Wrenches) -> set[tuple[int, int]]:
        """Go on; substep by substep where something is to be seen to in each.

        PyBullet damps joints, and turns loads, once in a call. Which pairs touched is told only if
        the account wants to know.
        """
        watch = self._accounts
        if not (loads or watch or self._damping_rate):
            self._step(duration, substeps)
            return set()
        touched = set()
        for _ in range(substeps):
            for load in loads:
                self._apply(load)
            self._step(duration / substeps, 1)
            if watch:
                touched |= self._touched()
        return {(a, b) for a, b in touched if a != b}

    @property
    def _accounts(self) -> bool:
        """Whether energy and momentum are kept."""
        return self.accuracy.energy

    def _step(self, duration: float, substeps: int) -> None:
        timing = (duration, substeps)
        if timing != self._timing:
            pybullet.setPhysicsEngineParameter(
                fixedTimeStep=duration, numSubSteps=substeps if substeps > 1 else 0,
                erp=min(0.2, duration / substeps / RETURN),
                contactERP=min(0.08, duration / substeps / RETURN),
                restitutionVelocityThreshold=max(
                    LEAST_BOUNCE, self.scene.material.restitution_speed,
                    2 * self._gravity * duration / substeps),
                physicsClientId=self._client)
            self._timing = timing
        pybullet.stepSimulation(physicsClientId=self._client)

    def _least_substeps(self, duration: float) -> int:
        return math.ceil(self._damping_rate * duration / STIFFEST)

    def _conserve(self, before: State, duration: float, loads: Wrenches,
                  touched: set[tuple[int, int]]) -> None:
        """Keep the momentum of what was in the air, and take out energy from nothing."""
        projection, account = self._projection, self._account
        met = set().union(*touched)
        outside = np.array([doll in met for doll in range(len(self._dolls))])
        if not outside.all():
            self._put(projection.with_momentum(self.coordinates, (before, self.state), duration,
                                               loads, outside))
        groups = projection.groups(touched)
        # What is tolerated goes with the kinetic energy: once more, with what is left of it.
        for _ in range(2):
            surplus = projection.surplus(account, self.motion, groups)
            if (surplus <= 0).all():
                break
            self._put(projection.without_surplus(self.coordinates, self.motion, surplus, outside,
                                                 account))
        projection.close_step(account, self.motion, groups)

    def _read_state(self) -> State:
        return State.of(np.array([row for doll in self._dolls for row in self._rows(doll)]))

    def _read_coordinates(self) -> GeneralizedState:
        q: list[float] = []
        v: list[float] = []
        for doll in self._dolls:
            position, orientation = pybullet.getBasePositionAndOrientation(doll.body, self._client)
            linear, angular = pybullet.getBaseVelocity(doll.body, self._client)
            q += position + orientation
            v += linear + angular
            if doll.joints:
                for joint in pybullet.getJointStatesMultiDof(doll.body, doll.joints,
                                                             physicsClientId=self._client):
                    q += joint[0]
                    v += joint[1]
        return GeneralizedState(np.array(q), np.array(v))

    def _set(self, coordinates: GeneralizedState) -> None:
        # PyBullet takes any quaternion for one of length one, and its own length for a scale.
        q, v = self.layout.normalized(coordinates.q).tolist(), coordinates.v.tolist()
        i = j = 0
        for doll in self._dolls:
            pybullet.resetBasePositionAndOrientation(doll.body, q[i:i + 3], q[i + 3:i + 7],
                                                     self._client)
            pybullet.resetBaseVelocity(
                doll.body, v[j:j + 3], v[j + 3:j + 6], physicsClientId=self._client)
            i, j = i + 7, j + 6
            values, rates = [], []
            for wide, deep in doll.widths:
                values.append(q[i:i + wide])
                rates.append(v[j:j + deep])
                i, j = i + wide, j + deep
            if doll.joints:
                pybullet.resetJointStatesMultiDof(
                    doll.body, doll.joints, values, rates, physicsClientId=self._client)

    def _touched(self) -> set[tuple[int, int]]:
        points = pybullet.getContactPoints(physicsClientId=self._client)
        return {(self._doll_of[point[1]], self._doll_of[point[2]]) for point in points}

    def _exclude_overlaps(self) -> None:
        depth = pressed(self.scene)
        pybullet.performCollisionDetection(physicsClientId=self._client)
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            if point[1] == point[2] and point[8] < -depth:
                pybullet.setCollisionFilterPair(*point[1:5], 0, physicsClientId=self._client)

    def _save(self) -> int:
        return pybullet.saveState(self._client)

    def _restore(self, held: int) -> None:
        pybullet.restoreState(stateId=held, physicsClientId=self._client)

    def _forget(self, held: int) -> None:
        pybullet.removeState(held, physicsClientId=self._client)

    def _rows(self, doll: _Doll) -> list[tuple]:
        """Position, orientation, linear and angular velocity of each bone."""
        bones = []
        if doll.children:
            links = pybullet.getLinkStates(
                doll.body, doll.children, computeLinkVelocity=1, computeForwardKinematics=1,
                physicsClientId=self._client)
            bones = [link[0] + link[1] + link[6] + link[7] for link in links]
        pose = pybullet.getBasePositionAndOrientation(doll.body, self._client)
        motion = pybullet.getBaseVelocity(doll.body, self._client)
        bones.insert(doll.root, pose[0] + pose[1] + motion[0] + motion[1])
        return bones

    def _apply(self, load: AppliedWrench) -> None:
        body, link = self._links[load.bone]
        if link < 0:
            position, orientation = pybullet.getBasePositionAndOrientation(body, self._client)
        else:
            position, orientation = pybullet.getLinkState(
                body, link, computeForwardKinematics=1, physicsClientId=self._client)[:2]
        turn = rotation.matrix(orientation)
        force, torque = load.force, load.torque
        arm = turn @ load.point
        if load.local:
            force, torque = turn @ force, turn @ torque
        pybullet.applyExternalForce(body, link, _list(force), _list(position + arm),
                                    pybullet.WORLD_FRAME, physicsClientId=self._client)
        pybullet.applyExternalTorque(body, link, _list(torque), pybullet.WORLD_FRAME,
                                     physicsClientId=self._client)


def _list(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]

"""PyBullet behind the engine protocol, the one file that knows it.

Built from what was measured: dolls are Featherstone multibodies read from URDF with explicit
inertia; universal joints are two hinges with a link of no mass between; joint motors, link
damping and velocity clamps, which are on by default, are off.
"""
from __future__ import annotations

import dataclasses
import math
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pybullet

from ...files.urdf import to_urdf
from ...model import errors, rotation
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Placement, Scene, grip
from ...model.state import State
from .protocol import GROUND, AppliedWrench, Contact, Wrenches, pressed

BREAKING_DISTANCE = 2e-3
"""m at which a contact point is let go. A gap is room to move in within a substep, so that it eats
of a bounce: the default, 0.02 m, eats half of every small one."""

LEAST_BOUNCE = 0.05
"""m/s: approach speed below which nothing bounces, if the material and the substep don't ask for
more. It must lie above the speed that gravity gives within a substep, or a resting bone
chatters for ever; twice that is taken."""

SOLVER_ITERATIONS = 20
"""20 are as good as 50; 5 to 10 leave 1 to 5 mm of sinking."""

THOROUGH_ITERATIONS = 100
"""For limbs jammed between each other, their limits and the ground: after 20 they sink by 6 mm."""

RETURN = 0.01
"""s: time constant with which a joint past its limit, and bones that overlap, come back. Bullet's
own shares of 0.2 and 0.08 a step return them faster the finer the steps, a blow that makes energy;
its split impulse never does for limits."""

LARGEST_RATE = 1e4
"""rad/s and m/s at which PyBullet clamps; its default of 100 makes energy in a 50 m drop."""

HEAVIEST = 100.0
"""kg m^2: bones with more mass times size squared than this are built in a unit of mass of their
own, as PyBullet holds the impulse of a joint limit to 1000 N m s."""

SLAB = (1e6, 1e6, 10.0)
"""m: half extents of the slab that stands for the ground under boxes."""

MOST_COORDINATES = 128
"""Numbers in q of one doll: what PyBullet holds in a body's state."""

PROBE_STEP = 2.0 ** -10
"""s: the step that measures accelerations; a power of two, so that dividing by it is exact."""

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
    angles: dict[str, int]
    """Place of each joint in ``joints`` by the name of its angle."""


class _World:
    """The scene in a client of PyBullet: ground and dolls, as they stand and move at the start."""

    def __init__(self, scene: Scene, free: bool, client: int) -> None:
        self.scene, self._free, self._client = scene, free, client
        self.unit = _unit_of_mass(scene)
        """kg that the engine takes for one."""
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=SOLVER_ITERATIONS, contactBreakingThreshold=BREAKING_DISTANCE,
            deterministicOverlappingPairs=1, enableFileCaching=0, useSplitImpulse=0, contactSlop=0,
            physicsClientId=client)
        pybullet.setGravity(*scene.gravity, physicsClientId=client)
        self.ground = self._add_ground()
        self.dolls = [self._add_doll(placement) for placement in scene.dolls]
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._check_sizes()

    def _add_ground(self) -> int | None:
        if self.scene.ground is None or self._free:
            return None
        ground = self.scene.ground
        if _slab_is_better(self.scene):
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=SLAB, physicsClientId=self._client)
            turn = rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), np.array(ground.normal))
            depth = SLAB[2]
        else:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_PLANE, planeNormal=ground.normal, physicsClientId=self._client)
            turn, depth = rotation.IDENTITY, 0.0
        place = [n * (ground.offset - depth) for n in ground.normal]
        body = pybullet.createMultiBody(0, shape, -1, place, _list(turn),
                                        physicsClientId=self._client)
        self._set_material(body, -1, None)
        return body

    def _add_doll(self, placement: Placement) -> _Doll:
        doll = self._weighed(placement.doll)
        collide = self.scene.self_collision and not self._free
        flags = _FLAGS | (pybullet.URDF_USE_SELF_COLLISION if collide else 0)
        position, _ = placement.bone_pose(doll.root)
        with tempfile.TemporaryDirectory(prefix='ragdoll_ros_') as folder:
            path = os.path.join(folder, 'doll.urdf')
            with open(path, 'w', encoding='utf-8') as file:
                file.write(to_urdf(doll, 'bullet', limited=not self._free))
            body = pybullet.loadURDF(path, _list(position), placement.orientation, flags=flags,
                                     physicsClientId=self._client)
        if any(placement.velocity + placement.spin):
            pybullet.resetBaseVelocity(body, _list(placement.root_velocity()), placement.spin,
                                       physicsClientId=self._client)
        return self._set_up(doll, body)

    def _weighed(self, doll: Ragdoll) -> Ragdoll:
        """The doll with its masses, and what goes with them, in the engine's unit."""
        if self.unit == 1:
            return doll
        return dataclasses.replace(
            doll,
            bones=tuple(dataclasses.replace(
                bone, mass=bone.mass / self.unit,
                moments=bone.moments and tuple(moment / self.unit for moment in bone.moments))
                for bone in doll.bones),
            joints=tuple(dataclasses.replace(joint, damping=joint.damping / self.unit)
                         for joint in doll.joints))

    def _set_up(self, doll: Ragdoll, body: int) -> _Doll:
        """Find links and joints by name, and switch off what PyBullet switches on."""
        links, joints, widths, angles = {doll.root.name: -1}, [], [], {}
        damping = {name: joint.damping for joint in doll.joints for name in joint.angle_names}
        for index in range(pybullet.getNumJoints(body, self._client)):
            info = pybullet.getJointInfo(body, index, self._client)
            name, kind, link = info[1].decode(), info[2], info[12].decode()
            links[link] = index
            if kind == pybullet.JOINT_FIXED:
                continue
            angles[name] = len(joints)
            joints.append(index)
            ball = kind == pybullet.JOINT_SPHERICAL
            widths.append((4, 3) if ball else (1, 1))
            self._free_joint(body, index, ball)
            loss = damping.get(name, damping.get(f'{name}_x', 0.0))
            pybullet.changeDynamics(body, index, jointDamping=loss, physicsClientId=self._client)
        for link in range(-1, pybullet.getNumJoints(body, self._client)):
            pybullet.changeDynamics(
                body, link, linearDamping=0, angularDamping=0, maxJointVelocity=LARGEST_RATE,
                physicsClientId=self._client)
            if self._free:
                pybullet.setCollisionFilterGroupMask(body, link, 0, 0, self._client)
        order = [links[bone.name] for bone in doll.bones]
        for bone, link in zip(doll.bones, order, strict=True):
            self._set_material(body, link, bone)
        # Bones that share a joint do not collide.
        for joint in doll.joints:
            pybullet.setCollisionFilterPair(body, body, links[joint.parent], links[joint.child],
                                            0, physicsClientId=self._client)
        return _Doll(body, order, [link for link in order if link >= 0], order.index(-1),
                     joints, widths, angles)

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
        sliding = math.sqrt(grip(friction))
        pybullet.changeDynamics(
            body, link, lateralFriction=sliding,
            rollingFriction=rolling / (2 * sliding) if sliding else 0.0, spinningFriction=0,
            restitution=math.sqrt(restitution), physicsClientId=self._client)

    def _check_sizes(self) -> None:
        """Refuse what PyBullet would cut off without a word."""
        for placement, own in zip(self.scene.dolls, self.layout.own_q, strict=True):
            count = own.stop - own.start
            if count > MOST_COORDINATES:
                raise errors.OutOfRange(f'joints of {placement.name}', count,
                                        f'at most {MOST_COORDINATES} coordinates, 7 for the root')


class BulletEngine:
    """A scene in PyBullet. Runs in a client of its own, so that many can live side by side."""

    def __init__(self, scene: Scene, free: bool = False) -> None:
        self.scene = scene
        self._client = pybullet.connect(pybullet.DIRECT)
        self._timing: tuple[float, int] | None = None
        self._thorough = False
        self._gravity = math.hypot(*scene.gravity)
        self._least_bounce = max(LEAST_BOUNCE, scene.material.restitution_speed)
        try:
            self._take(_World(scene, free, self._client))
        except BaseException:
            self.close()
            raise

    def step(self, duration: float, substeps: int, loads: Wrenches = ()) -> None:
        timing = (duration, substeps)
        if timing != self._timing:
            pybullet.setPhysicsEngineParameter(
                fixedTimeStep=duration, numSubSteps=substeps if substeps > 1 else 0,
                erp=min(0.2, duration / substeps / RETURN),
                contactERP=min(0.08, duration / substeps / RETURN),
                restitutionVelocityThreshold=max(
                    self._least_bounce, 2 * self._gravity * duration / substeps),
                physicsClientId=self._client)
            self._timing = timing
        for load in loads:
            self._apply(load)
        pybullet.stepSimulation(physicsClientId=self._client)

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        """Rates of change of ``coordinates.v``, from one small step.

        PyBullet's step takes v to v + a h with a from where the step begins, so the quotient is
        exact but for rounding. It holds where nothing touches and no limit is reached.
        """
        self.place(coordinates)
        self.step(PROBE_STEP, 1, loads)
        return (self._velocities() - coordinates.v) / PROBE_STEP

    def read(self) -> State:
        return State.of(np.array([row for doll in self._dolls for row in self._rows(doll)]))

    def coordinates(self) -> GeneralizedState:
        q: list[float] = []
        v: list[float] = []
        for doll in self._dolls:
            position, orientation = pybullet.getBasePositionAndOrientation(doll.body, self._client)
            linear, angular = pybullet.getBaseVelocity(doll.body, self._client)
            q += position + orientation
            v += linear + angular
            for joint in self._joints(doll):
                q += joint[0]
                v += joint[1]
        return GeneralizedState(np.array(q), np.array(v))

    def place(self, coordinates: GeneralizedState) -> None:
        q, v = coordinates.q.tolist(), coordinates.v.tolist()
        i = j = 0
        for doll in self._dolls:
            # PyBullet takes any quaternion for one of length one, and its own length for a scale.
            length = math.hypot(*q[i + 3:i + 7])
            pybullet.resetBasePositionAndOrientation(
                doll.body, q[i:i + 3], [x / length for x in q[i + 3:i + 7]], self._client)
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

    def joint_angles(self) -> np.ndarray:
        values = []
        for doll, placement in zip(self._dolls, self.scene.dolls, strict=True):
            states = self._joints(doll)
            for joint in placement.doll.joints:
                if joint.angle_names and joint.angle_names[0] not in doll.angles:
                    values += rotation.to_xyz(states[doll.angles[joint.child]][0])
                else:
                    values += [states[doll.angles[name]][0][0] for name in joint.angle_names]
        return np.array(values)

    def touching(self) -> set[tuple[int, int]]:
        """Pairs of dolls within BREAKING_DISTANCE of touching; GROUND stands for the ground."""
        pybullet.performCollisionDetection(self._client)
        return self.touched()

    def touched(self) -> set[tuple[int, int]]:
        points = pybullet.getContactPoints(physicsClientId=self._client)
        return {(self._doll_of[point[1]], self._doll_of[point[2]]) for point in points}

    def set_solver_iterations(self, wanted: bool) -> None:
        if wanted is not self._thorough:
            self._thorough = wanted
            pybullet.setPhysicsEngineParameter(
                numSolverIterations=THOROUGH_ITERATIONS if wanted else SOLVER_ITERATIONS,
                physicsClientId=self._client)

    def set_ground_friction(self, wanted: bool) -> None:
        friction = 0.0 if wanted else math.sqrt(grip(self.scene.material.friction))
        pybullet.changeDynamics(self._ground, -1, lateralFriction=friction,
                                physicsClientId=self._client)

    def exclude_initial_penetrations(self) -> None:
        depth = pressed(self.scene)
        pybullet.performCollisionDetection(physicsClientId=self._client)
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            if point[1] == point[2] and point[8] < -depth:
                pybullet.setCollisionFilterPair(*point[1:5], 0, physicsClientId=self._client)

    def contacts(self) -> list[Contact]:
        found = []
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            a, b = self._bone_of.get(point[1:4:2]), self._bone_of.get(point[2:5:2])
            position, normal = np.array(point[5]), np.array(point[7])
            if a is None:
                a, b, position, normal = b, GROUND, np.array(point[6]), -normal
            found.append(Contact(a, GROUND if b is None else b, position, normal,
                                 -point[8], point[9] * self._unit))
        return found

    def save(self) -> int:
        return pybullet.saveState(self._client)

    def restore(self, snapshot: int) -> None:
        pybullet.restoreState(stateId=snapshot, physicsClientId=self._client)

    def forget(self, snapshot: int) -> None:
        pybullet.removeState(snapshot, physicsClientId=self._client)

    def close(self) -> None:
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def _take(self, world: _World) -> None:
        """Note what the world holds, and let it begin."""
        self._unit, self._ground, self._dolls = world.unit, world.ground, world.dolls
        self.layout = world.layout
        self._links = [(doll.body, link) for doll in self._dolls for link in doll.links]
        self._doll_of = {doll.body: index for index, doll in enumerate(self._dolls)}
        if self._ground is not None:
            self._doll_of[self._ground] = GROUND
        self._bone_of = {link: bone for bone, link in enumerate(self._links)}
        self.exclude_initial_penetrations()

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

    def _joints(self, doll: _Doll) -> tuple:
        """States of the joints that move: each (angles, rates, ...)."""
        if not doll.joints:
            return ()
        return pybullet.getJointStatesMultiDof(doll.body, doll.joints, physicsClientId=self._client)

    def _velocities(self) -> np.ndarray:
        v: list[float] = []
        for doll in self._dolls:
            motion = pybullet.getBaseVelocity(doll.body, self._client)
            v += motion[0] + motion[1]
            for joint in self._joints(doll):
                v += joint[1]
        return np.array(v)

    def _apply(self, load: AppliedWrench) -> None:
        body, link = self._links[load.bone]
        if link < 0:
            position, orientation = pybullet.getBasePositionAndOrientation(body, self._client)
        else:
            position, orientation = pybullet.getLinkState(
                body, link, computeForwardKinematics=1, physicsClientId=self._client)[:2]
        turn = rotation.matrix(orientation)
        force, torque = load.force / self._unit, load.torque / self._unit
        arm = turn @ load.point
        if load.local:
            force, torque = turn @ force, turn @ torque
        pybullet.applyExternalForce(body, link, _list(force), _list(position + arm),
                                    pybullet.WORLD_FRAME, physicsClientId=self._client)
        pybullet.applyExternalTorque(body, link, _list(torque), pybullet.WORLD_FRAME,
                                     physicsClientId=self._client)


def bare_loop(scene: Scene, start: GeneralizedState,
              substeps: int) -> tuple[Callable[[], None], Callable[[], None]]:
    """The least that can be done in a tick, as a yardstick, and what ends it.

    It steps at a fixed length and reads the links once, with no thought for energy or limits.
    """
    engine = BulletEngine(scene)
    engine.place(start)
    engine.step(scene.step, substeps)
    client, doll = engine._client, engine._dolls[0]

    def tick() -> None:
        pybullet.stepSimulation(physicsClientId=client)
        pybullet.getLinkStates(doll.body, doll.children, computeLinkVelocity=1,
                               computeForwardKinematics=1, physicsClientId=client)

    return tick, engine.close


def _list(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]


def _slab_is_better(scene: Scene) -> bool:
    """Whether a slab stands for the ground: where single boxes slide and tumble.

    Against a plane PyBullet finds one corner in a step, so that a sliding box rocks and sinks, and
    its displacement is off by ten times as much. Dolls of several bones are no better off on a
    slab, and jam sooner.
    """
    return (all(len(placement.doll.bones) == 1 for placement in scene.dolls)
            and any(part.kind == 'box' for bone in scene.bones for part in bone.shape.parts))


def _unit_of_mass(scene: Scene) -> float:
    """The kg that the engine takes for one: 1, or a power of two for giants."""
    largest = max(max(bone.mass * max(bone.shape.half_extents) ** 2, *bone.inertia)
                  for bone in scene.bones)
    return 2.0 ** max(0, math.ceil(math.log2(largest / HEAVIEST)))

"""BulletEngine: the engine protocol on PyBullet; no other engine imports that library.

Dolls are Featherstone multibodies read from URDF with explicit inertia. Universal joints are two
hinges with a massless link between. Joint motors and link damping, which PyBullet enables by
default, are disabled; its velocity clamp is raised to LARGEST_RATE.
"""
import math
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....files.urdf import to_urdf
from ....model import errors, rotation
from ....model.coordinates import GeneralizedState
from ....model.plane import Plane
from ....model.ragdoll import Bone, Ragdoll
from ....model.scene import Placement, Scene, finite_friction
from ....model.shapes import Shape
from ....model.state import State
from ....model.static_body import StaticBody
from ....model.vectors import Vector
from ...accuracy import Accuracy
from ...rigid_body import damping_rate
from ..protocol import GROUND, AppliedWrench, Contacts, Wrenches, allowed_penetration
from .conservation import ConservationProjection
from .engine import SubsteppedEngine
from .silence import silenced_output

with silenced_output():  # PyBullet prints its build time
    import pybullet

BREAKING_DISTANCE = 2e-3
"""m: separation at which a contact point is dropped. Larger values absorb restitution: PyBullet's
default, 0.02 m, halves every small bounce."""

LEAST_BOUNCE = 0.05
"""m/s: lowest restitution threshold. The threshold is at least twice the speed that gravity adds in
a substep, else a resting bone chatters."""

SOLVER_ITERATIONS = 20
"""As accurate as 50; 5 to 10 leave 1 to 5 mm of penetration."""

RETURN = 0.01
"""s: time constant of the correction of joint limits and penetration. PyBullet's defaults, 0.2 and
0.08 per step, correct faster with smaller steps and so add energy; its split impulse does not apply
to limits."""

LARGEST_RATE = 1e4
"""rad/s and m/s: PyBullet's velocity clamp. The default, 100, adds energy in a drop of 50 m."""

MOST_COORDINATES = 128
"""Numbers in q of one doll that PyBullet returns; it drops more without an error."""

MAX_DAMPING_STEP = 1.5
"""Bound on substep times damping rate; explicit damping is unstable from 2 on."""

_GEOMS = {'sphere': pybullet.GEOM_SPHERE, 'box': pybullet.GEOM_BOX,
          'cylinder': pybullet.GEOM_CYLINDER, 'capsule': pybullet.GEOM_CAPSULE}

_FLAGS = (pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER)


@dataclass
class _Doll:
    """PyBullet's indices of a doll's body, links and joints."""

    body: int
    links: list[int]
    """Link of each bone in the doll's order; -1 for the root."""
    children: list[int]
    """``links`` without the root."""
    root: int
    """Index of the root bone in the doll."""
    joints: list[int]
    """Joints with degrees of freedom, root to leaf."""
    widths: list[tuple[int, int]]
    """Numbers of coordinates in q and in v of each of these joints."""


class _World:
    """Builds a scene in a PyBullet client, its dolls with their initial velocities."""

    def __init__(self, scene: Scene, client: int) -> None:
        self.scene, self._client = scene, client
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=SOLVER_ITERATIONS, contactBreakingThreshold=BREAKING_DISTANCE,
            deterministicOverlappingPairs=1, enableFileCaching=0, useSplitImpulse=0, contactSlop=0,
            physicsClientId=client)
        pybullet.setGravity(*scene.gravity, physicsClientId=client)
        self.static = {**dict.fromkeys(self._add_ground(), GROUND), **dict(self._add_bodies())}
        """Index in the scene's bodies, or GROUND, of PyBullet's bodies that never move."""
        self.dolls = [self._add_doll(placement) for placement in scene.dolls]

    def _add_ground(self) -> Iterator[int]:
        ground = self.scene.ground
        if ground is None:
            return
        x, y, z = (n * ground.offset for n in ground.normal)
        yield self._add_plane(ground.normal, (x, y, z), None)

    def _add_bodies(self) -> Iterator[tuple[int, int]]:
        """Add each part of the static bodies as a body of its own; yield its index, and that of the
        scene's body.
        """
        for index, one in enumerate(self.scene.bodies):
            if isinstance(one.shape, Plane):
                yield self._add_plane(one.normal, one.position, one), index
            for part in one.parts:
                shape = pybullet.createCollisionShape(
                    _GEOMS[part.kind], physicsClientId=self._client, **_sizes(part.shape))
                body = pybullet.createMultiBody(0, shape, -1, part.position, part.orientation,
                                                physicsClientId=self._client)
                self._set_material(body, -1, one)
                yield body, index

    def _add_plane(self, normal: Vector, position: Vector, owner: StaticBody | None) -> int:
        """Add the half space below a plane with the material of its ``owner``."""
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, planeNormal=normal, physicsClientId=self._client)
        body = pybullet.createMultiBody(0, shape, -1, position, physicsClientId=self._client)
        self._set_material(body, -1, owner)
        return body

    def _add_doll(self, placement: Placement) -> _Doll:
        doll = placement.doll
        flags = _FLAGS | (pybullet.URDF_USE_SELF_COLLISION if self.scene.self_collision else 0)
        position, _ = placement.bone_pose(doll.root)
        with tempfile.TemporaryDirectory(prefix='ragdoll_ros_') as folder:
            path = os.path.join(folder, 'doll.urdf')
            with open(path, 'w', encoding='utf-8') as file:
                file.write(to_urdf(doll, 'bullet'))
            body = pybullet.loadURDF(path, position.tolist(), placement.orientation, flags=flags,
                                     physicsClientId=self._client)
        if any(placement.velocity + placement.spin):
            pybullet.resetBaseVelocity(body, placement.root_velocity().tolist(), placement.spin,
                                       physicsClientId=self._client)
        return self._set_up(doll, body)

    def _set_up(self, doll: Ragdoll, body: int) -> _Doll:
        """Map links and joints by name; disable motors and link damping, raise the
        velocity clamp.
        """
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
        """Disable the default motor of a joint."""
        if ball:
            pybullet.setJointMotorControlMultiDof(
                body, joint, pybullet.POSITION_CONTROL, targetPosition=[0, 0, 0, 1],
                positionGain=0, velocityGain=0, force=[0, 0, 0], physicsClientId=self._client)
        else:
            pybullet.setJointMotorControl2(body, joint, pybullet.VELOCITY_CONTROL, force=0,
                                           physicsClientId=self._client)

    def _set_material(self, body: int, link: int, bone: Bone | StaticBody | None) -> None:
        """Set friction and restitution of a link or a static body, or of the ground (None).

        PyBullet multiplies the coefficients of both bodies, hence the square roots; for rolling
        friction it adds each body's coefficient times the other's sliding friction.
        """
        friction, rolling, restitution = self.scene.material.on(bone)
        sliding = math.sqrt(finite_friction(friction))
        pybullet.changeDynamics(
            body, link, lateralFriction=sliding,
            rollingFriction=rolling / (2 * sliding) if sliding else 0.0, spinningFriction=0,
            restitution=math.sqrt(restitution), physicsClientId=self._client)


class BulletEngine(SubsteppedEngine):
    """A scene in its own PyBullet client, with correction of energy and momentum."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        super().__init__(scene, accuracy, workers=workers)
        self._check_sizes()
        self._client = pybullet.connect(pybullet.DIRECT)
        self._timing: tuple[float, int] | None = None
        self._gravity = math.hypot(*scene.gravity)
        self._damping_rate = damping_rate(scene)
        self._projection = ConservationProjection(scene, self.layout)
        try:
            self._adopt(_World(scene, self._client))
        except BaseException:
            self.close()
            raise

    def contacts(self) -> Contacts:
        found = []
        # PyBullet divides the impulse of a substep by the duration of all substeps.
        substeps = self._timing[1] if self._timing else 1
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            a, b = self._bone_of.get(point[1:4:2]), self._bone_of.get(point[2:5:2])
            position, normal, body = point[5], np.array(point[7]), point[2]
            force = substeps * (point[9] * normal + np.dot(point[10:14:2], point[11:15:2]))
            if a is None:
                a, b, position, normal, body, force = b, None, point[6], -normal, point[1], -force
            found.append([a, GROUND if b is None else b, self._static.get(body, GROUND), *position,
                          *normal, -point[8], point[9] * substeps, *force, 0.0, 0.0, 0.0])
        return Contacts.of(found)

    def close(self) -> None:
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def _adopt(self, world: _World) -> None:
        """Map PyBullet's bodies and links to dolls and bones, and set the initial state."""
        self._dolls = world.dolls
        self._links = [(doll.body, link) for doll in self._dolls for link in doll.links]
        self._doll_of = {doll.body: index for index, doll in enumerate(self._dolls)}
        self._doll_of |= dict.fromkeys(world.static, GROUND)
        self._static = world.static
        self._bone_of = {link: bone for bone, link in enumerate(self._links)}
        self.set_coordinates(self.coordinates)

    def _check_sizes(self) -> None:
        """Raise OutOfRange for dolls with more coordinates than PyBullet returns."""
        for placement, own in zip(self.scene.dolls, self.layout.doll_q, strict=True):
            count = own.stop - own.start
            if count > MOST_COORDINATES:
                raise errors.OutOfRange(
                    f'joints of {placement.name}', count, f'at most {MOST_COORDINATES} coordinates '
                    'for engine bullet, 7 for the root')

    def _run_substeps(self, duration: float, substeps: int,
                      loads: Wrenches) -> set[tuple[int, int]]:
        """Take equal substeps, in one call to PyBullet where nothing changes between them.

        Joint damping and loads are updated once per call. Pairs are collected only for _conserve().
        """
        watch = self._conserves
        if not (loads or watch or self._damping_rate):
            self._step(duration, substeps)
            return set()
        touched = set()
        for _ in range(substeps):
            for load in loads:
                self._apply(load)
            self._step(duration / substeps, 1)
            if watch:
                touched |= self._touching_pairs()
        return {(a, b) for a, b in touched if a != b}

    @property
    def _conserves(self) -> bool:
        """Whether energy and momentum are corrected."""
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
        return math.ceil(self._damping_rate * duration / MAX_DAMPING_STEP)

    def _conserve(self, before: State, duration: float, loads: Wrenches,
                  touched: set[tuple[int, int]]) -> None:
        """Restore the momenta of dolls in the air and remove spurious energy."""
        projection, account = self._projection, self._account
        met = set().union(*touched)
        outside = np.array([doll in met for doll in range(len(self._dolls))])
        if not outside.all():
            self._set_state(projection.with_momentum(
                self.coordinates, (before, self.state), duration, loads, outside))
        groups = projection.groups(touched)
        # The tolerance depends on the kinetic energy, which the first correction changes.
        for _ in range(2):
            surplus = projection.surplus(account, self.doll_totals, groups)
            if (surplus <= 0).all():
                break
            self._set_state(projection.without_surplus(
                self.coordinates, self.doll_totals, surplus, outside, account))
        projection.close_step(account, self.doll_totals, groups)

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

    def _write_coordinates(self, coordinates: GeneralizedState) -> None:
        # PyBullet does not normalise quaternions: their length would scale the doll.
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

    def _touching_pairs(self) -> set[tuple[int, int]]:
        points = pybullet.getContactPoints(physicsClientId=self._client)
        return {(self._doll_of[point[1]], self._doll_of[point[2]]) for point in points}

    def _exclude_overlaps(self) -> None:
        depth = allowed_penetration(self.scene)
        pybullet.performCollisionDetection(physicsClientId=self._client)
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            if point[1] == point[2] and point[8] < -depth:
                pybullet.setCollisionFilterPair(*point[1:5], 0, physicsClientId=self._client)

    def _save(self) -> int:
        return pybullet.saveState(self._client)

    def _restore(self, held: int) -> None:
        pybullet.restoreState(stateId=held, physicsClientId=self._client)

    def _discard(self, held: int) -> None:
        pybullet.removeState(held, physicsClientId=self._client)

    def _rows(self, doll: _Doll) -> list[tuple]:
        """Position, orientation, linear and angular velocity of each bone of a doll."""
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
        pybullet.applyExternalForce(body, link, force.tolist(), (position + arm).tolist(),
                                    pybullet.WORLD_FRAME, physicsClientId=self._client)
        pybullet.applyExternalTorque(body, link, torque.tolist(), pybullet.WORLD_FRAME,
                                     physicsClientId=self._client)


def _sizes(shape: Shape) -> dict[str, object]:
    """A shape's sizes as arguments of createCollisionShape."""
    if shape.kind == 'box':
        return {'halfExtents': shape.half_extents}
    return {'radius': shape.radius} | (
        {} if shape.kind == 'sphere' else {'height': shape.length})

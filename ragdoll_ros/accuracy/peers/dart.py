"""DART on our scene: dolls of boxes and spheres with hinge, universal and fixed joints."""
import numpy as np

from ...model import errors, rotation
from ...model.coordinates import GeneralizedState
from ...model.pose import Pose
from ...model.ragdoll import Bone, Joint
from ...model.scene import Scene
from ...model.state import State
from ..cases.trial import Trial, posed

GROUND_SIZE, GROUND_DEPTH = 2000.0, 2.0
"""m: the ground is a box, since DART's own collision detector has no planes; dolls that are pushed
go 300 m."""


class Dart:
    """A trial in DART with ``substeps`` steps per tick; raises OutOfRange for other shapes and
    joints.
    """

    def __init__(self, trial: Trial, substeps: int) -> None:
        import dartpy
        self._dart, self._trial, self._substeps = dartpy, trial, substeps
        scene = trial.scene
        self._world = dartpy.simulation.World()
        self._world.setGravity(list(scene.gravity))
        self._world.setTimeStep(scene.step / substeps)
        self._world.setCollisionDetector(dartpy.collision.DARTCollisionDetector())
        if scene.ground is not None:
            self._add_ground(scene)
        placement, = scene.dolls
        self._skeleton = dartpy.dynamics.Skeleton(placement.name)
        self._bodies: dict[str, object] = {}
        self._add_root(placement.doll.root)
        for joint in placement.doll.joints_depth_first():
            self._add_child(joint)
        if scene.self_collision:
            self._skeleton.enableSelfCollisionCheck()
        self._world.addSkeleton(self._skeleton)
        self._order = [self._bodies[bone.name] for bone in placement.doll.bones]
        self._count = 0
        self._place(trial.start or posed(placement))

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""
        rows = []
        for body in self._order:
            pose = body.getWorldTransform()
            turn = pose.quaternion()
            rows.append([*pose.translation(), *turn.xyz(), turn.w(),
                         *body.getCOMLinearVelocity(), *body.getAngularVelocity()])
        return State.of(np.array(rows))

    def advance(self) -> None:
        """Advance by one tick."""
        tick = self._trial.scene.step
        loads = self._trial.loads(self._count * tick, (self._count + 1) * tick)
        for _ in range(self._substeps):
            for load in loads:
                body = self._order[load.bone]
                body.addExtForce(load.force, load.point, False, True)
                body.addExtTorque(load.torque, False)
            self._world.step()
        self._count += 1

    def close(self) -> None:
        """Do nothing: memory is freed with the object."""

    def _add_ground(self, scene: Scene) -> None:
        ground = self._dart.dynamics.Skeleton('ground')
        joint, body = ground.createWeldJointAndBodyNodePair()
        turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), np.array(scene.ground.normal))
        joint.setTransformFromParentBodyNode(self._transform(Pose(
            (scene.ground.offset - GROUND_DEPTH / 2) * np.array(scene.ground.normal), turn)))
        self._add_shape(body, self._dart.dynamics.BoxShape(
            [GROUND_SIZE, GROUND_SIZE, GROUND_DEPTH]), None)
        self._world.addSkeleton(ground)

    def _add_root(self, bone: Bone) -> None:
        self._root, body = self._skeleton.createFreeJointAndBodyNodePair()
        self._fill(body, bone)

    def _add_child(self, joint: Joint) -> None:
        """Add the child of a joint; the joint's frame has the doll's axes in the bind pose."""
        doll = self._trial.scene.dolls[0].doll
        parent, child = doll.bone(joint.parent), doll.bone(joint.child)
        create = {'hinge': self._skeleton.createRevoluteJointAndBodyNodePair,
                  'universal': self._skeleton.createUniversalJointAndBodyNodePair,
                  'fixed': self._skeleton.createWeldJointAndBodyNodePair}.get(joint.kind)
        if create is None:
            raise errors.OutOfRange('kind', joint.kind, 'hinge, universal or fixed for DART')
        made, body = create(self._bodies[parent.name])
        seat = Pose(np.array(joint.anchor), np.array(rotation.IDENTITY))
        made.setTransformFromParentBodyNode(self._transform(parent.pose.relative(seat)))
        made.setTransformFromChildBodyNode(self._transform(child.pose.relative(seat)))
        for place, axis in enumerate(joint.axes, 1):
            getattr(made, 'setAxis' if joint.kind == 'hinge' else f'setAxis{place}')(axis)
        for index, pair in enumerate(joint.angle_limits):
            made.setDampingCoefficient(index, joint.damping)
            if pair:
                made.setPositionLowerLimit(index, pair[0])
                made.setPositionUpperLimit(index, pair[1])
        made.setLimitEnforcement(True)
        self._fill(body, child)

    def _fill(self, body: object, bone: Bone) -> None:
        """Give a body a bone's mass and shape; its frame is the bone's."""
        dynamics = self._dart.dynamics
        body.setInertia(dynamics.Inertia(bone.mass, np.zeros(3), np.diag(bone.inertia)))
        shape = {'box': lambda: dynamics.BoxShape(bone.shape.size),
                 'sphere': lambda: dynamics.SphereShape(bone.shape.radius)}.get(bone.shape.kind)
        if shape is None:
            raise errors.OutOfRange('shape', bone.shape.kind, 'box or sphere for DART')
        self._add_shape(body, shape(), bone)
        self._bodies[bone.name] = body

    def _add_shape(self, body: object, shape: object, bone: Bone | None) -> None:
        """Add a shape; DART takes the smaller friction of a pair, and multiplies restitutions."""
        friction, _, restitution = self._trial.scene.material.on(bone)
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.getDynamicsAspect().setFrictionCoeff(friction)
        node.getDynamicsAspect().setRestitutionCoeff(restitution ** 0.5)

    def _place(self, start: GeneralizedState) -> None:
        q, v = start.q, start.v
        self._root.setTransform(self._transform(Pose(q[:3], q[3:7])))
        self._root.setLinearVelocity(v[:3])
        self._root.setAngularVelocity(v[3:6])
        for index, (angle, rate) in enumerate(zip(q[7:], v[6:], strict=True), 6):
            self._skeleton.setPosition(index, angle)
            self._skeleton.setVelocity(index, rate)

    def _transform(self, pose: Pose) -> object:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation.matrix(pose.orientation), pose.position
        return self._dart.math.Isometry3(matrix)

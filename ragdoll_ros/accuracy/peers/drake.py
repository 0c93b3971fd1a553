"""Drake on our scene: discrete SAP with point contacts, which have no restitution."""
import logging

import numpy as np

from ...model import errors, rotation
from ...model.coordinates import GeneralizedState
from ...model.pose import Pose
from ...model.ragdoll import Bone, Joint
from ...model.scene import Scene
from ...model.state import State
from ..cases.trial import Trial, posed


class Drake:
    """A trial in Drake with ``substeps`` steps per tick.

    Raises OutOfRange for restitution, pushes, and joints or shapes that are not translated here.
    """

    def __init__(self, trial: Trial, substeps: int) -> None:
        from pydrake import geometry, math
        from pydrake.multibody import plant, tree
        from pydrake.systems import analysis, framework
        # It warns that half spaces do not touch deformable bodies.
        logging.getLogger('drake').setLevel(logging.ERROR)
        self._geometry, self._math, self._plants, self._tree = geometry, math, plant, tree
        scene = trial.scene
        if scene.material.restitution or trial.pushes:
            raise errors.OutOfRange('trial', scene.name, 'no restitution and no pushes for Drake')
        self._scene, self._ticks = scene, 0
        builder = framework.DiagramBuilder()
        self._plant, self._shapes = plant.AddMultibodyPlant(plant.MultibodyPlantConfig(
            time_step=scene.step / substeps, discrete_contact_approximation='sap',
            contact_model='point'), builder)
        self._plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        placement, = scene.dolls
        self._bodies, self._joints = {}, []
        self._add_bone(placement.doll.root)
        for joint in placement.doll.joints_depth_first():
            self._add_child(joint)
        if scene.ground is not None:
            self._add_ground(scene)
        self._filter_collisions(scene)
        self._plant.Finalize()
        self._order = [self._bodies[bone.name] for bone in placement.doll.bones]
        self._simulator = analysis.Simulator(builder.Build())
        self._context = self._plant.GetMyMutableContextFromRoot(
            self._simulator.get_mutable_context())
        self._place(placement.doll.root, trial.start or posed(placement))
        self._simulator.Initialize()

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""
        rows = []
        for body in self._order:
            pose = self._plant.EvalBodyPoseInWorld(self._context, body)
            motion = self._plant.EvalBodySpatialVelocityInWorld(self._context, body)
            turn = pose.rotation().ToQuaternion()
            rows.append([*pose.translation(), *turn.xyz(), turn.w(), *motion.translational(),
                         *motion.rotational()])
        return State.of(np.array(rows))

    def advance(self) -> None:
        """Advance by one tick."""
        self._ticks += 1
        self._simulator.AdvanceTo(self._ticks * self._scene.step)

    def close(self) -> None:
        """Do nothing: memory is freed with the object."""

    def _add_bone(self, bone: Bone) -> None:
        """Add a body whose frame is the bone's."""
        inertia = self._tree.UnitInertia(*(moment / bone.mass for moment in bone.inertia))
        body = self._plant.AddRigidBody(bone.name, self._tree.SpatialInertia(
            bone.mass, np.zeros(3), inertia))
        shape = {'box': lambda: self._geometry.Box(*bone.shape.size),
                 'sphere': lambda: self._geometry.Sphere(bone.shape.radius)}.get(bone.shape.kind)
        if shape is None:
            raise errors.OutOfRange('shape', bone.shape.kind, 'box or sphere for Drake')
        self._add_shape(body, self._math.RigidTransform(), shape(), bone)
        self._bodies[bone.name] = body

    def _add_child(self, joint: Joint) -> None:
        """Add the child of a joint; a universal joint is two hinges and a massless body."""
        if joint.kind not in ('hinge', 'universal'):
            raise errors.OutOfRange('kind', joint.kind, 'hinge or universal for Drake')
        doll = self._scene.dolls[0].doll
        parent, child = doll.bone(joint.parent), doll.bone(joint.child)
        self._add_bone(child)
        seat = Pose(np.array(joint.anchor), np.array(rotation.IDENTITY))
        frame = self._frame(self._bodies[parent.name], parent.pose.relative(seat))
        ends = [self._plant.AddRigidBody(f'{name}/link').body_frame()
                for name in joint.angle_names[:-1]]
        ends.append(self._frame(self._bodies[child.name], child.pose.relative(seat)))
        for name, axis, limits, end in zip(joint.angle_names, joint.axes, joint.angle_limits, ends,
                                           strict=True):
            hinge = self._plant.AddJoint(self._tree.RevoluteJoint(
                name, frame, end, axis, joint.damping))
            if limits:
                hinge.set_position_limits([limits[0]], [limits[1]])
            self._joints.append(hinge)
            frame = end

    def _frame(self, body: object, pose: Pose) -> object:
        return self._plant.AddFrame(self._tree.FixedOffsetFrame(
            f'frame {self._plant.num_frames()}', body.body_frame(), self._transform(pose)))

    def _add_ground(self, scene: Scene) -> None:
        normal = np.array(scene.ground.normal)
        turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), normal)
        self._add_shape(self._plant.world_body(), self._transform(
            Pose(scene.ground.offset * normal, turn)), self._geometry.HalfSpace(), None)

    def _add_shape(self, body: object, pose: object, shape: object, bone: Bone | None) -> None:
        """Add a shape; Drake takes the harmonic mean of both frictions."""
        friction, _, _ = self._scene.material.on(bone)
        self._plant.RegisterCollisionGeometry(
            body, pose, shape, bone.name if bone else 'ground',
            self._plants.CoulombFriction(friction, friction))

    def _filter_collisions(self, scene: Scene) -> None:
        """Disable collision between all bones, or with self-collision between excluded
        pairs alone.
        """
        pairs = (scene.dolls[0].doll.excluded_pairs if scene.self_collision
                 else [tuple(self._bodies)])
        for names in pairs:
            sets = self._geometry.GeometrySet([
                geometry for name in names
                for geometry in self._plant.GetCollisionGeometriesForBody(self._bodies[name])])
            self._shapes.collision_filter_manager().Apply(
                self._geometry.CollisionFilterDeclaration().ExcludeWithin(sets))

    def _place(self, root: Bone, start: GeneralizedState) -> None:
        from pydrake.multibody.math import SpatialVelocity
        q, v = start.q, start.v
        body = self._bodies[root.name]
        self._plant.SetFreeBodyPose(self._context, body, self._transform(Pose(q[:3], q[3:7])))
        self._plant.SetFreeBodySpatialVelocity(self._context, body, SpatialVelocity(v[3:6], v[:3]))
        for joint, angle, rate in zip(self._joints, q[7:], v[6:], strict=True):
            joint.set_angle(self._context, angle)
            joint.set_angular_rate(self._context, rate)

    def _transform(self, pose: Pose) -> object:
        matrix = self._math.RotationMatrix(rotation.matrix(pose.orientation))
        return self._math.RigidTransform(matrix, pose.position)

"""The message templates of a scene, each created when it first has a subscriber."""
from __future__ import annotations

from functools import cached_property, partial

from ...model.scene import Scene
from .convert import count_masses, to_joint_state, to_multi_dof, to_pose_array
from .markers import SceneMarkers
from .serialized import SerializedTemplate

trace = SerializedTemplate.trace


class SceneTemplates:
    """Templates for a scene of n bones and m swinging masses; ``frame`` names the world frame."""

    def __init__(self, scene: Scene, frame: str) -> None:
        self._scene, self._frame = scene, frame

    def make_as(self, others: SceneTemplates) -> None:
        """Make those templates that ``others`` has: they will be asked for."""
        for name in vars(others).copy().keys() - vars(self).keys():
            getattr(self, name)

    @cached_property
    def poses(self) -> SerializedTemplate:
        """PoseArray of the bones' poses (n, 7)."""
        return trace(partial(to_pose_array, self._frame), (len(self._scene.bones), 7))

    @cached_property
    def state(self) -> SerializedTemplate:
        """MultiDOFJointState of poses (n, 7) and twists (n, 6)."""
        bones = len(self._scene.bones)
        return trace(partial(to_multi_dof, self._frame, self._scene.bone_names),
                     (bones, 7), (bones, 6))

    @cached_property
    def joints(self) -> SerializedTemplate:
        """JointState of all joint angles (k,) rad and their rates (k,) rad/s."""
        names = self._scene.angle_names
        return trace(partial(to_joint_state, self._frame, names), (len(names),), (len(names),))

    @cached_property
    def swings(self) -> SerializedTemplate:
        """PoseArray of the masses' poses (m, 7)."""
        return trace(partial(to_pose_array, self._frame), (count_masses(self._scene), 7))

    @cached_property
    def markers(self) -> SceneMarkers:
        """MarkerArray of bones, swings and pushes."""
        return SceneMarkers(self._scene, self._frame)

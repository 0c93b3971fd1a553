"""The scene of a node: loaded here if it is the same, else reconstructed from its URDF."""
from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from rcl_interfaces.msg import ParameterEvent
from std_msgs.msg import String

from ....files.scene import load_scene
from ....files.urdf import scene_to_urdf
from ....fit.robots.robot import doll_from_urdf
from ....model import errors
from ....model.ragdoll import WORLD
from ....model.scene import Ground, Placement, Scene
from ....ros.inputs.no_world import NO_WORLD
from ....ros.messages.measures import checksum
from ....ros.parameters.node_settings import BONE_NAMES, SPECS, NodeSettings
from .services import NodeServices

FROM_URDF = ('The shapes are those of `robot_description`, because the scene `{}` is missing or '
             'different here; the ground is assumed, and swings and skins are unknown.')


def scene_of_node(name: str, names: Sequence[str], description: str,
                  frame: str = WORLD) -> tuple[Scene, str]:
    """The scene of a node, and a note on it, which may be empty.

    ``name`` is the node's parameter `scene`, ``names`` its `bone_names`, ``description`` the URDF
    that it publishes, ``frame`` its `frame_id`. A scene loaded here is the node's if it gives an
    identical URDF. Raises RagdollError if neither that nor the URDF has the bone names.
    """
    try:
        scene = load_scene(name)
    except errors.RagdollError:
        scene = None
    if (scene is not None and scene.bone_names == tuple(names)
            and scene_to_urdf(scene, frame) == description):
        return scene, ''
    # Bone names of a doll have no slash; those of a scene with several dolls do.
    scene_names = {name.replace('/', '_'): name for name in names}
    doll = dataclasses.replace(doll_from_urdf(description), riders=())
    doll = doll.renamed(lambda bone: scene_names.get(bone, bone))
    doll = dataclasses.replace(doll, bones=tuple(doll.bone(bone) for bone in names))
    return Scene(name, (Placement(doll),), Ground()), FROM_URDF.format(name)


class NodeScene:
    """The scene and parameters of a node, requested until they are known and when they change.

    ``node`` is its fully qualified name; ``on_known`` is called after each consistent answer.
    """

    def __init__(self, services: NodeServices, node: str, on_known: Callable[[], None]) -> None:
        self.scene: Scene | None = None
        self.settings = NodeSettings()
        self.note = self.problem = ''
        self._services, self._node, self._on_known = services, node, on_known
        self._description: str | None = None
        self._is_known = False

    def forget_description(self) -> None:
        """Wait for another URDF before requesting anything."""
        self._description, self._is_known = None, False

    @property
    def urdf(self) -> str:
        """Checksum of the URDF that the node published last."""
        return checksum(self._description or '')

    def take_description(self, message: String) -> None:
        """Callback of `robot_description`."""
        self._description, self._is_known = message.data, False
        self.request()

    def take_event(self, message: ParameterEvent) -> None:
        """Callback of `/parameter_events`: request again when the node's parameters change."""
        if message.node == self._node:
            self._is_known = False
            self.request()

    def request(self) -> None:
        """Request the node's parameters unless they are known; call repeatedly."""
        if self._description is not None and not self._is_known:
            self._services.get_parameters((BONE_NAMES, *SPECS), self._take_parameters)

    def _take_parameters(self, values: dict) -> None:
        """Set the node's parameters, and its scene if that is another one."""
        names = values.pop(BONE_NAMES)
        if self._description is None or names is None or None in values.values():
            return
        self.settings = NodeSettings(**values)
        if not self._description:
            self.problem = NO_WORLD
            return
        try:
            scene, self.note = scene_of_node(self.settings.scene, names, self._description,
                                             self.settings.frame_id)
        except errors.RagdollError as error:
            # During a change of scene, names and URDF may be of different ones.
            self.problem = f'the scene of the node is unknown: {error}'
            return
        self.scene, self.problem, self._is_known = scene, '', True
        self._on_known()

"""The scene of a node: its text on ~/scene, else reconstructed from its URDF."""
from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from rcl_interfaces.msg import ParameterEvent
from std_msgs.msg import String

from ....files.run_scene import read_run_scene
from ....fit.robots.robot import doll_from_urdf
from ....model import errors
from ....model.scene import Ground, Placement, Scene
from ....ros.inputs.no_world import NO_WORLD
from ....ros.messages.measures import checksum
from ....ros.parameters.node_settings import BONE_NAMES, SPECS, NodeSettings
from .services import NodeServices

FROM_URDF = ('The shapes are those of `robot_description`, because the scene `{}` can not be read '
             'here; the ground is assumed, and swings and skins are unknown. {}')


def scene_of_node(name: str, text: str, names: Sequence[str],
                  description: str) -> tuple[Scene, str]:
    """The scene of a node, and a note on it, which may be empty.

    ``name`` is the node's parameter `scene`, ``text`` what it publishes on ~/scene, ``names`` its
    `bone_names`, ``description`` its URDF, which is used if the text names files that are not on
    this machine. Raises RagdollError if the URDF lacks such a bone.
    """
    try:
        return read_run_scene(text)[0], ''
    except errors.RagdollError as error:
        note = FROM_URDF.format(name, error)
    # Bone names of a doll have no slash; those of a scene with several dolls do.
    scene_names = {name.replace('/', '_'): name for name in names}
    doll = dataclasses.replace(doll_from_urdf(description), riders=())
    doll = doll.renamed(lambda bone: scene_names.get(bone, bone))
    doll = dataclasses.replace(doll, bones=tuple(doll.bone(bone) for bone in names))
    return Scene(name, (Placement(doll),), Ground()), note


class NodeScene:
    """The scene and parameters of a node, the latter requested until they are known and when they
    change.

    ``node`` is its fully qualified name; ``on_known`` is called after each consistent answer.
    """

    def __init__(self, services: NodeServices, node: str, on_known: Callable[[], None]) -> None:
        self.scene: Scene | None = None
        self.settings = NodeSettings()
        self.checksum = ''
        """Of the text of the scene."""
        self.note = self.problem = ''
        self._services, self._node, self._on_known = services, node, on_known
        self.forget()

    def forget(self) -> None:
        """Wait for another text before requesting anything."""
        self._text: str | None = None
        self._description = ''
        self._names: Sequence[str] | None = None
        """Of the bones, when the parameters were read last."""
        self._is_known = False

    def take_text(self, message: String) -> None:
        """Callback of `~/scene`."""
        self._text, self._is_known = message.data, False
        self._use()
        self.request()

    def take_description(self, message: String) -> None:
        """Callback of `robot_description`."""
        self._description = message.data
        self._use()

    def take_event(self, message: ParameterEvent) -> None:
        """Callback of `/parameter_events`: request again when the node's parameters change."""
        if message.node == self._node:
            self._is_known = False
            self.request()

    def request(self) -> None:
        """Request the node's parameters unless they are known; call repeatedly."""
        if self._text is not None and not self._is_known:
            self._services.get_parameters((BONE_NAMES, *SPECS), self._take_parameters)

    def _take_parameters(self, values: dict) -> None:
        """Set the node's parameters."""
        names = values.pop(BONE_NAMES)
        if names is None or None in values.values():
            return
        self._names, self.settings, self._is_known = names, NodeSettings(**values), True
        self._use()

    def _use(self) -> None:
        """Use scene and parameters once both are known; set ``problem`` if they do not match."""
        if self._text is None or self._names is None:
            return
        if not self._text:
            self.problem = NO_WORLD
            return
        known = checksum(self._text)
        if known != self.checksum or self.note or self.problem:
            try:
                self.scene, self.note = scene_of_node(
                    self.settings.scene, self._text, self._names, self._description)
            except errors.RagdollError as error:
                # During a change of scene, names and URDF may be of different ones.
                self._is_known = False
                self.problem = f'the scene of the node is unknown: {error}'
                return
        self.checksum, self.problem = known, ''
        self._on_known()

"""What a node simulates, as seen from outside: its scene, if it can be read here, else its URDF."""
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
from ....ros.parameters.node_settings import BONE_NAMES, SPECS, NodeSettings
from .services import Ask

GUESSED = ('The shapes are those of `robot_description`, as the scene `{}` is not here or another '
           'one; the ground is a guess, and swings and skins are not known.')


def scene_of_node(name: str, names: Sequence[str], description: str,
                  frame: str = WORLD) -> tuple[Scene, str]:
    """The scene of a node, and what should be known of it, '' if nothing.

    ``name`` is the node's parameter `scene`, ``names`` its `bone_names`, ``description`` the URDF
    that it publishes, ``frame`` its `frame_id`. A scene that is loaded here is the node's if it
    gives the same URDF, word by word. Raises a RagdollError if nothing fits the names.
    """
    try:
        scene = load_scene(name)
    except errors.RagdollError:
        scene = None
    if (scene is not None and scene.bone_names == tuple(names)
            and scene_to_urdf(scene, frame) == description):
        return scene, ''
    # A doll's bones have no slash in their names; those of a scene with several dolls do.
    named = {name.replace('/', '_'): name for name in names}
    doll = dataclasses.replace(doll_from_urdf(description), riders=())
    doll = doll.renamed(lambda bone: named.get(bone, bone))
    doll = dataclasses.replace(doll, bones=tuple(doll.bone(bone) for bone in names))
    return Scene(name, (Placement(doll),), Ground()), GUESSED.format(name)


class RemoteScene:
    """The node's scene and parameters: asked for until they are known, and when they change.

    ``node`` is its name with its namespace; ``learned`` is called with each answer that is clear.
    """

    def __init__(self, ask: Ask, node: str, learned: Callable[[], None]) -> None:
        self.scene: Scene | None = None
        self.settings = NodeSettings()
        self.note = self.problem = ''
        self._ask, self._node, self._learned = ask, node, learned
        self._description: str | None = None
        self._is_known = False

    def forget_description(self) -> None:
        """Wait for another URDF before anything is asked."""
        self._description, self._is_known = None, False

    def take_description(self, message: String) -> None:
        """Take the URDF that the node publishes."""
        self._description, self._is_known = message.data, False
        self.ask()

    def take_event(self, message: ParameterEvent) -> None:
        """Learn anew when the node's parameters change."""
        if message.node == self._node:
            self._is_known = False
            self.ask()

    def ask(self) -> None:
        """Ask what the node simulates unless it is known; to be called again and again."""
        if self._description is not None and not self._is_known:
            self._ask.parameters((BONE_NAMES, *SPECS), self._take)

    def _take(self, values: dict) -> None:
        """Take the node's parameters, and its scene if that is another one."""
        names = values.pop(BONE_NAMES)
        if self._description is None or names is None or None in values.values():
            return
        self.settings = NodeSettings(**values)
        try:
            scene, self.note = scene_of_node(self.settings.scene, names, self._description,
                                             self.settings.frame_id)
        except errors.RagdollError as error:
            # Between two scenes the names are those of one and the URDF that of the other.
            self.problem = f'what the node simulates is not clear: {error}'
            return
        self.scene, self.problem, self._is_known = scene, '', True
        self._learned()

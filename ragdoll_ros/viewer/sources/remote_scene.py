"""What a node simulates, as seen from outside: its scene, if it can be read here, else its URDF."""
from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ...files.scene import load_scene
from ...files.urdf import scene_to_urdf
from ...fit.robot import doll_from_urdf
from ...model import errors
from ...model.ragdoll import WORLD
from ...model.scene import Ground, Placement, Scene

GUESSED = ('The shapes are those of `robot_description`, as the scene `{}` is not here or another '
           'one; the ground is a guess, and swings and skins are not known.')


def scene_of_node(name: str, names: Sequence[str], description: str,
                  frame: str = WORLD) -> tuple[Scene, str]:
    """Give the scene of a node and what should be known of it, '' if nothing.

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

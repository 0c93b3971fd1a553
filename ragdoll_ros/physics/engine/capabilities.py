"""Optional features of engines; an engine lists those that it has as ``capabilities``."""
from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from ...model import errors


class Capability(Enum):
    """Optional feature of an engine. Its value follows 'rigid, which' in the message of
    require().
    """

    JOINT_SPRINGS = 'has joint springs'
    PASSIVE_TORQUES = 'has passive joint torques'
    DRIVEN_BODIES = 'moves bodies with follow'
    FIXED_ROOTS = 'holds roots that are fixed'
    SURFACES = 'has meshes and height fields'
    SCENE_CHANGES = 'adds and removes dolls while it runs'
    OVERLAPS = 'finds overlaps'
    CONTACT_IMPULSES = 'counts impulses'
    IMPACTS = 'finds times of impact'
    COPIES = 'simulates copies of dolls'


def require(capability: Capability, among: Collection[Capability], name: str) -> None:
    """Raise WrongForm if ``capability`` is not ``among`` those of the engine ``name``."""
    if capability not in among:
        raise errors.WrongForm('engine', name, f'rigid, which {capability.value}')

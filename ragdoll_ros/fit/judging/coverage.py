"""How much of its skin each body holds, how much of all bodies is skin, and what that weighs."""
from __future__ import annotations

from ...model.ragdoll import Ragdoll
from ..bodies.overlap import covered, depth_in
from ..reading.character import Character
from ..shapes.shapes import TOLERANCE
from .finding import Finding

LITTLE, TOO_LITTLE = 0.75, 0.5
"""Share of its vertices that a body should hold, and without which it is not theirs."""

FEWEST = 12
"""Vertices of a body whose share says something."""

BLOATED, SWOLLEN = 2.5, 5.0
"""Volume of all bodies over the skin's that is doubtful, or wrong."""

LIGHTEST, HEAVIEST = 300.0, 2500.0
"""kg/m^3 of the whole; a skin that is open tells too little volume, so a share of the bodies'
counts as skin."""


def find_uncovered(doll: Ragdoll, character: Character,
                   parts: dict[str, tuple[str, ...]]) -> list[Finding]:
    """Bodies that miss their skin; ``parts`` has the character's bones of each body."""
    body_of = {bone: name for name, bones in parts.items() for bone in bones}
    owners = [body_of.get(name) for name in character.bone_names]
    heaviest = character.weights.argmax(axis=1)
    moved = character.bones[range(len(heaviest)), heaviest]
    weighted = character.weights.any(axis=1)
    tolerance = max(TOLERANCE, 0.02 * character.extent)
    found = []
    for bone in doll.bones:
        own = [index for index, owner in enumerate(owners) if owner == bone.name]
        points = character.vertices[weighted & (moved[:, None] == own).any(axis=1)]
        if len(points) < FEWEST:
            continue
        share = float((depth_in(bone, points) >= -tolerance).mean())
        if share < LITTLE:
            found.append(Finding(f'{bone.name} holds {100 * share:.0f} % of its skin',
                                 share < TOO_LITTLE))
    whole = float(covered(doll.bones, character.vertices, tolerance).mean())
    if whole < 0.9:
        found.append(Finding(f'the bodies hold {100 * whole:.0f} % of the skin',
                             whole < LITTLE))
    skin, volume = character.volume(), sum(bone.shape.volume for bone in doll.bones)
    density = doll.mass / max(skin, volume / BLOATED)
    if not LIGHTEST < density < HEAVIEST:
        found.append(Finding(f'{doll.mass:.3g} kg in a skin of {1000 * skin:.3g} l: '
                             f'{density:.0f} kg/m^3, where animals have 1000 (--mass)'))
    if skin > 0 and volume > BLOATED * skin:
        found.append(Finding(f'the bodies have {volume / skin:.2g} times the volume of the skin',
                             volume > SWOLLEN * skin))
    return found

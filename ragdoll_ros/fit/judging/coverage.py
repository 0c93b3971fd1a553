"""Coverage of the skin by the bodies, their volume, and the density of the doll."""
from ...model.ragdoll import Ragdoll
from ..bodies.overlap import covered, penetration_depth
from ..reading.character import Character
from ..shapes.fitting import TOLERANCE
from .finding import Finding

DOUBTFUL_COVERAGE, WRONG_COVERAGE = 0.75, 0.5
"""Fraction of a body's vertices inside it, below which it is doubtful, wrong."""

MIN_VERTICES = 12
"""Vertices of a body from which on its coverage is checked."""

DOUBTFUL_VOLUME, WRONG_VOLUME = 2.5, 5.0
"""Volume of the bodies over that of the skin, above which it is doubtful, wrong."""

MIN_DENSITY, MAX_DENSITY = 300.0, 2500.0
"""kg/m^3 of the doll. An open skin encloses too little volume, so at least a fraction of the
bodies' volume counts as the skin's."""


def find_uncovered(doll: Ragdoll, character: Character,
                   parts: dict[str, tuple[str, ...]]) -> list[Finding]:
    """Findings on the coverage of the skin by the bodies, their volume, and the doll's density.

    ``parts`` lists the character's bones of each body. Skin that swings move, such as hair, does
    not count for coverage.
    """
    hair = {rider for swing in doll.swings for link in swing.links for rider in link.riders}
    body_of = {bone: name for name, bones in parts.items() for bone in bones if bone not in hair}
    owners = [body_of.get(name) for name in character.bone_names]
    heaviest = character.weights.argmax(axis=1)
    moved = character.bones[range(len(heaviest)), heaviest]
    weighted = character.weights.any(axis=1)
    tolerance = max(TOLERANCE, 0.02 * character.extent)
    found = []
    for bone in doll.bones:
        own = [index for index, owner in enumerate(owners) if owner == bone.name]
        points = character.vertices[weighted & (moved[:, None] == own).any(axis=1)]
        if len(points) < MIN_VERTICES:
            continue
        share = float((penetration_depth(bone, points) >= -tolerance).mean())
        if share < DOUBTFUL_COVERAGE:
            found.append(Finding(f'{bone.name} covers {100 * share:.0f} % of its skin',
                                 share < WRONG_COVERAGE))
    swung = [index for index, name in enumerate(character.bone_names) if name in hair]
    rigid = character.vertices[~(moved[:, None] == swung).any(axis=1)]
    whole = float(covered(doll.bones, rigid, tolerance).mean())
    if whole < 0.9:
        found.append(Finding(f'the bodies cover {100 * whole:.0f} % of the skin',
                             whole < DOUBTFUL_COVERAGE))
    skin, volume = character.volume(), sum(bone.shape.volume for bone in doll.bones)
    density = doll.mass / max(skin, volume / DOUBTFUL_VOLUME)
    if not MIN_DENSITY < density < MAX_DENSITY:
        found.append(Finding(f'{doll.mass:.3g} kg in a skin of {1000 * skin:.3g} l: '
                             f'{density:.0f} kg/m^3, where animals have 1000 (set --mass)'))
    if skin > 0 and volume > DOUBTFUL_VOLUME * skin:
        found.append(Finding(f'the bodies have {volume / skin:.2g} times the volume of the skin',
                             volume > WRONG_VOLUME * skin))
    return found

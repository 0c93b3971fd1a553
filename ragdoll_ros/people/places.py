"""Landmarks of a standing person: heights from segment lengths, breadths from girths."""
import math
from dataclasses import dataclass

from ..model.anthropometry import ANKLE_HEIGHT, BODY, HEIGHT, MASS, SAMPLES, UNPAIRED

SIDES = {'left': 1.0, 'right': -1.0}
"""Sides and the sign of their y, which is to the left."""

LIMBS = ('upper_arm', 'forearm', 'hand', 'thigh', 'shin', 'foot')

HEEL = 0.25
"""Distance of the heel behind the ankle over the foot's length; estimated."""


@dataclass(frozen=True)
class Places:
    """Landmarks of one person, m: x forwards, z up from the sole."""

    height: float
    tall: float
    """Height over that of ANSUR II's mean person: scale of bones."""
    wide: float
    """Scale of girths: root of mass over height, as volume is girth^2 times length."""
    lengths: dict[str, float]
    """By segment."""
    neck: float
    ankle: float
    hip: float
    waist: float
    xiphoid: float
    sternum: float
    """Heights of ankle, hip, waist and chest joint, and of the top of the sternum."""
    hip_y: float
    shoulder_y: float

    @property
    def segments(self) -> list[tuple[str, str]]:
        """Name of each bone and its segment in the table, from the root outwards."""
        return [(name, name) for name in reversed(UNPAIRED)] + [
            (f'{side}_{limb}', limb) for side in SIDES for limb in LIMBS]

    def proximal(self, bone: str) -> tuple[float, float, float]:
        """Proximal end of a bone, from which its centre is measured; for a foot, whose centre is
        measured from the heel, the ankle.
        """
        side, _, limb = bone.partition('_')
        length = self.lengths
        if bone in UNPAIRED:
            tops = {'head': self.height, 'chest': self.sternum, 'abdomen': self.xiphoid,
                    'pelvis': self.waist}
            return (0.0, 0.0, tops[bone])
        down = {'upper_arm': 0.0, 'forearm': length['upper_arm'],
                'hand': length['upper_arm'] + length['forearm']}
        if limb in down:
            return (0.0, SIDES[side] * self.shoulder_y, self.sternum - down[limb])
        heights = {'thigh': self.hip, 'shin': self.hip - length['thigh'], 'foot': self.ankle}
        return (0.0, SIDES[side] * self.hip_y, heights[limb])


def radius(circumference: float, scale: float) -> float:
    """Radius, m, of a circle of a circumference in mm, scaled."""
    return circumference / 1000 / (2 * math.pi) * scale


def places(height: float, mass: float, sex: str) -> Places:
    """Landmarks of a person of ``height`` m and ``mass`` kg.

    The neck, from the mid-gonion to the sternum, is the height minus all other lengths. Shoulders
    are at the height of the sternum, an arm's radius beside the chest; thighs fill the hip breadth.
    """
    sample = SAMPLES[sex]
    lengths = {name: part.length / sample.height * height for name, part in sample.segments.items()}
    wide = math.sqrt((mass / height) / (MASS / HEIGHT))
    ankle = ANKLE_HEIGHT * height
    hip = ankle + lengths['shin'] + lengths['thigh']
    waist = hip + lengths['pelvis']
    xiphoid = waist + lengths['abdomen']
    sternum = xiphoid + lengths['chest']
    thigh = radius((BODY.thigh + BODY.lower_thigh) / 2, wide)
    chest, _ = trunk_sides('chest', wide)
    return Places(height, height / HEIGHT, wide, lengths, height - lengths['head'] - sternum, ankle,
                  hip, waist, xiphoid, sternum, hip_y=BODY.hip_breadth / 2000 * wide - thigh,
                  shoulder_y=chest / 2 + radius(BODY.biceps, wide))


def trunk_sides(part: str, wide: float) -> tuple[float, float]:
    """Breadth and depth, m, of a box with the circumference and aspect of a part of the trunk."""
    around, breadth, depth = {
        'chest': (BODY.chest, BODY.chest_breadth, BODY.chest_depth),
        'abdomen': (BODY.waist, BODY.waist_breadth, BODY.waist_depth),
        'pelvis': (BODY.buttock, BODY.hip_breadth, BODY.buttock_depth)}[part]
    scale = around / (2 * (breadth + depth)) / 1000 * wide
    return breadth * scale, depth * scale

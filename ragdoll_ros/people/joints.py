"""Joints of a person: axes, ranges, damping, and names after REP 155.

Angles are those of the child relative to its parent, right-handed: pitch about y (left), roll about
x (forwards), yaw about z (up) for trunk and head, about the length (down) for limbs. Flexion is
negative at hips and elbows, positive at knees and neck.

Ranges are the norms of the American Academy of Orthopaedic Surgeons (Joint Motion: Method of
Measuring and Recording, 1965). Half of the trunk's range is at the waist, half at the chest.
Abduction of an arm ends at 85 degrees, the limit of ball joints here; the arm goes higher by its
pitch. Within the range there is only damping, and passive torques on request.
"""
import math

from ..model.anthropometry import MEN
from ..model.ragdoll import Joint, Limits
from .passive import with_passive_torques
from .places import SIDES, Places

DAMPING = 0.1
"""N m s/rad on each axis of a man of the table: Falisse et al. 2019 (J R Soc Interface
16:20190402). It scales with mass times height squared, as the torques do."""

MEAN_MASS = 73.0
"""kg, of the man of that table."""

FORWARDS, LEFT, UP, DOWN = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)


def joints(at: Places, height: float, mass: float, passive: bool = False) -> tuple[Joint, ...]:
    """All 15 joints of a person with the landmarks ``at``; ``passive``: with the torques of tissue
    where these are known, see passive.py.
    """
    damping = DAMPING * (mass / MEAN_MASS) * (height / MEN.height) ** 2

    def spine(parent: str, child: str, z: float, names: tuple[str, str, str],
              roll: float, pitch: Limits, yaw: float) -> Joint:
        ranges = (-roll, roll), pitch, (-yaw, yaw)
        return Joint(parent, child, 'ball', (0, 0, z), (UP, FORWARDS), _radians(ranges), damping,
                     names)

    found = [
        spine('pelvis', 'abdomen', at.waist, ('r_waist', 'waist', 'y_waist'),
              17.5, (-12.5, 40), 22.5),
        spine('abdomen', 'chest', at.xiphoid, ('r_chest', 'p_chest', 'y_chest'),
              17.5, (-12.5, 40), 22.5),
        spine('chest', 'head', at.sternum, ('r_head', 'p_head', 'y_head'), 45, (-45, 45), 60)]
    for side, left in SIDES.items():
        found += _arm(side, left, at, damping) + _leg(side, left, at, damping)
    if passive:
        found = [with_passive_torques(joint, damping / DAMPING) for joint in found]
    return tuple(found)


def _arm(side: str, left: float, at: Places, damping: float) -> list[Joint]:
    upper, fore, hand = (f'{side}_{name}' for name in ('upper_arm', 'forearm', 'hand'))
    s = side[0]
    return [
        _limb('chest', upper, at, 'shoulder', damping,
              ((-180, 60), _mirrored(-20, 85, left), _mirrored(-70, 90, left))),
        Joint(upper, fore, 'hinge', at.proximal(fore), (LEFT,), _radians(((-150, 0),)), damping,
              (f'{s}_elbow',)),
        _limb(fore, hand, at, 'wrist', damping, ((-80, 70), _mirrored(-30, 20, left), (-80, 80)))]


def _leg(side: str, left: float, at: Places, damping: float) -> list[Joint]:
    thigh, shin, foot = (f'{side}_{name}' for name in ('thigh', 'shin', 'foot'))
    s = side[0]
    return [
        _limb('pelvis', thigh, at, 'hip', damping,
              ((-120, 30), _mirrored(-30, 45, left), (-45, 45))),
        Joint(thigh, shin, 'hinge', at.proximal(shin), (LEFT,), _radians(((0, 135),)), damping,
              (f'{s}_knee',)),
        Joint(shin, foot, 'universal', at.proximal(foot), (LEFT, FORWARDS),
              _radians(((-20, 50), _mirrored(-35, 15, left))), damping,
              (f'{s}_p_ankle', f'{s}_r_ankle'))]


def _limb(parent: str, child: str, at: Places, joint: str, damping: float,
          ranges: tuple[Limits, Limits, Limits]) -> Joint:
    """A ball joint of a hanging limb: pitch first, so that it may go beyond 85 degrees."""
    names = tuple(f'{child[0]}_{axis}_{joint}' for axis in 'pry')
    return Joint(parent, child, 'ball', at.proximal(child), (DOWN, LEFT), _radians(ranges), damping,
                 names)


def _mirrored(lower: float, upper: float, left: float) -> Limits:
    """The range of the left side, mirrored for the right side."""
    return (lower, upper) if left > 0 else (-upper, -lower)


def _radians(ranges: tuple[Limits, ...]) -> tuple[Limits, ...]:
    return tuple((math.radians(lower), math.radians(upper)) for lower, upper in ranges)

"""Plausibility of a well-formed doll: size, densities, bend directions, masses of a person."""
import math
from collections.abc import Sequence

import numpy as np

from ...files.bone_names.names import doll_roles
from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_axes
from ..reading.scale import MAX_EXTENT, MIN_EXTENT
from ..roles.person import SEGMENTS, is_person, segment
from .finding import Finding

ANIMAL_DENSITY, ROBOT_DENSITY = 3000.0, 8000.0
"""kg/m^3; limits for animals (bone has 1 900, stone 2 700) and for robots."""

IMPOSSIBLE_DENSITY = 25_000.0
"""kg/m^3; osmium, the densest element, has 22 600."""

BEND_DIRECTIONS = {'shin': (-1, 'a knee that bends forwards'),
                   'forearm': (1, 'an elbow that bends backwards'),
                   'thigh': (1, 'a hip that lifts the knee backwards')}
"""By role: sign of the child's motion along x about the first axis, and the fault if it differs."""

MIN_BIND_BEND, MAX_OVEREXTENSION = math.radians(35), math.radians(20)
"""Bend in the bind pose that shows the fold direction (paws are bound hyperextended); rotation
past straight that is doubtful, and wrong beyond twice that."""

LEG_FOLDS = {'shin': 1, 'forearm': 1, 'foot': 2, 'hand': 2}
"""Order of a bone's joint in an animal's leg; that of the hip is 0."""

HIP_ROLES = ('thigh', 'upper_arm')

FOLDING_JOINTS = {(True, 1): 'an elbow', (True, 2): 'a wrist', (False, 1): 'a knee',
                  (False, 2): 'a hock'}
"""Names of the joints of front (True) and hind legs, by their order."""

MIN_LEG_DISTANCE = 0.2
"""Smallest distance between front and hind legs, as a fraction of the doll's size."""

MIN_BMI, MAX_BMI = 10.0, 45.0
"""kg/m^2, mass over height squared: from infants and underweight to severe obesity."""

DOUBTFUL_FACTOR, WRONG_FACTOR = 2.2, 6.0
"""Factor off a man's share of the mass that is doubtful, wrong. The heads of children reach 2."""


def find_implausible(doll: Ragdoll, measured: bool = False) -> list[Finding]:
    """Findings on the size, the densities and the bend directions.

    A ``measured`` doll is a robot's: it may be of steel, and its joints may bend either way.
    """
    if measured:
        return [*_check_extent(doll), *_find_dense(doll, ROBOT_DENSITY, math.inf)]
    return [*_check_extent(doll), *_find_dense(doll, ANIMAL_DENSITY, IMPOSSIBLE_DENSITY),
            *_find_wrong_bends(doll)]


def find_implausible_masses(doll: Ragdoll, roles: Sequence[str | None],
                            height: float) -> list[Finding]:
    """Body mass index and segment masses that no person has; ``height`` is the doll's, m."""
    index = doll.mass / height ** 2
    found = []
    if not MIN_BMI < index < MAX_BMI:
        found.append(Finding(f'a person of {height:.3g} m that weighs {doll.mass:.3g} kg: '
                             f'{index:.0f} kg/m^2, where people have {MIN_BMI:.0f} to '
                             f'{MAX_BMI:.0f} (set --mass)', not MIN_BMI / 4 < index < MAX_BMI * 4))
    masses: dict[tuple[str, int], float] = {}
    for bone, role in zip(doll.bones, roles, strict=True):
        part = segment(role, bone.name)
        masses[part] = masses.get(part, 0.0) + bone.mass
    for (part, side), mass in masses.items():
        share, usual = 100 * mass / doll.mass, SEGMENTS[part]
        off = max(share / usual, usual / share)
        # A hand or a foot may be a stump, or part of the segment above.
        if off > DOUBTFUL_FACTOR * (2 if part in ('hand', 'foot') else 1):
            name = {1: 'left ', -1: 'right ', 0: ''}[side] + part.replace('_', ' ')
            found.append(Finding(f"the {name} has {share:.2g} % of the mass, where a person's has "
                                 f'{usual:g} % (--masses proportions)', off > WRONG_FACTOR))
    return found


def extent(doll: Ragdoll) -> float:
    """Longest edge of the doll's bounding box in the bind pose, m."""
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    reaches = [directions @ np.array(bone.position) + bone.shape.support(rotation.rotate(
        rotation.inverse(np.array(bone.orientation)), directions)) for bone in doll.bones]
    furthest = np.max(reaches, axis=0)
    return float((furthest[:3] + furthest[3:]).max())


def _check_extent(doll: Ragdoll) -> list[Finding]:
    size = extent(doll)
    if size > MAX_EXTENT:
        unit = 'centimetres' if size < 1000 else 'millimetres'
        return [Finding(f'a doll {size:.4g} m long: its unit may be {unit}')]
    if size < MIN_EXTENT:
        return [Finding(f'a doll {size:.4g} m long: its scale may have been applied twice')]
    return []


def _find_dense(doll: Ragdoll, most: float, impossible: float) -> list[Finding]:
    densities = {bone.name: bone.mass / bone.shape.volume for bone in doll.bones}
    return [Finding(f'{name}: a density of {density:.0f} kg/m^3, over {most:.0f}',
                    density > impossible)
            for name, density in densities.items() if density > most]


def _find_wrong_bends(doll: Ragdoll) -> list[Finding]:
    roles = doll_roles(doll)
    if not is_person(roles, np.array([bone.position for bone in doll.bones])):
        return [*_find_overextension(doll), *_find_wrong_legs(doll, roles)]
    role_of = dict(zip((bone.name for bone in doll.bones), roles, strict=True))
    found = []
    for joint in doll.joints:
        role = role_of[joint.child]
        if role in BEND_DIRECTIONS and joint.kind in ('hinge', 'universal', 'ball'):
            sign, problem = BEND_DIRECTIONS[role]
            if sign * _forward_motion(doll, joint) < -0.05:
                found.append(_joint_finding(joint, problem, True))
    return found


def _find_overextension(doll: Ragdoll) -> list[Finding]:
    """Hinges bent in the bind pose whose range extends far past the straight limb."""
    anchors = {joint.child: np.array(joint.anchor) for joint in doll.joints}
    found = []
    for joint in doll.joints:
        if joint.kind != 'hinge' or joint.parent not in anchors or joint.limits[0] is None:
            continue
        below = [anchors[each.child] for each in doll.joints if each.parent == joint.child]
        end = np.mean(below, axis=0) if below else np.array(doll.bone(joint.child).position)
        above, along = anchors[joint.child] - anchors[joint.parent], end - joint.anchor
        bend = math.atan2(float(np.cross(above, along) @ joint.axes[0]), float(above @ along))
        low, high = joint.limits[0] if bend > 0 else (-joint.limits[0][1], -joint.limits[0][0])
        overextension = -low - abs(bend)
        if abs(bend) > MIN_BIND_BEND and overextension > MAX_OVEREXTENSION:
            found.append(_joint_finding(
                joint, f'a limb that goes {math.degrees(overextension):.0f} degrees past straight',
                overextension > 2 * MAX_OVEREXTENSION or overextension > abs(bend) + high))
    return found


def _find_wrong_legs(doll: Ragdoll, roles: Sequence[str | None]) -> list[Finding]:
    """Hinges of an animal's front and hind legs that fold in a direction in which no animal's do.

    Only bones that point down in the bind pose are checked; for bent hinges see
    _find_overextension.
    """
    role_of = dict(zip((bone.name for bone in doll.bones), roles, strict=True))
    joints = {joint.child: joint for joint in doll.joints}
    hips = {name: _hip_of(joints, name, role_of) for name in joints if role_of[name] in LEG_FOLDS}
    places = [joints[hip].anchor[0] for hip in hips.values() if hip]
    if not places or max(places) - min(places) < MIN_LEG_DISTANCE * extent(doll):
        return []
    middle, found = (max(places) + min(places)) / 2, []
    for name, hip in hips.items():
        joint, order = joints[name], LEG_FOLDS[role_of[name] or '']
        if not hip or joint.kind != 'hinge':
            continue
        is_front = joints[hip].anchor[0] > middle
        sign = 1 if is_front == (order == 1) else -1
        arm = np.subtract(doll.bone(name).position, joint.anchor)
        if -arm[2] > 0.8 * np.linalg.norm(arm) and sign * _forward_motion(doll, joint) < -0.05:
            part = FOLDING_JOINTS[is_front, order]
            found.append(_joint_finding(joint, f'{part} that folds the wrong way', True))
    return found


def _hip_of(joints: dict[str, Joint], name: str, role_of: dict[str, str | None]) -> str:
    """Name of the first bone, from ``name`` towards the root, with a role in HIP_ROLES; '' if there
    is none.
    """
    while name in joints and role_of[name] not in HIP_ROLES:
        name = joints[name].parent
    return name if name in joints else ''


def _joint_finding(joint: Joint, problem: str, wrong: bool) -> Finding:
    low, high = (math.degrees(angle) for angle in joint.angle_limits[0])
    return Finding(f'{joint.child}: {problem} (limits {low:.0f} to {high:.0f} degrees)', wrong)


def _forward_motion(doll: Ragdoll, joint: Joint) -> float:
    """Motion of the child's centre along x, as a fraction of its distance from the anchor.

    The motion is from the bind pose to the middle of the first angle's range; 0 without limits.
    """
    pair = joint.angle_limits[0]
    if pair is None:
        return 0.0
    arm = np.array(doll.bone(joint.child).position) - joint.anchor
    length = float(np.linalg.norm(arm))
    if length < 1e-9:
        return 0.0
    turn = rotation.from_axis_angle(joint_axes(joint)[0], sum(pair) / 2)
    return float(rotation.rotate(turn, arm)[0] - arm[0]) / length

"""Roles of bones (a thigh, a hand), from the names that well-known skeletons give them.

Mixamo, MakeHuman, CMU (both its ASF and its BVH names), VRM, Unreal, 3ds Max's Biped, SMPL.
"""
from __future__ import annotations

import re

from ..model.ragdoll import Ragdoll

WORDS = (
    # The first role with a word in the name wins: a handindex is a finger, no hand.
    ('finger', 'finger thumb index middle ring pinky little metacarpal'),
    ('tail', 'tail'),
    ('soft', 'ear hair jaw eye tongue breast brow lip lid skirt cape cloth teeth beard'),
    ('wing', 'wing feather'),
    ('toe', 'toe toebase toes ball'),
    ('forearm', 'forearm lowerarm lowarm radius ulna elbow'),
    ('hand', 'hand wrist palm'),
    ('clavicle', 'clavicle collar scapula'),
    ('upper_arm', 'upperarm uparm humerus bicep'),
    ('thigh', 'thigh upleg upperleg femur'),
    ('shin', 'shin calf lowerleg lowleg knee tibia shank'),
    ('foot', 'foot ankle heel'),
    ('neck', 'neck'),
    ('head', 'head skull'),
    ('hips', 'hips pelvis'),
    ('spine', 'spine chest torso abdomen back lowerback upperback waist belly'),
    # Words whose meaning hangs on the bones around.
    ('?hip', 'hip'), ('?thorax', 'thorax'), ('?shoulder', 'shoulder'),
    ('?arm', 'arm'), ('?leg', 'leg'))

SIDES = {'l': 1, 'left': 1, 'lft': 1, 'r': -1, 'right': -1, 'rgt': -1}

FILLERS = {'joint', 'jnt', 'bone', 'skeleton', 'armature', 'bind', 'def', 'org', 'mch', 'rig', 'b',
           'j', 'bip', 'cc', 'base', 'sec', 'mixamorig', 'character', 'biped'}

LIMBS = {'clavicle', 'upper_arm', 'forearm', 'hand', 'thigh', 'shin', 'foot', 'toe', 'head'}
"""Roles of which a limb has one: a second bone of the same role is a piece of the first."""

ARM = ('upper_arm', 'forearm', 'hand', 'finger')
LEG = ('thigh', 'shin', 'foot', 'toe')


def plain_name(name: str, otherwise: str) -> str:
    """The name as a doll's file takes it: printable, without slashes, not empty."""
    text = ''.join(c if c.isprintable() and c != '/' else '_' for c in name)
    return text.strip()[:90] or otherwise


def side_of(name: str) -> int:
    """1 for a bone named as a left one, -1 for a right one, 0 for neither."""
    return _side_and_words(name)[0]


def roles_of(names: tuple[str, ...], parents: tuple[int, ...]) -> tuple[str | None, ...]:
    """Role of each bone, None where its name says nothing.

    ``parents`` are indices of the bones, which come parents first; -1 for a bone without one.
    """
    raw = [_raw_role(name) for name in names]
    roles: list[str | None] = []
    for bone, (role, parent) in enumerate(zip(raw, parents, strict=True)):
        above = roles[parent] if parent >= 0 else None
        below = [raw[child] for child, up in enumerate(parents) if up == bone]
        sided = side_of(names[bone]) != 0
        if role == '?hip':
            role = 'thigh' if sided else 'hips'
        elif role == '?thorax':
            role = 'clavicle' if sided else 'spine'
        elif role == '?shoulder':
            # Mixamo and VRM call the collar bone shoulder, SMPL the upper arm.
            role = 'clavicle' if {'?arm', 'upper_arm', '?shoulder'} & set(below) else 'upper_arm'
        elif role == '?arm':
            role = _next(ARM, above) if sided else None
        elif role == '?leg':
            role = _next(LEG, above) if sided else None
        elif role == 'finger' and above not in ('hand', 'finger', 'forearm'):
            # Index, middle and ring are words of their own.
            role = None
        roles.append(role)
    return tuple(roles)


def doll_roles(doll: Ragdoll) -> tuple[str | None, ...]:
    """Role of each of the doll's bones, by their names; see roles_of."""
    order = [doll.root.name, *(joint.child for joint in doll.joints_from_root())]
    above = {joint.child: order.index(joint.parent) for joint in doll.joints}
    roles = dict(zip(order, roles_of(tuple(order), tuple(above.get(n, -1) for n in order)),
                     strict=True))
    return tuple(roles[bone.name] for bone in doll.bones)


def _next(limb: tuple[str, ...], above: str | None) -> str:
    """Of a limb numbered bone by bone, the piece that follows the one above."""
    if above not in limb:
        return limb[0]
    return limb[min(limb.index(above) + 1, len(limb) - 1)]


def _raw_role(name: str) -> str | None:
    key = ''.join(_side_and_words(name)[1])
    words = [(role, word) for role, text in WORDS for word in text.split()]
    for role, word in words:
        if key == word:
            return role
    for role, word in words:
        # Three letters are found in too many words: an ear in a forearm's 'fear'.
        if word in key and (len(word) > 3 or word in _side_and_words(name)[1]):
            return role
    return None


def _side_and_words(name: str) -> tuple[int, list[str]]:
    """Split a name into words without fillers and numbers, and the side it names."""
    tail = re.split(r'[:|]', name)[-1]
    words = [word.lower() for word in re.findall(r'[A-Z]+(?![a-z])|[A-Z]?[a-z]+', tail)]
    side = next((SIDES[word] for word in words if word in SIDES), 0)
    words = [word for word in words if word not in SIDES and word not in FILLERS]
    if not side and len(words) == 1 and words[0][0] in 'lr':
        # CMU writes lhumerus and rfoot.
        known = {word for _, text in WORDS for word in text.split()}
        if words[0] not in known and words[0][1:] in known:
            side, words = SIDES[words[0][0]], [words[0][1:]]
    return side, words

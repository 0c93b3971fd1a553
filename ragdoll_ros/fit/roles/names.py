"""Roles of bones (a thigh, a hand), from the names that well-known skeletons give them.

The words are in config/bone_names.yaml.
"""
from __future__ import annotations

import functools
import re
import unicodedata
from collections import Counter

from ...model.ragdoll import Ragdoll
from .vocabulary import vocabulary

FEWEST, COMMON = 8, 0.7
"""Of so many names, a word that this share of them begin or end with says nothing of any."""

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
    raw = [_raw_role(words) for words in _own_words(names)]
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


def _raw_role(words: tuple[str, ...]) -> str | None:
    """Role by the first word of the vocabulary that is the name, else that is in it."""
    key, roles = ''.join(words), vocabulary().roles
    for role, word in roles:
        if key == word:
            return role
    for role, word in roles:
        # Three letters are found in too many words: an ear in a forearm's 'fear'.
        if word in key and (len(word) > 3 or not word.isascii() or word in words):
            return role
    return None


def _own_words(names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Words of each name without those that most begin or end with: Ringmaster_LeftArm_skin."""
    words = [_side_and_words(name)[1] for name in names]
    for end in (0, -1):
        while len(words) >= FEWEST:
            first = Counter(each[end] for each in words if each).most_common(1)
            # A word that may be a bone's has to be on all: most bones of some are hair.
            least = 1.0 if first and _raw_role((first[0][0],)) else COMMON
            if not first or first[0][1] < least * len(words):
                break
            rest = slice(1, None) if end == 0 else slice(None, -1)
            words = [each[rest] if each and each[end] == first[0][0] else each for each in words]
    return words


@functools.lru_cache(4096)
def _side_and_words(name: str) -> tuple[int, tuple[str, ...]]:
    """Split a name into plain words without fillers and numbers, and the side it names."""
    known = vocabulary()
    words = [word.lower() for word in re.findall(
        r'[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[^\W\d_A-Za-z]+', _plain(re.split(r'[:|]', name)[-1]))]
    side = next((known.sides[word] for word in words if word in known.sides), 0)
    words = [word for word in words if word not in known.sides and word not in known.fillers]
    for index, word in enumerate([] if side else words):
        rest, side = _without_side(word, len(words) == 1)
        if side:
            words[index] = rest
            break
    return side, tuple(word for word in words if word)


def _without_side(word: str, alone: bool) -> tuple[str, int]:
    """What is left of a word without the side that it is written in one with, and that side.

    CMU writes lhumerus and rfoot; others leftarm, and 左ひじ.
    """
    known = vocabulary()
    for mark, side in known.sides.items():
        if not mark.isascii():
            if mark in word:
                return word.replace(mark, '', 1), side
        elif (len(mark) > 1 or alone) and word not in known.known:
            for rest in (word[len(mark):] if word.startswith(mark) else '',
                         word[:-len(mark)] if len(mark) > 1 and word.endswith(mark) else ''):
                if rest in known.known:
                    return rest, side
    return word, 0


def _plain(name: str) -> str:
    """The name without accents and with the usual forms of letters: Fuß is Fuss, ﾋｼﾞ is ヒジ."""
    parts = unicodedata.normalize('NFD', unicodedata.normalize('NFKC', name).replace('ß', 'ss'))
    return unicodedata.normalize('NFC', re.sub('[\u0300-\u036f]', '', parts))

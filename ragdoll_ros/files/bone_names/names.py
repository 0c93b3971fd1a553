"""Anatomical roles of bones (thigh, hand, ...) from their names in well-known skeletons.

The vocabulary is config/bone_names.yaml.
"""
import functools
import re
import unicodedata
from collections import Counter

from ...model.ragdoll import Ragdoll
from .vocabulary import vocabulary

MIN_NAMES, AFFIX_SHARE = 8, 0.7
"""From this many names on, a word that begins or ends this fraction of them carries no meaning."""

SINGLE_ROLES = {'clavicle', 'upper_arm', 'forearm', 'hand', 'thigh', 'shin', 'foot', 'toe', 'head'}
"""Roles that a limb has once: a second bone of the same role belongs to the same segment."""

ARM = ('upper_arm', 'forearm', 'hand', 'finger')
LEG = ('thigh', 'shin', 'foot', 'toe')


def side_of(name: str) -> int:
    """Side that a bone's name states: 1 left, -1 right, 0 neither."""
    return _side_and_words(name)[0]


def roles_of(names: tuple[str, ...], parents: tuple[int, ...]) -> tuple[str | None, ...]:
    """Role of each bone, None where its name states none.

    ``parents`` are bone indices, parents first; -1 for a bone without a parent.
    """
    raw = [_raw_role(words) for words in _distinct_words(names)]
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
        elif role == '?segment':
            limb = next((limb for limb in (ARM, LEG) if above in limb), None)
            role = _next_segment(limb, above) if limb else None
        elif role == '?arm':
            role = _next_segment(ARM, above) if sided else None
        elif role == '?leg':
            role = _next_segment(LEG, above) if sided else None
        elif role == 'finger' and above not in ('hand', 'finger', 'forearm'):
            # 'Index', 'middle' and 'ring' occur in other names too.
            role = None
        roles.append(role)
    return tuple(roles)


def doll_roles(doll: Ragdoll) -> tuple[str | None, ...]:
    """Role of each bone of a doll by name; see roles_of."""
    order = [doll.root.name, *(joint.child for joint in doll.joints_from_root())]
    above = {joint.child: order.index(joint.parent) for joint in doll.joints}
    roles = dict(zip(order, roles_of(tuple(order), tuple(above.get(n, -1) for n in order)),
                     strict=True))
    return tuple(roles[bone.name] for bone in doll.bones)


def _next_segment(limb: tuple[str, ...], above: str | None) -> str:
    """Return the role that follows the parent's role ``above`` in a limb: the first one if
    ``above`` is not in the limb, at most the last one.
    """
    if above not in limb:
        return limb[0]
    return limb[min(limb.index(above) + 1, len(limb) - 1)]


def _raw_role(words: tuple[str, ...]) -> str | None:
    """Role of the first vocabulary word that equals the name, else that occurs in it."""
    key, roles = ''.join(words), vocabulary().roles
    for role, word in roles:
        if key == word:
            return role
    for role, word in roles:
        # Short words occur within others: the 'ear' in 'forearm'.
        if word in key and (len(word) > 3 or not word.isascii() or word in words):
            return role
    return None


def _distinct_words(names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Return the words of each name without affixes that most names share, such as Ringmaster and
    skin in Ringmaster_LeftArm_skin.
    """
    words = [_side_and_words(name)[1] for name in names]
    for end in (0, -1):
        while len(words) >= MIN_NAMES:
            first = Counter(each[end] for each in words if each).most_common(1)
            # A word that may state a role must be on all names: most bones of some rigs are hair.
            least = 1.0 if first and _raw_role((first[0][0],)) else AFFIX_SHARE
            if not first or first[0][1] < least * len(words):
                break
            rest = slice(1, None) if end == 0 else slice(None, -1)
            words = [each[rest] if each and each[end] == first[0][0] else each for each in words]
    return words


@functools.lru_cache(4096)
def _side_and_words(name: str) -> tuple[int, tuple[str, ...]]:
    """Side of a name, and its words in lower case without fillers and numbers."""
    known = vocabulary()
    words = [word.lower() for word in re.findall(
        r'[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[^\W\d_A-Za-z]+', _normalize(re.split(r'[:|]', name)[-1]))]
    side = next((known.sides[word] for word in words if word in known.sides), 0)
    words = [word for word in words if word not in known.sides and word not in known.fillers]
    for index, word in enumerate([] if side else words):
        rest, side = _without_side(word, len(words) == 1)
        if side:
            words[index] = rest
            break
    return side, tuple(word for word in words if word)


def _without_side(word: str, alone: bool) -> tuple[str, int]:
    """A word without the side that it contains, and the side, 0 for none.

    CMU writes lhumerus and rfoot; others write leftarm or 左ひじ.
    """
    known = vocabulary()
    for mark, side in known.sides.items():
        if not mark.isascii():
            if mark in word:
                return word.replace(mark, '', 1), side
        elif (len(mark) > 1 or alone) and word not in known.role_words:
            for rest in (word[len(mark):] if word.startswith(mark) else '',
                         word[:-len(mark)] if len(mark) > 1 and word.endswith(mark) else ''):
                if rest in known.role_words:
                    return rest, side
    return word, 0


def _normalize(name: str) -> str:
    """The name without accents and in standard letter forms: Fuß to Fuss, ﾋｼﾞ to ヒジ."""
    parts = unicodedata.normalize('NFD', unicodedata.normalize('NFKC', name).replace('ß', 'ss'))
    return unicodedata.normalize('NFC', re.sub('[\u0300-\u036f]', '', parts))

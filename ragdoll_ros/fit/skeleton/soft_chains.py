"""Hair, skirts and capes as spring bones: chains of bones that support no body.

Chains with such names become spring bones, and so do thin chains without a known name and the
thinnest branches of a character with more bodies than run in real time. They have VRM's default
settings and do not collide.
"""
from collections import Counter

import numpy as np

from ...files.bone_names.names import ARM, LEG
from ..reading.character import Character
from ..reading.spring_bones import SpringBone, SpringJoint
from .groups import BodyGroup
from .skin_tree import SkinTree

MAX_BODIES = 60
"""Bodies of a doll: with as many ball joints, a tick of 10 ms takes about 10 ms."""

MIN_THIN_LENGTH = 0.12
"""Shortest thin chain, as a fraction of the character's extent: a person's finger is 0.06, with its
bone in the palm 0.1."""

MAX_THIN_RADIUS = 0.1
"""Largest mean distance of a thin chain's skin from it, as a fraction of its length."""

MAX_THIN_AREA = 0.03
"""Largest fraction of the skin on a thin chain: a person's arm has 0.1, a spider's leg 0.09."""

MIN_THIN_HEIGHT = 0.05
"""Height of a thin chain's skin above the character's lowest, as a fraction of its extent: what
reaches the ground may be a leg."""

SIMILAR_AREA = 2.0
"""Ratio of skin areas per bone up to which branches count as equally thin."""

DEFAULT_STIFFNESS, DEFAULT_DRAG = 1.0, 0.5
"""m/s and fraction per frame: VRM's defaults."""


def soft_chains(character: Character, tree: SkinTree, roles: tuple[str | None, ...],
                clusters: list[np.ndarray]) -> list[SpringBone]:
    """Spring bones of chains of two or more bones whose role is 'soft'.

    A side branch is a spring bone of its own, attached to the same body.
    """
    taken = {bone for spring in character.springs for bone in spring.bones}
    soft = {bone for bone, role in enumerate(roles) if role == 'soft' and len(clusters[bone])
            and bone not in taken and tree.parents[bone] >= 0}
    springs = []
    for bone in tree.order:
        if bone not in soft:
            continue
        chain, carrier = [bone], tree.parents[bone]
        while carrier in soft or carrier in taken:
            carrier = tree.parents[carrier]
        while below := [k for k in sorted(soft) if tree.parents[k] == chain[-1]]:
            chain.append(below[0])
        soft -= set(chain)
        # A single bone, such as an ear or a jaw, is part of its parent's body.
        if len(chain) > 1 and carrier not in taken:
            springs.append(_spring(
                character, {each: link for link, each in enumerate(chain)},
                character.bone_names[bone], carrier, [tree.anchors[each][0] for each in chain],
                clusters[chain[-1]]))
            taken |= set(chain)
    return springs


def thin_chains(character: Character, tree: SkinTree, roles: tuple[str | None, ...],
                clusters: list[np.ndarray], taken: frozenset[int]) -> list[SpringBone]:
    """Spring bones of unbranched chains of two or more thin bones that end freely.

    None of their bones has a role or is ``taken``, and they do not hang on a limb, so that they are
    no fingers either. Without any names, length, skin and height tell them from limbs.
    """
    skinned = [bone for bone in tree.order if len(clusters[bone]) and bone not in taken]
    count = Counter(tree.parents[bone] for bone in skinned)
    areas = character.vertex_areas()
    springs = []
    for end in (bone for bone in skinned if not count[bone] and tree.parents[bone] >= 0):
        chain, above = [end], tree.parents[end]
        while (count[above] == 1 and above in skinned and roles[above] is None
               and tree.parents[above] >= 0):
            chain.insert(0, above)
            above = tree.parents[above]
        if (len(chain) < 2 or above in taken or roles[end]
                or roles[above] in (*ARM, *LEG, 'clavicle')):
            continue
        spring = _spring(character, {bone: link for link, bone in enumerate(chain)},
                         character.bone_names[chain[0]], above,
                         [tree.anchors[bone][0] for bone in chain], clusters[end])
        if _is_thin(character, spring, [clusters[bone] for bone in chain], areas):
            springs.append(spring)
    return springs


def _is_thin(character: Character, spring: SpringBone, clusters: list[np.ndarray],
             areas: np.ndarray) -> bool:
    """Whether a chain is long, and has little skin, all of it near the chain and off the ground."""
    assert spring.points is not None
    steps = np.diff(spring.points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    skin = np.concatenate(clusters)
    if (lengths.sum() < MIN_THIN_LENGTH * character.extent or not lengths.all()
            or areas[skin].sum() > MAX_THIN_AREA * areas.sum()):
        return False
    height = character.vertices[skin, 2].min() - character.vertices[:, 2].min()
    if height < MIN_THIN_HEIGHT * character.extent:
        return False
    distances = [np.linalg.norm(np.cross(character.vertices[own] - root, step / length), axis=1)
                 for own, root, step, length in zip(clusters, spring.points, steps, lengths,
                                                    strict=False)]
    return bool(np.concatenate(distances).mean() <= MAX_THIN_RADIUS * lengths.sum())


def limit_bodies(character: Character, groups: list[BodyGroup],
                 forced: frozenset[int] = frozenset()) -> tuple[list[BodyGroup], list[SpringBone]]:
    """Reduce the groups to MAX_BODIES: the thinnest branches become spring bones.

    Branches of the same body that are about as thin go together: all hair, or none. Groups with a
    ``forced`` bone stay and do not count.
    """
    springs: list[SpringBone] = []
    areas = character.vertex_areas()
    limit = MAX_BODIES + sum(bool(forced & set(group.bones)) for group in groups)
    while len(groups) > limit and (branches := _branches(groups, forced)):
        sizes = [np.mean([areas[groups[k].vertices].sum() for k in branch]) for branch in branches]
        carrier = groups[branches[int(np.argmin(sizes))][0]].parent
        family = [branch for branch, size in zip(branches, sizes, strict=True)
                  if groups[branch[0]].parent == carrier and size <= SIMILAR_AREA * min(sizes)]
        for branch in family:
            links = {bone: link for link, k in enumerate(branch) for bone in groups[k].bones}
            springs.append(_spring(character, links, groups[branch[0]].name, groups[carrier].bone,
                                   [groups[k].anchor for k in branch],
                                   groups[branch[-1]].vertices))
            groups[carrier].bones += links
        groups = _remove_groups(groups, {k for branch in family for k in branch})
    return groups, springs


def _branches(groups: list[BodyGroup], forced: frozenset[int]) -> list[list[int]]:
    """Unbranched chains of groups from a branching body to the end, without ``forced`` bones."""
    children = [[k for k, group in enumerate(groups) if group.parent == index]
                for index in range(len(groups))]
    branches = []
    for end in (k for k, below in enumerate(children) if not below):
        chain = [end]
        while (above := groups[chain[0]].parent) >= 0 and len(children[above]) == 1:
            chain.insert(0, above)
        if above >= 0 and not any(forced & set(groups[k].bones) for k in chain):
            branches.append(chain)
    return branches


def _remove_groups(groups: list[BodyGroup], removed: set[int]) -> list[BodyGroup]:
    remaining = [k for k in range(len(groups)) if k not in removed]
    for k in remaining:
        groups[k].parent = remaining.index(groups[k].parent) if groups[k].parent >= 0 else -1
    return [groups[k] for k in remaining]


def _spring(character: Character, links: dict[int, int], name: str, carrier: int,
            roots: list[np.ndarray], last: np.ndarray) -> SpringBone:
    """Spring bone from ``roots`` (3,) m to the farthest of the vertices ``last``. ``links`` maps
    bones to segments; the chain hangs on the bone ``carrier``.
    """
    points = character.vertices[last]
    tip = points[np.argmax(np.linalg.norm(points - roots[-1], axis=1))]
    joint = SpringJoint(DEFAULT_STIFFNESS / character.scale, 0.0, DEFAULT_DRAG)
    return SpringBone(name, (), (joint,) * len(roots), np.array([*roots, tip]), carrier,
                      tuple(links), tuple(links.values()))

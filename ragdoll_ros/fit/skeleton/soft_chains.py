"""Hair, skirts and capes as springs: chains of bones that hang from a body and carry nothing.

Bones with such names are taken for springs, and where a character has more bodies than run in real
time, so are its thinnest branches. They swing by VRM's default numbers and collide with nothing.
"""
from __future__ import annotations

import numpy as np

from ..reading.character import Character
from ..reading.spring_bones import Rod, Spring
from .groups import Group
from .skin_tree import SkinTree

MOST_BODIES = 60
"""Bodies of a doll: with as many of balls, a tick of 10 ms takes about 10 ms."""

ALIKE = 2.0
"""Branches are about as thin if one has up to this much more skin to a bone."""

STIFFNESS, DRAG = 1.0, 0.5
"""m/s and a share a frame: what VRM's springs have if their file says nothing."""


def soft_chains(character: Character, tree: SkinTree, roles: tuple[str | None, ...],
                clusters: list[np.ndarray]) -> list[Spring]:
    """Springs of two or more bones whose role is 'soft', one below the other.

    A side branch is a spring of its own, fixed on the same body.
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
        # A single bone, an ear or a jaw, is part of what carries it.
        if len(chain) > 1 and carrier not in taken:
            springs.append(_spring(character, chain, carrier,
                                   [tree.anchors[each][0] for each in chain],
                                   clusters[chain[-1]]))
            taken |= set(chain)
    return springs


def thinned(character: Character, groups: list[Group],
            kept: frozenset[int] = frozenset()) -> tuple[list[Group], list[Spring]]:
    """At most MOST_BODIES of the groups; above that the thinnest branches become springs.

    With each go those that hang on the same body and are about as thin: all hair, or none. Groups
    with a bone that is ``kept`` stay, and do not count.
    """
    springs: list[Spring] = []
    areas = character.vertex_areas()
    most = MOST_BODIES + sum(bool(kept & set(group.bones)) for group in groups)
    while len(groups) > most and (branches := _branches(groups, kept)):
        sizes = [np.mean([areas[groups[k].vertices].sum() for k in branch]) for branch in branches]
        carrier = groups[branches[int(np.argmin(sizes))][0]].parent
        family = [branch for branch, size in zip(branches, sizes, strict=True)
                  if groups[branch[0]].parent == carrier and size <= ALIKE * min(sizes)]
        for branch in family:
            bones = [bone for k in branch for bone in groups[k].bones]
            springs.append(_spring(character, [groups[k].bone for k in branch],
                                   groups[carrier].bone, [groups[k].anchor for k in branch],
                                   groups[branch[-1]].vertices, bones))
            groups[carrier].bones += bones
        groups = _without(groups, {k for branch in family for k in branch})
    return groups, springs


def _branches(groups: list[Group], kept: frozenset[int]) -> list[list[int]]:
    """Chains of groups without a branch, from what hangs on a branching body to the end.

    But those with a bone that is ``kept``.
    """
    children = [[k for k, group in enumerate(groups) if group.parent == index]
                for index in range(len(groups))]
    branches = []
    for end in (k for k, below in enumerate(children) if not below):
        chain = [end]
        while (above := groups[chain[0]].parent) >= 0 and len(children[above]) == 1:
            chain.insert(0, above)
        if above >= 0 and not any(kept & set(groups[k].bones) for k in chain):
            branches.append(chain)
    return branches


def _without(groups: list[Group], gone: set[int]) -> list[Group]:
    kept = [k for k in range(len(groups)) if k not in gone]
    for k in kept:
        groups[k].parent = kept.index(groups[k].parent) if groups[k].parent >= 0 else -1
    return [groups[k] for k in kept]


def _spring(character: Character, chain: list[int], carrier: int, roots: list[np.ndarray],
            last: np.ndarray, bones: list[int] | None = None) -> Spring:
    """Spring along the roots of a chain of bones, to the end of the last one's skin."""
    points = character.vertices[last]
    tip = points[np.argmax(np.linalg.norm(points - roots[-1], axis=1))]
    rod = Rod(STIFFNESS / character.scale, 0.0, DRAG)
    return Spring(character.bone_names[chain[0]], (), (rod,) * len(chain),
                  np.array([*roots, tip]), carrier, tuple(bones or chain))

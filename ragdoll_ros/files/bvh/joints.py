"""Joints of a motion capture skeleton that move the bodies of a doll, found by names or by roles.

By names, if the root and at least half of the bodies have joints with their names or those of their
riders, as in files that were exported from the doll. Else also by roles (thigh, hand, ...) that the
names of joints and bodies state, as in skeletons of persons.
"""
from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ...model import errors
from ...model.ragdoll import Ragdoll
from ..bone_names.names import ARM, LEG, doll_roles, roles_of, side_of

LIKE_NAMED = 0.5
"""Fraction of a doll's bodies with joints of their names, the root among them, from which on names
alone decide."""

NEXT_ROLE = dict(zip((*ARM[:-1], *LEG[:-1]), (*ARM[1:], *LEG[1:]), strict=True))
"""Role of the next segment of a limb."""


def joints_of_bodies(doll: Ragdoll, names: Sequence[str], parents: Sequence[int],
                     chosen: Mapping[str, str]) -> dict[str, int]:
    """Return the index of the joint that moves each body, by body; the root's is 0 if none is
    found, other bodies without a joint are left out.

    ``names`` and ``parents`` are the joints'; ``chosen`` has names of joints by body. Raises
    UnknownBone or UnknownJoint for what is chosen, WrongForm if nothing fits.
    """
    found = _by_names(doll, names)
    if doll.root.name not in found or len(found) < LIKE_NAMED * len(doll.bones):
        found |= _by_roles(doll, names, parents)
    bodies = [bone.name for bone in doll.bones]
    for body, name in chosen.items():
        if body not in bodies:
            raise errors.UnknownBone(f'bones.{body}', body, errors.one_of(bodies, body))
        if name not in names:
            raise errors.UnknownJoint(f'bones.{body}', name, errors.one_of(names, name))
        found[body] = names.index(name)
    if not found:
        raise errors.WrongForm('bones', ', '.join(names), f'joints of the bodies {bodies[0]}, ...: '
                               'by their names, by names of a person, or in bones: {body: joint}')
    found.setdefault(doll.root.name, 0)
    return {body: found[body] for body in bodies if body in found}


def _by_names(doll: Ragdoll, names: Sequence[str]) -> dict[str, int]:
    """Return the joints by body: of the body's name, else of the first of its riders that
    has one.
    """
    exact = {name: k for k, name in reversed([*enumerate(names)])}
    loose = {_key(name): k for k, name in reversed([*enumerate(names)])}
    found: dict[str, int] = {}
    for name, body in [*((bone.name, bone.name) for bone in doll.bones),
                       *((rider.name, rider.bone) for rider in doll.riders)]:
        joint = exact.get(name, loose.get(_key(name)))
        if joint is not None:
            found.setdefault(body, joint)
    return found


def _key(name: str) -> str:
    """Return the name in lower case, without a namespace, and with _ for spaces, which names in BVH
    files do not have.
    """
    return '_'.join(re.split('[:|]', name)[-1].split()).casefold()


def _by_roles(doll: Ragdoll, names: Sequence[str], parents: Sequence[int]) -> dict[str, int]:
    """Joints of the roles and sides of the bodies."""
    roles = roles_of(tuple(names), tuple(parents))
    joints: dict[tuple[str, int], list[int]] = {}
    for k, role in enumerate(roles):
        if role is not None:
            joints.setdefault((role, side_of(names[k])), []).append(k)
    bodies: dict[tuple[str, int], list[str]] = {}
    of_body = dict(zip((bone.name for bone in doll.bones), doll_roles(doll), strict=True))
    for body in [doll.root.name, *(joint.child for joint in doll.joints_from_root())]:
        if (role := of_body[body]) is not None:
            bodies.setdefault((role, side_of(body)), []).append(body)
    found: dict[str, int] = {}
    for (role, side), own in bodies.items():
        those = joints.get((role, side)) or joints.get(('neck' if role == 'head' else role, side))
        if those and role == 'spine':
            # Of a chain, the last body has the last joint, the others between.
            found |= {body: those[-(-(k + 1) * len(those) // len(own)) - 1]
                      for k, body in enumerate(own)}
        elif those:
            found[own[0]] = _segment(role, side, those, joints, parents)
    return found


def _segment(role: str, side: int, those: list[int], joints: Mapping[tuple[str, int], list[int]],
             parents: Sequence[int]) -> int:
    """Return the joint of ``those``, all of one role, that is the last above the limb's next
    segment, else the first: CMU has LHipJoint and LeftUpLeg.
    """
    up = joints.get((NEXT_ROLE.get(role, ''), side), [-1])[0]
    while up >= 0 and up not in those:
        up = parents[up]
    return up if up >= 0 else those[0]

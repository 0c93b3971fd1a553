"""From a character to a doll, step by step: cluster, group, shape, weigh, joint, carry."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from ..model.ragdoll import Bone, Joint, Ragdoll, SkeletonFrame
from ..model.swing import Swing
from . import masses
from .axes import Axes, fit_axes
from .character import Character
from .groups import Group, group_bones, partner, vertices_by_bone
from .joints import damped, make_joint
from .names import roles_of, side_of
from .refine import refined
from .shapes import TOLERANCE, Fitted, fit_best, fit_shape
from .spring_recipe import swing_of

THINNEST = 0.01
"""No body is thinner than this share of the whole character."""

DECIMALS = 10
"""Decimals of m that a doll's numbers keep: below every figure of merit, above the noise."""


@dataclass(frozen=True)
class Options:
    """What the user may choose; lengths in m, masses in kg."""

    shape: str = 'best'
    orientation: str = 'principal'
    share: float | None = None
    """Weight from which on a vertex counts for a bone; None: the bone with the largest."""
    smallest: float | None = None
    mass: float | None = None
    masses: str = 'volume'


@dataclass(frozen=True)
class BodyFit:
    """How one body came about, and how good it is."""

    bone: Bone
    bones: tuple[str, ...]
    role: str | None
    vertices: int
    inside: int
    """Of its vertices, how many are within 1 cm of the body or in it."""
    axes: Axes


@dataclass(frozen=True)
class Fit:
    """A doll and how it came about."""

    doll: Ragdoll
    character: Character
    bodies: tuple[BodyFit, ...]
    notes: tuple[str, ...]


def fit_character(character: Character, options: Options | None = None) -> Fit:
    """Make a doll of a character; ModelError where an option is out of range."""
    options = options or Options()
    given, character = character, refined(character)
    roles = roles_of(character.bone_names, character.parents)
    clusters = vertices_by_bone(character, options.share)
    swinging = frozenset(bone for spring in character.springs for bone in spring.bones)
    groups = group_bones(character, roles, clusters, options.smallest, swinging)
    notes = [*character.notes, *_unmoved(character, len(given.vertices), groups)]
    directions = [_direction(character, groups, index) for index in range(len(groups))]
    areas = character.vertex_areas()
    axes = [fit_axes(character.vertices[group.vertices], areas[group.vertices], direction,
                     options.orientation)
            for group, direction in zip(groups, directions, strict=True)]
    fits = _fit_shapes(character, groups, axes, options.shape)
    weights = _masses(character, groups, roles, [fit.shape.volume for fit in fits], options)
    bodies = [_body(given, *parts, roles) for parts in zip(groups, fits, axes, weights,
                                                           strict=True)]
    joints = [damped(_joint(character, groups, index, roles, directions),
                     bodies[group.parent].bone, bodies[index].bone)
              for index, group in enumerate(groups) if group.parent >= 0]
    notes += [f'no bone joins {character.bone_names[group.bone]} to the rest: it is tied to '
              f'{character.bone_names[groups[group.parent].bone]}'
              for group in groups if group.tied]
    doll = Ragdoll(character.name, tuple(body.bone for body in bodies), tuple(joints),
                   _swings(character, groups, bodies, notes),
                   _riders(character, groups, bodies))
    return Fit(doll, given, tuple(bodies), tuple(notes))


def _unmoved(character: Character, given: int, groups: list[Group]) -> list[str]:
    """Note the vertices that no bone moves; where none is moved at all, the root takes them."""
    unmoved = int((character.weights[:given].sum(axis=1) == 0).sum())
    if unmoved == given:
        root = next(group for group in groups if group.parent < 0)
        root.vertices = np.arange(len(character.vertices))
        return ['all weights are zero: the root takes the whole skin']
    return [f'{unmoved} vertices have no weight: no body holds them'] if unmoved else []


def _direction(character: Character, groups: list[Group], index: int) -> np.ndarray:
    """Unit direction (3,) of a body's bone: to its children's roots, else to its skin's middle."""
    group = groups[index]
    root = character.positions[group.bone]
    points = character.vertices[group.vertices]
    middle = points.mean(axis=0) - root if len(points) else np.zeros(3)
    children = [character.positions[g.bone] - root for g in groups if g.parent == index]
    ways = [np.mean(children, axis=0)] if children else []
    if not points.size:
        ways += [character.positions[bone] - root for bone in group.bones[1:]]
    least = 0.05 * float(np.ptp(points, axis=0).max()) if len(points) else 1e-6
    for way in [*ways, middle]:
        length = float(np.linalg.norm(way))
        if length > max(least, 1e-6):
            return way / length
    return np.array([0.0, 0.0, 1.0])


def _fit_shapes(character: Character, groups: list[Group], axes: list[Axes],
                kind: str) -> list[Fitted]:
    """Shapes in their own axes, their centres in the doll's frame; pairs have the same kind."""
    extent = character.extent
    sizes = (THINNEST * extent, min(TOLERANCE, 0.006 * extent))
    clouds = [(character.vertices[group.vertices] if len(group.vertices)
               else character.positions[[group.bone]]) @ own.frame
              for group, own in zip(groups, axes, strict=True)]
    fits: dict[int, Fitted] = {}
    for index, cloud in enumerate(clouds):
        if kind != 'best':
            fits[index] = fit_shape(cloud, kind, *sizes)
        elif index not in fits:
            pair = sorted({index, partner(character, groups, index)})
            fits.update(zip(pair, fit_best([clouds[k] for k in pair], *sizes), strict=True))
    return [Fitted(_rounded(fits[index].shape), own.frame @ fits[index].centre, fits[index].share)
            for index, own in enumerate(axes)]


def _rounded(shape: object) -> object:
    return type(shape)(**{key: tuple(round(float(edge), DECIMALS) for edge in value)
                          if isinstance(value, tuple) else round(float(value), DECIMALS)
                          for key, value in vars(shape).items()})


def _masses(character: Character, groups: list[Group], roles: tuple[str | None, ...],
            volumes: list[float], options: Options) -> list[float]:
    """Masses, kg: of water, unless the user gives the total."""
    total = options.mass
    if total is None:
        # Bodies overlap; a closed skin knows better how much of the character there is.
        skin = character.volume()
        plausible = 0.3 * sum(volumes) < skin < 1.2 * sum(volumes)
        total = masses.WATER * (skin if plausible else sum(volumes))
    errors.check_positive('mass', total)
    if options.masses == 'proportions':
        heads = [group.bone for group in groups]
        shares = masses.by_proportions(volumes, [roles[bone] for bone in heads], [
            side_of(character.bone_names[bone]) for bone in heads], total)
    else:
        shares = masses.by_volume(volumes, total)
    return [float(f'{share:.9g}') for share in shares]


def _body(character: Character, group: Group, fitted: Fitted, axes: Axes, mass: float,
          roles: tuple[str | None, ...]) -> BodyFit:
    turn = np.round(rotation.from_matrix(axes.frame), 12)
    bone = Bone(character.bone_names[group.bone], fitted.shape, mass,
                np.round(fitted.centre, DECIMALS) + 0.0, turn + 0.0)
    points = character.vertices[group.vertices[group.vertices < len(character.vertices)]]
    local = rotation.rotate(rotation.inverse(np.array(bone.orientation)), points - bone.position)
    inside = int((bone.shape.signed_distance(local) <= TOLERANCE).sum()) if len(points) else 0
    return BodyFit(bone, tuple(character.bone_names[b] for b in group.bones), roles[group.bone],
                   len(points), inside, axes)


def _joint(character: Character, groups: list[Group], index: int,
           roles: tuple[str | None, ...], directions: list[np.ndarray]) -> Joint:
    group = groups[index]
    parent = groups[group.parent]
    name, above_name = (character.bone_names[g.bone] for g in (group, parent))
    anchor = np.round(character.positions[group.bone], DECIMALS) + 0.0
    if group.tied:
        return Joint(above_name, name, 'fixed', anchor)
    above = None
    step = character.positions[group.bone] - character.positions[parent.bone]
    length = float(np.linalg.norm(step))
    if parent.parent >= 0 and length > 1e-6:
        above = step / length
    children = [sum(g.parent == k for g in groups) for k in (index, group.parent)]
    side = side_of(name) or int(np.sign(anchor[1]))
    return make_joint(above_name, name, roles[group.bone], side, anchor, above,
                      directions[index], children[0] <= 1 and children[1] == 1)


def _swings(character: Character, groups: list[Group], bodies: list[BodyFit],
            notes: list[str]) -> tuple[Swing, ...]:
    """Each spring of the character, on the body that carries the bone it hangs from."""
    carrier = _carriers(groups, bodies)
    swings = []
    for spring in character.springs:
        swing, cut = swing_of(spring, spring.name, carrier[spring.carrier].name, character.scale)
        swings.append(swing)
        if cut:
            notes.append(f'spring {spring.name} has too much gravity: a share of '
                         f'{swing.gravity:g} is taken')
    return tuple(swings)


def _carriers(groups: list[Group], bodies: list[BodyFit]) -> dict[int, Bone]:
    return {bone: body.bone for group, body in zip(groups, bodies, strict=True)
            for bone in group.bones}


def _riders(character: Character, groups: list[Group],
            bodies: list[BodyFit]) -> tuple[SkeletonFrame, ...]:
    """Every bone of the skeleton, fixed on the body that carries it, the skeleton's order."""
    carrier = _carriers(groups, bodies)
    riders = []
    for index, name in enumerate(character.bone_names):
        body = carrier[index]
        back = rotation.inverse(np.array(body.orientation))
        position = rotation.rotate(back, character.positions[index] - body.position)
        turn = rotation.multiply(back, character.orientations[index])
        riders.append(SkeletonFrame(name, body.name, np.round(position, 12) + 0.0,
                            np.round(turn, 12) + 0.0))
    return tuple(riders)

"""From a character to a doll, step by step: cluster, group, shape, weigh, joint, carry.

Everything is in the bind pose and the doll's frame, which is the character's.
"""
from __future__ import annotations

import glob
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ..model import errors, rotation
from ..model.pose import Pose
from ..model.ragdoll import Bone, Ragdoll
from ..model.scene import Placement
from ..model.shapes import Shape
from . import carried
from .bodies.masses import share_mass
from .bodies.overlap import colliding_pairs
from .bodies.refine import refined
from .bodies.trim import trimmed
from .joints.folding import guesses
from .joints.joints import damped, make_joint
from .reading.character import Character
from .reading.spring_bones import Spring, without_short_rods
from .roles.names import roles_of
from .shapes.axes import Axes, fit_axes
from .shapes.shapes import DECIMALS, TOLERANCE, Fitted, fit_best, fit_shape
from .skeleton.anchors import place_anchors
from .skeleton.apart import find_characters
from .skeleton.groups import Group, group_bones, partner, vertices_by_bone
from .skeleton.kept import find_kept
from .skeleton.skin_tree import SkinTree, find_skin_tree
from .skeleton.soft_chains import soft_chains, thinned

THINNEST = 0.01
"""No body is thinner than this share of the whole character."""


MOST_ASKED_FOR = 200
"""Bodies that a doll may have where the user says how small: a tick of it takes 0.2 s."""


@dataclass(frozen=True)
class Options:
    """What the user may choose."""

    shape: str = 'best'
    """Kind of all bodies' shapes; 'best': of each, the kind that holds its skin in least volume."""
    orientation: str = 'principal'
    """z along the 'principal' axis where one stands out, or along the 'bone' always."""
    share: float | None = None
    """Skin weight from which on a vertex counts for a bone; None: the bone with the largest."""
    smallest: float | None = None
    """m; bones with a shorter cluster get no body. None: a share of the character."""
    mass: float | None = None
    """kg, of the whole doll; None: as much water as the skin holds."""
    masses: str = 'best'
    """Mass shared by the skin's 'volume', by a person's 'proportions', or 'best'; see masses.py."""
    keep: tuple[str, ...] = ()
    """Names of bones, or patterns of them, that become bodies whatever their size."""


@dataclass(frozen=True)
class BodyFit:
    """How one body came about, and how good it is."""

    bone: Bone
    bones: tuple[str, ...]
    """Names of the character's bones that became it."""
    role: str | None
    vertices: int
    """How many of the character's own vertices it stands for."""
    inside: int
    """How many of these are within TOLERANCE of it or in it."""
    axes: Axes


@dataclass(frozen=True)
class Fit:
    """A doll and how it came about; ``bodies`` in the order of the doll's bones."""

    doll: Ragdoll
    character: Character
    bodies: tuple[BodyFit, ...]
    notes: tuple[str, ...]
    """A sentence for each thing that could not be taken over as it is."""
    frame: Pose = field(default_factory=Pose)
    """Where the doll's frame stands in its file's."""

    def placed(self, model: str | None = None) -> Placement:
        """The doll where it stands in its file, whose path it names as its ``model``."""
        return Placement(replace(self.doll, model=model), position=self.frame.position,
                         orientation=self.frame.orientation)


def fit_characters(character: Character, options: Options | None = None) -> list[Fit]:
    """A doll of each character of a file, see apart.py, as fit_character makes it."""
    options = options or Options()
    names = character.bone_names
    kept = {names[bone] for bone in find_kept(character, options.keep, options.share)}
    fits = []
    for each, frame in find_characters(character):
        own = tuple(glob.escape(name) for name in each.bone_names if name in kept)
        fits.append(replace(fit_character(each, replace(options, keep=own)), frame=frame))
    return fits


def fit_character(character: Character, options: Options | None = None) -> Fit:
    """Doll of one character, in its bind pose; ModelError where an option is out of range."""
    options = options or Options()
    given = character
    character, groups, notes = _grouped(refined(given), options)
    notes += _unmoved(character, len(given.vertices), groups)
    directions = [_direction(character, groups, index) for index in range(len(groups))]
    areas = character.vertex_areas()
    axes = [fit_axes(character.vertices[group.vertices], areas[group.vertices], direction,
                     options.orientation)
            for group, direction in zip(groups, directions, strict=True)]
    frames = [own.frame for own in axes]
    fits = trimmed(groups, place_anchors(
        groups, _fit_shapes(character, groups, axes, options.shape), frames), frames)
    masses = share_mass(options.mass, options.masses, given, groups,
                        [fit.shape.volume for fit in fits], notes)
    bodies = [_body(given, *parts) for parts in zip(groups, fits, axes, masses, strict=True)]
    bones = [body.bone for body in bodies]
    joints = [damped(make_joint(character, groups, index, directions[index]),
                     bones[group.parent], bones[index])
              for index, group in enumerate(groups) if group.parent >= 0]
    notes += guesses(character, groups, directions)
    notes += [f'no bone joins {group.name} to the rest: it is tied to {groups[group.parent].name}'
              for group in groups if group.tied]
    carrier = {index: bone for group, bone in zip(groups, bones, strict=True)
               for index in group.bones}
    swings = carried.swings(character, carrier, notes)
    doll = Ragdoll(character.name, tuple(bones), tuple(joints), swings,
                   carried.skeleton_frames(character, carrier))
    doll = replace(doll, no_collision=colliding_pairs(doll))
    return Fit(doll, given, tuple(bodies), tuple(notes))


def _grouped(character: Character,
             options: Options) -> tuple[Character, list[Group], list[str]]:
    """The character with all its springs, the groups of its bones, and what is to be told."""
    kept = find_kept(character, options.keep, options.share)
    character = replace(character, springs=tuple(_without_kept(character.springs, kept)))
    swinging = frozenset(bone for spring in character.springs for bone in spring.bones)
    clusters = vertices_by_bone(character, options.share, swinging)
    tree = find_skin_tree(character, clusters, roles_of(character.bone_names, character.parents))
    roles = _roles_along(tree, character.bone_names)
    springs = _without_kept(soft_chains(character, tree, roles, clusters), kept)
    swinging |= {bone for spring in springs for bone in spring.bones}
    groups = group_bones(character, roles, clusters, tree, options.smallest, swinging, kept)
    notes = list(character.notes)
    if options.smallest is None:
        before = len(groups)
        groups, thin = thinned(character, groups, kept)
        springs += thin
        if thin:
            notes.append(f'{before} bodies are too many: the {len(thin)} thinnest branches became '
                         'swings, which collide with nothing')
    if len(groups) > MOST_ASKED_FOR:
        key, value, better = ('keep', options.keep, 'fewer') if options.smallest is None else (
            'smallest', options.smallest, 'a larger one')
        raise errors.OutOfRange(key, value, f'{better}, for {len(groups)} bodies are more than '
                                f'{MOST_ASKED_FOR}')
    springs = [without_short_rods(spring, notes) for spring in springs]
    springs = [spring for spring in springs if spring.rods]
    return replace(character, springs=(*character.springs, *springs)), groups, notes


def _without_kept(springs: Iterable[Spring], kept: frozenset[int]) -> list[Spring]:
    """The springs none of whose bones is to be a body."""
    return [spring for spring in springs if not kept & set(spring.bones)]


def _roles_along(tree: SkinTree, names: tuple[str, ...]) -> tuple[str | None, ...]:
    """Role of each bone by its name and its neighbours in the tree."""
    order = tree.order
    place = {bone: index for index, bone in enumerate(order)}
    found = roles_of(tuple(names[bone] for bone in order),
                     tuple(place.get(tree.parents[bone], -1) for bone in order))
    roles = [found[place[bone]] for bone in range(len(names))]
    for half in tree.halves:
        roles[half] = roles[tree.parents[half]] = 'hips'
    return tuple(roles)


def _unmoved(character: Character, given: int, groups: list[Group]) -> list[str]:
    """Note on the vertices that no bone moves; where none is moved at all, the root takes them.

    Of the character's own vertices, which are the first ``given``.
    """
    unmoved = int((character.weights[:given].sum(axis=1) == 0).sum())
    if unmoved == given:
        root = next(group for group in groups if group.parent < 0)
        root.vertices = np.arange(len(character.vertices))
        return ['all weights are zero: the root takes the whole skin']
    return [f'{unmoved} vertices have no weight: no body holds them'] if unmoved else []


def _direction(character: Character, groups: list[Group], index: int) -> np.ndarray:
    """Unit direction (3,) of a group's bone: to its children's roots, else to its skin's mean."""
    group = groups[index]
    root = group.anchor
    points = character.vertices[group.vertices]
    mean = points.mean(axis=0) - root if len(points) else np.zeros(3)
    children = [g.anchor - root for g in groups if g.parent == index]
    steps = [np.mean(children, axis=0)] if children else []
    if not points.size:
        steps += [character.positions[bone] - root for bone in group.bones[1:]]
    least = 0.05 * float(np.ptp(points, axis=0).max()) if len(points) else 1e-6
    for step in [*steps, mean]:
        length = float(np.linalg.norm(step))
        if length > max(least, 1e-6):
            return step / length
    return np.array([0.0, 0.0, 1.0])


def _fit_shapes(character: Character, groups: list[Group], axes: list[Axes],
                kind: str) -> list[Fitted]:
    """Shape of each group, its centre in the doll's frame; left and right have the same kind."""
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
    return [Fitted(fits[index].shape, own.frame @ fits[index].centre, fits[index].share)
            for index, own in enumerate(axes)]


def _rounded(shape: Shape) -> Shape:
    return type(shape)(**{key: tuple(round(float(edge), DECIMALS) for edge in value)
                          if isinstance(value, tuple) else round(float(value), DECIMALS)
                          for key, value in vars(shape).items()})


def _body(character: Character, group: Group, fitted: Fitted, axes: Axes, mass: float) -> BodyFit:
    bone = Bone(group.name, _rounded(fitted.shape), mass, np.round(fitted.centre, DECIMALS) + 0.0,
                np.round(rotation.from_matrix(axes.frame), 12) + 0.0)
    points = character.vertices[group.vertices[group.vertices < len(character.vertices)]]
    off = bone.shape.signed_distance(bone.pose.apply_inverse(points))
    return BodyFit(bone, tuple(character.bone_names[b] for b in group.bones), group.role,
                   len(points), int(np.count_nonzero(off <= TOLERANCE)), axes)

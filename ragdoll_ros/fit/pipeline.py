"""Fit of a doll to a character: cluster, group, fit shapes, weigh, joint, attach.

All in the bind pose, in the doll's frame, which is the character's.
"""
import glob
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ..files.bone_names.names import roles_of
from ..model import errors, rotation
from ..model.pose import Pose
from ..model.ragdoll import Bone, Ragdoll, SkeletonFrame
from ..model.scene import Placement
from ..model.shapes import Shape
from ..model.swing import Collider, Swing
from .bodies.masses import share_mass
from .bodies.overlap import colliding_overlaps
from .bodies.subdivide import subdivide
from .bodies.trim import place_anchors, trim_overlaps
from .joints.folding import note_guesses
from .joints.make_joint import make_joint, with_damping
from .reading.character import Character
from .reading.spring_bones import SpringBone, drop_short_segments
from .reading.spring_colliders import SpringCollider, has_size
from .reading.spring_to_swing import swing_from_spring
from .shapes.axes import Axes, fit_axes
from .shapes.fitting import DECIMALS, TOLERANCE, FittedShape, fit_best, fit_shape
from .skeleton.forced_bodies import find_forced_bodies
from .skeleton.groups import BodyGroup, group_bones, mirrored_group, vertices_by_bone
from .skeleton.skin_tree import SkinTree, find_skin_tree
from .skeleton.soft_chains import limit_bodies, soft_chains, thin_chains
from .skeleton.split_characters import split_characters

MIN_THICKNESS = 0.01
"""Smallest thickness of a body, as a fraction of the character's extent."""

MAX_REQUESTED_BODIES = 200
"""Bodies of a doll on request (``smallest``, ``keep``): a tick of so many takes 0.2 s."""


@dataclass(frozen=True)
class FitOptions:
    """Options of a fit."""

    shape: str = 'best'
    """Shape kind of all bodies; 'best': for each body the kind with the smallest volume."""
    orientation: str = 'principal'
    """z of a body along its 'principal' axis if it is elongated, or always along the 'bone'."""
    weight: float | None = None
    """Skin weight from which on a vertex belongs to a bone; None: to the one with the largest."""
    smallest: float | None = None
    """m; bones with a shorter cluster get no body. None: a fraction of the character's extent."""
    mass: float | None = None
    """kg, of the whole doll; None: the skin's volume times the density of water."""
    masses: str = 'best'
    """Mass distribution by skin 'volume', by a person's 'proportions', or 'best'; see masses.py."""
    keep: tuple[str, ...] = ()
    """Names or patterns of bones that become bodies whatever their size."""
    tree: str = 'auto'
    """Whose tree of bones: the 'file''s, the 'skin''s, or 'auto'; see skin_tree.TREES."""
    root: str | None = None
    """Name of the bone that is the root; None: found in the trunk."""


@dataclass(frozen=True)
class BodyFit:
    """Fit of one body, and its quality."""

    bone: Bone
    bones: tuple[str, ...]
    """Names of the character's bones in it."""
    role: str | None
    vertices: int
    """Number of the character's vertices that belong to it."""
    inside: int
    """Number of these inside it, to within TOLERANCE."""
    axes: Axes


@dataclass(frozen=True)
class Fit:
    """A doll and how it was fitted; ``bodies`` are in the order of the doll's bones."""

    doll: Ragdoll
    character: Character
    bodies: tuple[BodyFit, ...]
    notes: tuple[str, ...]
    """Warnings: what could not be imported as it is in the file, and what was assumed."""
    frame: Pose = field(default_factory=Pose)
    """Pose of the doll's frame in its file's."""

    def placed(self, model: str | None = None) -> Placement:
        """The doll at its pose in the file; ``model`` is the path of the file."""
        return Placement(replace(self.doll, model=model), position=self.frame.position,
                         orientation=self.frame.orientation)


def fit_characters(character: Character, options: FitOptions | None = None) -> list[Fit]:
    """Dolls of all characters of a file, as from fit_character; see split_characters.py."""
    options = options or FitOptions()
    names = character.bone_names
    forced = {names[bone] for bone in find_forced_bodies(character, options.keep, options.weight)}
    if options.root is not None and options.root not in names:
        raise errors.UnknownBone('root', options.root, errors.one_of(names, options.root))
    fits = []
    for each, frame in split_characters(character):
        own = tuple(glob.escape(name) for name in each.bone_names if name in forced)
        root = options.root if options.root in each.bone_names else None
        fits.append(replace(fit_character(each, replace(options, keep=own, root=root)),
                            frame=frame))
    return fits


def fit_character(character: Character, options: FitOptions | None = None) -> Fit:
    """Doll of one character in its bind pose; raises a ModelError for an option out of range."""
    options = options or FitOptions()
    given = character
    character, groups, notes = _group_character(subdivide(given), options)
    notes += _note_unweighted(character, len(given.vertices), groups)
    directions = [_bone_direction(character, groups, index) for index in range(len(groups))]
    areas = character.vertex_areas()
    axes = [fit_axes(character.vertices[group.vertices], areas[group.vertices], direction,
                     options.orientation)
            for group, direction in zip(groups, directions, strict=True)]
    frames = [own.frame for own in axes]
    fits = trim_overlaps(groups, place_anchors(
        groups, _fit_shapes(character, groups, axes, options.shape), frames), frames)
    masses = share_mass(options.mass, options.masses, given, groups,
                        [fit.shape.volume for fit in fits], notes)
    bodies = [_body_fit(given, *parts) for parts in zip(groups, fits, axes, masses, strict=True)]
    bones = [body.bone for body in bodies]
    joints = [with_damping(make_joint(character, groups, index, directions[index]),
                     bones[group.parent], bones[index])
              for index, group in enumerate(groups) if group.parent >= 0]
    notes += note_guesses(character, groups, directions)
    notes += [f'no bone connects {group.name} to the rest: a fixed joint attaches it to '
              f'{groups[group.parent].name}'
              for group in groups if group.fixed]
    carrier = {index: bone for group, bone in zip(groups, bones, strict=True)
               for index in group.bones}
    links = _links_of_bones(character, carrier)
    carrier |= {bone: carrier[character.springs[number].carrier]
                for bone, (number, _) in links.items()}
    doll = Ragdoll(character.name, tuple(bones), tuple(joints),
                   _swings(character, carrier, links, notes),
                   _skeleton_frames(character, carrier))
    doll = replace(doll, no_collision=colliding_overlaps(doll))
    return Fit(doll, given, tuple(bodies), tuple(notes))


def _group_character(character: Character,
                     options: FitOptions) -> tuple[Character, list[BodyGroup], list[str]]:
    """The character with all its spring bones, the groups of its bones, and notes."""
    forced = find_forced_bodies(character, options.keep, options.weight)
    character = replace(character, springs=tuple(_without_forced(character.springs, forced)))
    swinging = frozenset(bone for spring in character.springs for bone in spring.bones)
    clusters = vertices_by_bone(character, options.weight, swinging)
    tree = find_skin_tree(character, clusters, roles_of(character.bone_names, character.parents),
                          options.tree, options.root)
    roles = _roles_along(tree, character.bone_names)
    springs = _without_forced(soft_chains(character, tree, roles, clusters), forced)
    swinging |= {bone for spring in springs for bone in spring.bones}
    notes = list(character.notes)
    if options.smallest is None:
        thin = _without_forced(thin_chains(character, tree, roles, clusters, swinging), forced)
        notes += _note_thin(thin)
        springs += thin
        swinging |= {bone for spring in thin for bone in spring.bones}
    groups = group_bones(character, roles, clusters, tree, options.smallest, swinging, forced)
    if options.smallest is None:
        before = len(groups)
        groups, thin = limit_bodies(character, groups, forced)
        springs += thin
        if thin:
            notes.append(f'{before} bodies are too many: the {len(thin)} thinnest branches became '
                         'swings, which do not collide')
    if len(groups) > MAX_REQUESTED_BODIES:
        key, value, better = ('keep', options.keep, 'fewer') if options.smallest is None else (
            'smallest', options.smallest, 'a larger one')
        raise errors.OutOfRange(key, value, f'{better}, for {len(groups)} bodies are more than '
                                f'{MAX_REQUESTED_BODIES}')
    springs = [drop_short_segments(spring, notes) for spring in springs]
    springs = [spring for spring in springs if spring.joints]
    return replace(character, springs=(*character.springs, *springs)), groups, notes


def _note_thin(springs: list[SpringBone]) -> list[str]:
    """Note on thin chains that became swings, and what to do where that is wrong."""
    if not springs:
        return []
    names = ', '.join(spring.name for spring in springs[:4]) + ', ...' * (len(springs) > 4)
    return [f'thin chains of bones without a known name became swings: {names}; --keep and their '
            'bones makes bodies of them, and without its entry in swings of the doll a chain is '
            'fixed to its bone']


def _without_forced(springs: Iterable[SpringBone], forced: frozenset[int]) -> list[SpringBone]:
    """The spring bones that contain no forced body."""
    return [spring for spring in springs if not forced & set(spring.bones)]


def _roles_along(tree: SkinTree, names: tuple[str, ...]) -> tuple[str | None, ...]:
    """Role of each bone by its name and its neighbours in the skin tree."""
    order = tree.order
    place = {bone: index for index, bone in enumerate(order)}
    found = roles_of(tuple(names[bone] for bone in order),
                     tuple(place.get(tree.parents[bone], -1) for bone in order))
    roles = [found[place[bone]] for bone in range(len(names))]
    for half in tree.halves:
        roles[half] = roles[tree.parents[half]] = 'hips'
    return tuple(roles)


def _note_unweighted(character: Character, given: int, groups: list[BodyGroup]) -> list[str]:
    """Note on unweighted vertices; if all are, the root gets the whole skin.

    Only the first ``given`` vertices, those before subdivision, are counted.
    """
    unweighted = int((character.weights[:given].sum(axis=1) == 0).sum())
    if unweighted == given:
        root = next(group for group in groups if group.parent < 0)
        root.vertices = np.arange(len(character.vertices))
        return ['all weights are zero: the root takes the whole skin']
    return [f'{unweighted} vertices have no weight: no body covers them'] if unweighted else []


def _bone_direction(character: Character, groups: list[BodyGroup], index: int) -> np.ndarray:
    """Unit direction (3,) of a group's bone: to its children's anchors, else to its skin's mean."""
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


def _fit_shapes(character: Character, groups: list[BodyGroup], axes: list[Axes],
                kind: str) -> list[FittedShape]:
    """Shape of each group, its centre in the doll's frame; left and right are of the same kind."""
    extent = character.extent
    sizes = (MIN_THICKNESS * extent, min(TOLERANCE, 0.006 * extent))
    clouds = [(character.vertices[group.vertices] if len(group.vertices)
               else character.positions[[group.bone]]) @ own.frame
              for group, own in zip(groups, axes, strict=True)]
    fits: dict[int, FittedShape] = {}
    for index, cloud in enumerate(clouds):
        if kind != 'best':
            fits[index] = fit_shape(cloud, kind, *sizes)
        elif index not in fits:
            pair = sorted({index, mirrored_group(character, groups, index)})
            fits.update(zip(pair, fit_best([clouds[k] for k in pair], *sizes), strict=True))
    return [FittedShape(fits[index].shape, own.frame @ fits[index].centre, fits[index].coverage)
            for index, own in enumerate(axes)]


def _rounded(shape: Shape) -> Shape:
    return type(shape)(**{key: tuple(round(float(edge), DECIMALS) for edge in value)
                          if isinstance(value, tuple) else round(float(value), DECIMALS)
                          for key, value in vars(shape).items()})


def _body_fit(character: Character, group: BodyGroup, fitted: FittedShape, axes: Axes,
              mass: float) -> BodyFit:
    bone = Bone(group.name, _rounded(fitted.shape), mass, np.round(fitted.centre, DECIMALS) + 0.0,
                np.round(rotation.from_matrix(axes.frame), 12) + 0.0)
    points = character.vertices[group.vertices[group.vertices < len(character.vertices)]]
    off = bone.shape.signed_distance(bone.pose.apply_inverse(points))
    return BodyFit(bone, tuple(character.bone_names[b] for b in group.bones), group.role,
                   len(points), int(np.count_nonzero(off <= TOLERANCE)), axes)


def _skeleton_frames(character: Character, carrier: dict[int, Bone]) -> tuple[SkeletonFrame, ...]:
    """Frame of every bone of the skeleton, fixed to a body, in the skeleton's order.

    ``carrier`` maps the index of a character's bone to that body.
    """
    frames = []
    for index, name in enumerate(character.bone_names):
        body = carrier[index]
        pose = body.pose.relative(Pose(character.positions[index], character.orientations[index]))
        frames.append(SkeletonFrame(name, body.name, *(np.round(part, 12) + 0.0 for part in pose)))
    return tuple(frames)


def _links_of_bones(character: Character, carrier: dict[int, Bone]) -> dict[int, tuple[int, int]]:
    """Indices of the spring bone and of its link, for each bone that one of them moves.

    These are the bones of the chains, and the bones below them in the file that are not part of
    another body.
    """
    found = {bone: (number, link) for number, spring in enumerate(character.springs)
             for bone, link in zip(spring.bones, spring.links, strict=True)}
    for bone, up in enumerate(character.parents):
        if bone not in found and up in found and carrier[bone].name != character.bone_names[bone]:
            root = character.springs[found[up][0]].carrier
            if carrier[bone] is carrier[root]:
                found[bone] = found[up]
    return found


def _swings(character: Character, carrier: dict[int, Bone], links: dict[int, tuple[int, int]],
            notes: list[str]) -> tuple[Swing, ...]:
    """The character's spring bones as swings; a note reports gravity that had to be clamped."""
    made = []
    for number, spring in enumerate(character.springs):
        swing, cut = swing_from_spring(spring, carrier[spring.carrier].name, character.scale)
        riders = [tuple(character.bone_names[bone] for bone, of in links.items()
                        if of == (number, link)) for link in range(len(swing.links))]
        colliders = tuple(_collider(collider, carrier[collider.bone].name)
                          for collider in spring.colliders if has_size(collider))
        made.append(replace(swing, colliders=colliders, links=tuple(
            replace(link, riders=own, radius=round(joint.radius * character.scale, DECIMALS)
                    if colliders else 0.0)
            for link, own, joint in zip(swing.links, riders, spring.joints, strict=True))))
        if cut:
            notes.append(f'gravity of spring {spring.name} is clamped to a factor of '
                         f'{swing.gravity:g}')
    return tuple(made)


def _collider(collider: SpringCollider, bone: str) -> Collider:
    at, to = np.round(collider.axis, DECIMALS) + 0.0
    return Collider(bone, round(collider.radius, DECIMALS), at, None if (at == to).all() else to)

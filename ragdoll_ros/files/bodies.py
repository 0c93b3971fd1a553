"""`bodies:` of a scene, each alone or repeated: static ones, loose ones, which have a mass, and
driven ones, which follow what they are told.
"""
import dataclasses
import itertools
import math
from pathlib import Path
from typing import NamedTuple

from ..model.compound import Compound
from ..model.errors import ModelError, OutOfRange, WrongForm
from ..model.follow import Follow
from ..model.mesh import Hull, Surface
from ..model.plane import Plane
from ..model.pose import Pose
from ..model.ragdoll import Bone, Ragdoll
from ..model.robot import Robot
from ..model.rotation import IDENTITY
from ..model.scene import Placement
from ..model.shapes import Part, Shape
from ..model.static_body import DEFAULT_COLOR, StaticBody
from ..model.vectors import floats
from .doll import build_shape, shape_data
from .repeat import Placed, repeated
from .robots.robot_bodies import NOMINAL_MASS, OPTIONS, PARSERS, PlacedRobot, read_robot
from .schema import entries, has_error_under, try_build
from .surfaces import build_surface, surface_data, surface_kind

MOST_BODIES = 100_000

MOTION = ('velocity', 'spin')
"""Keys of loose bodies alone."""

EXACT = 'exact'


class SceneBodies(NamedTuple):
    """The bodies and robots that `bodies:` of a scene defines."""

    static: list[StaticBody]
    loose: list[Placement]
    """All others, as dolls of one bone."""
    robots: list[Robot]
    """What moves some of them."""
    static_entries: list[str]
    """Of each static body, the path of its entry: bodies[0]."""
    loose_entries: list[str]


def build_bodies(data: dict, folder: Path, found: list[ModelError]) -> SceneBodies:
    """The bodies of a scene's data. Appends every error to ``found``. Paths are relative to
    ``folder``.
    """
    static, loose, robots, *_ = bodies = SceneBodies([], [], [], [], [])
    for index, entry in enumerate(entries(data, 'bodies')):
        where = f'bodies[{index}]'
        if has_error_under(found, where):
            continue
        if PARSERS.keys() & entry.keys():
            copies = _copies(_robot(entry, folder, where, found), entry)
            if 'follow' in entry:
                loose += itertools.islice(itertools.chain.from_iterable(
                    copy.placements() for copy in copies), MOST_BODIES + 1)
                robots += [copy.robot() for copy in copies]
            else:
                static += itertools.islice(itertools.chain.from_iterable(
                    copy.bodies() for copy in copies), MOST_BODIES + 1)
        elif _moves(entry):
            loose += _copies(try_build(found, where, _loose_body, entry, folder), entry)
        else:
            static += _copies(try_build(found, where, _static_body, entry, folder), entry)
        for made, made_by in ((static, bodies.static_entries), (loose, bodies.loose_entries)):
            made_by += [where] * (len(made) - len(made_by))
        if len(static) + len(loose) > MOST_BODIES:
            found.append(OutOfRange(where, len(static) + len(loose),
                                    f'at most {MOST_BODIES} bodies in all'))
            break
    return bodies


def follow_of(entry: dict) -> Follow | None:
    """``follow`` of an entry of a scene."""
    value = entry.get('follow')
    return value if value is None else Follow() if value == EXACT else Follow(**value)


def follow_data(follow: Follow) -> str | dict:
    """``follow`` in the form of scene.schema.json."""
    return EXACT if follow.is_exact else dict(vars(follow))


def body_data(body: StaticBody) -> dict:
    """A body as lists and numbers in the form of scene.schema.json."""
    optional = {'orientation': None if body.orientation == IDENTITY else list(body.orientation),
                'friction': body.friction, 'rolling_friction': body.rolling_friction,
                'restitution': body.restitution,
                'stiffness': body.stiffness if math.isfinite(body.stiffness) else None,
                'color': None if body.color is None else list(body.color)}
    shape = surface_data if isinstance(body.shape, Surface | Plane) else shape_data
    return {'name': body.name, **shape(body.shape), 'position': list(body.position),
            **{key: value for key, value in optional.items() if value is not None}}


def _copies(first: Placed | None, entry: dict) -> list[Placed]:
    if first is None:
        return []
    return repeated(first, entry['repeat']) if 'repeat' in entry else [first]


def _robot(entry: dict, folder: Path, where: str, found: list[ModelError]) -> PlacedRobot | None:
    """The robot of an entry with a file. Appends every error to ``found``."""
    for key in ('mass', 'stiffness', *MOTION):
        if key in entry:
            found.append(WrongForm(f'{where}.{key}', entry[key],
                                   'none: a robot never moves, or as it is told, by `follow`'))
    if entry.get('follow', EXACT) != EXACT:
        found.append(WrongForm(f'{where}.follow', entry['follow'],
                               'exact; as a doll with fixed_root and motors a robot gives way'))
    robot, more = read_robot(entry, folder)
    found += [error.at(where) for error in more]
    return robot


def _moves(entry: dict) -> bool:
    return 'mass' in entry or 'follow' in entry


def _static_body(entry: dict, folder: Path) -> StaticBody:
    for key in MOTION:
        if key in entry:
            raise WrongForm(key, entry[key], 'a mass as well: a body without one never moves')
    _check_options(entry)
    fields = {key: value for key, value in entry.items()
              if key not in ('shape', 'shapes', 'repeat')}
    shape = build_surface(entry, folder) if surface_kind(entry) else build_shape(entry, folder)
    return StaticBody(shape=shape, **fields)


def _loose_body(entry: dict, folder: Path) -> Placement:
    """Build a doll of one bone, a uniform solid; the doll's frame is that of the body's shape."""
    _check_options(entry)
    if 'stiffness' in entry:
        raise WrongForm('stiffness', entry['stiffness'], 'none: of bodies that never move only')
    kind = surface_kind(entry)
    if kind and kind != Hull.kind:
        key = 'mass' if 'mass' in entry else 'follow'
        raise WrongForm(key, entry[key], f'none: a {kind} never moves')
    shape: Shape | Compound
    shape, follow = _moving_shape(entry, kind, folder), follow_of(entry)
    if 'mass' not in entry and follow and not follow.is_exact:
        raise WrongForm('follow', entry['follow'], 'a mass as well, which the force moves')
    # A bone's frame has its centre of mass and principal axes.
    pose = shape.principal_pose() if isinstance(shape, Compound) else Pose()
    if isinstance(shape, Compound):
        shape = shape.in_frame(pose)
    surface = {key: entry[key] for key in ('friction', 'rolling_friction', 'restitution')
               if key in entry}
    bone = Bone(entry['name'], shape, entry.get('mass', NOMINAL_MASS), floats(pose.position),
                floats(pose.orientation), color=tuple(entry.get('color', DEFAULT_COLOR)), **surface)
    start = {key: entry[key] for key in ('position', 'orientation', *MOTION) if key in entry}
    return Placement(Ragdoll(entry['name'], (bone,)), follow=follow, **start)


def _moving_shape(entry: dict, kind: str | None, folder: Path) -> Shape | Compound:
    """Return the shape of a body that moves; a single hull becomes a Compound of one part."""
    if kind is None:
        return build_shape(entry, folder)
    hull = build_surface(entry, folder)
    assert isinstance(hull, Hull)
    return Compound((Part(dataclasses.replace(hull, source=None)),))


def _check_options(entry: dict) -> None:
    for key in OPTIONS:
        if key in entry:
            raise WrongForm(key, entry[key], "urdf or sdf as well: it is of the file's links")

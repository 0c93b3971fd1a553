"""Scenes as YAML files (config/scene.schema.json): reading with all errors at once, writing."""
import dataclasses
import functools
import math
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from ..model.errors import (
    ModelError,
    ModelErrors,
    OutOfRange,
    UnknownAnimation,
    Unreadable,
    WrongForm,
    one_of,
)
from ..model.motors import Motors
from ..model.per_doll import PerDoll
from ..model.playback import Playback
from ..model.ragdoll import Ragdoll
from ..model.scene import Ground, Material, Placement, Scene, above_ground
from . import config, yaml_text
from .animation import Animation, load_animations, placed
from .bodies import body_data, build_bodies, follow_data, follow_of
from .doll import build_doll, doll_data, relative_path
from .repeat import repeated
from .robots.mesh_file import find_file
from .robots.robot_data import build_robots, robots_data
from .schema import (
    has_error_under,
    is_marked,
    read_by_name,
    schema_errors,
    try_build,
    value_or_raise,
)

MOST_DOLLS = 1000

ANGLE_KEYS = {'angles': 'angles_deg', 'rates': 'rates_deg_s'}
"""Key of a doll's entry for each field of a Placement that is in rad or rad/s."""

PLAYBACK_KEYS = ('start', 'speed', 'loop', 'limp_at', 'limp_above')
"""Keys of an ``animation`` that moves a doll: fields of a Playback."""


def load_scene(name: str) -> Scene:
    """Read a scene from a YAML file.

    Args:
        name: path, or name of a shipped scene or doll in config/.

    Returns:
        The scene; of a doll's file, that doll 0.4 m above level ground.

    Raises:
        ModelErrors: all errors of the file, each with its path, its value, what is expected.

    Example:
        >>> load_scene('drop').bone_names[0]
        'torso'
    """
    return scene_from_data(*read_by_name(name))


def scene_from_data(data: object, path: Path) -> Scene:
    """Build a scene from the data of a scene's or a doll's file. Raises ModelErrors."""
    if isinstance(data, dict) and 'bones' in data:
        return above_ground(value_or_raise(path, *build_doll(data, path)))
    return value_or_raise(path, *build_scene(data, path))


def save_scene(scene: Scene, path: str | Path, head: str = '') -> None:
    """Write a scene with its dolls to a YAML file, from which load_scene reads an equal one.

    Args:
        scene: the scene; paths of its dolls' ``model`` are written relative to the file.
        path: of the file.
        head: text of a comment at its top.

    Raises:
        OSError: the file can not be written.

    Example:
        >>> save_scene(load_scene('drop'), 'copy.yaml')
        >>> load_scene('copy.yaml') == load_scene('drop')
        True
    """
    Path(path).write_text(scene_text(scene, Path(path).parent, head), encoding='utf-8')


def build_scene(data: object, path: Path) -> tuple[Scene | None, list[ModelError]]:
    """Build a scene from the data of a scene's file; else None and every error."""
    found = schema_errors('scene', data)
    if not is_marked(data, 'scene'):
        return None, found
    placements: list[Any] = []
    made_by: list[str] = []
    """Of each placement, the path of its entry."""
    entries = data.get('dolls')
    # A doll that many entries share, by name or by alias, is built once.
    named = functools.cache(lambda name: _named_doll(name, path))
    inline: dict[int, tuple] = {}
    for index, entry in enumerate(entries if isinstance(entries, list) else ()):
        where = f'dolls[{index}]'
        if not isinstance(entry, dict) or 'doll' not in entry:
            continue
        source = entry['doll']
        if isinstance(source, dict):
            if id(source) not in inline:
                inline[id(source)] = build_doll(source, path.with_name('doll'))
            doll, more = inline[id(source)]
        else:
            doll, more = named(source) if isinstance(source, str) else (None, [])
        found += [error.at(f'{where}.doll') for error in more]
        if doll is not None and not has_error_under(found, where):
            doll, more = _with_swings(doll, entry, path)
            found += [error.at(where) for error in more]
        if doll is not None and not has_error_under(found, where):
            placements += try_build(found, where, _copies, doll, entry, path.parent) or []
            made_by += [where] * (len(placements) - len(made_by))
        if len(placements) > MOST_DOLLS:
            found.append(OutOfRange('dolls', len(placements), f'at most {MOST_DOLLS} in all'))
            break
    bodies = build_bodies(data, path.parent, found)
    placements += bodies.loose
    if len(placements) > MOST_DOLLS and bodies.loose:
        found.append(OutOfRange('bodies', len(placements),
                                f'at most {MOST_DOLLS} dolls and loose bodies in all'))
    parts: dict[str, Any] = {'bodies': bodies.static,
                             'robots': [*bodies.robots, *build_robots(data, found)]}
    for key, part in (('ground', Ground), ('material', Material)):
        if isinstance(data.get(key), dict) and not has_error_under(found, key):
            parts[key] = try_build(found, key, part, **data[key])
    if found:
        return None, found
    plain = {key: data[key] for key in ('gravity', 'step', 'pace', 'self_collision', 'description')
             if key in data}
    scene = try_build(found, '', Scene, data.get('name', path.stem), tuple(placements),
                      **parts, **plain)
    made = {'dolls': made_by + bodies.loose_entries, 'bodies': bodies.static_entries}
    return scene, [_at_entry(error, made) for error in found]


def _at_entry(error: ModelError, made_by: dict[str, list[str]]) -> ModelError:
    """Return an error of a name with the path of the entry that made what has the name, as `repeat`
    makes many of one entry; any other error unchanged.
    """
    place = re.fullmatch(r'(dolls|bodies)\[(\d+)\]\.name', error.path)
    if place is None:
        return error
    return type(error)(f'{made_by[place[1]][int(place[2])]}.name', error.value, error.expected)


def scene_data(scene: Scene, folder: Path | None = None,
               data_of: Callable[[Ragdoll], object] | None = None) -> dict:
    """A scene as lists and numbers in the form of scene.schema.json; see doll_data.

    Placements that share a doll share its data, which YAML writes once. ``data_of``: what to write
    for a doll instead of that data.
    """
    dolls: PerDoll[Any] = PerDoll(data_of or partial(doll_data, folder=folder))
    data: dict[str, Any] = {
        'name': scene.name, 'gravity': list(scene.gravity), 'step': scene.step,
        'pace': scene.pace, 'self_collision': scene.self_collision,
        'material': dict(vars(scene.material)), 'ground': None, 'dolls': []}
    if scene.description:
        data['description'] = scene.description
    if scene.ground is not None:
        data['ground'] = {'normal': list(scene.ground.normal), 'offset': scene.ground.offset}
        if math.isfinite(scene.ground.stiffness):
            data['ground']['stiffness'] = scene.ground.stiffness
    for placement in scene.dolls:
        entry = {'doll': dolls[placement.doll], 'name': placement.name}
        for key in ('position', 'orientation', 'velocity', 'spin'):
            entry[key] = list(getattr(placement, key))
        for name, key in ANGLE_KEYS.items():
            if values := getattr(placement, name):
                entry[key] = {angle: round(math.degrees(value), 9)
                              for angle, value in values.items()}
        if placement.follow:
            entry['follow'] = follow_data(placement.follow)
        if placement.fixed_root:
            entry['fixed_root'] = True
        if placement.motors:
            entry['motors'] = _motors_data(placement.motors)
        if placement.animation:
            entry['animation'] = _playback_data(placement.animation, folder)
            del entry['spin']
        data['dolls'].append(entry)
    if scene.bodies:
        data['bodies'] = [body_data(body) for body in scene.bodies]
    return data | robots_data(scene)


def scene_text(scene: Scene, folder: Path, head: str = '') -> str:
    """YAML of a scene for a file in ``folder``."""
    return yaml_text.to_text(scene_data(scene, folder), 'scene', head)


def _copies(doll: Ragdoll, entry: dict, folder: Path) -> list[Placement]:
    """The doll as an entry of the scene places, repeats and animates it."""
    first = _placement(doll, entry)
    if 'animation' not in entry:
        return repeated(first, entry['repeat']) if 'repeat' in entry else [first]
    animate = _animator(doll, entry, folder)
    animated = animate(first)
    if 'repeat' not in entry:
        return [animated]
    start = animated.start
    center = first.pose.apply_inverse(start.pose.apply(start.mass_centre))
    return [animate(copy) for copy in repeated(first, entry['repeat'], center)]


def _placement(doll: Ragdoll, entry: dict) -> Placement:
    """The doll as an entry of the scene places it; errors of angles are in degrees."""
    keys = 'position', 'orientation', 'velocity', 'spin', 'name', 'fixed_root'
    fields: dict[str, Any] = {key: entry[key] for key in keys if key in entry}
    for name, key in ANGLE_KEYS.items():
        fields[name] = {angle: math.radians(value) for angle, value in entry.get(key, {}).items()}
    try:
        return Placement(doll, follow=follow_of(entry), motors=_motors(entry), **fields)
    except ModelError as error:
        name, _, angle = error.path.partition('.')
        if name not in ANGLE_KEYS:
            raise
        key = ANGLE_KEYS[name]
        raise type(error)(f'{key}.{angle}', entry[key][angle], error.expected) from None


def _motors(entry: dict) -> Motors | None:
    """``motors`` of an entry; errors have their place in it."""
    try:
        return Motors(**entry['motors']) if 'motors' in entry else None
    except ModelError as error:
        raise error.at('motors') from None


def _motors_data(motors: Motors) -> dict:
    """``motors`` in the form of scene.schema.json, without what is infinite."""
    values = {key: dict(value) if isinstance(value, Mapping) else value
              for key, value in vars(motors).items()}
    return {key: value for key, value in values.items() if value != math.inf}


def _animator(doll: Ragdoll, entry: dict, folder: Path) -> Callable[[Placement], Placement]:
    """Return a function that gives a placement the animation of a doll's entry: to play, or with a
    ``time``, limp with the pose and velocities at that time.
    """
    for key in ('spin', 'follow', *ANGLE_KEYS.values()):
        if key in entry:
            raise WrongForm(key, entry[key], 'none: the animation has its own')
    wanted = entry['animation']
    animation = _animation(doll, wanted, folder)
    playing = {key: wanted[key] for key in PLAYBACK_KEYS if key in wanted}
    if 'time' in wanted and playing:
        raise WrongForm('animation.time', wanted['time'], 'either time, to start limp, or '
                        + ', '.join(playing))
    try:
        motion = animation.at(wanted['time']) if 'time' in wanted else None
    except ModelError as error:
        raise error.at('animation') from None

    def animate(placement: Placement) -> Placement:
        try:
            return (animation.play(placement, **playing) if motion is None
                    else placed(placement, motion))
        except ModelError as error:
            raise error.at('animation') from None

    return animate


def _animation(doll: Ragdoll, wanted: dict, folder: Path) -> Animation:
    """The animation that an entry names, of the doll's character or of a ``file``."""
    file = wanted.get('file')
    if file is None and 'name' not in wanted:
        raise WrongForm('animation', ', '.join(wanted), 'the missing name, or a file')
    if file is None and 'bones' in wanted:
        raise WrongForm('animation.bones', wanted['bones'], 'a file whose joints they name')
    path = file and (find_file(file, folder) or find_file(file, config.config_folder()))
    if file is not None and path is None:
        raise Unreadable('animation.file', file, 'a .bvh: a path from the scene')
    try:
        animations = load_animations(doll, path, wanted.get('bones'))
    except ModelErrors as broken:
        raise broken.errors[0].at(f'animation.({Path(broken.file).name})') from None
    except ModelError as error:
        raise error.at('animation' if file else 'doll') from None
    if file is not None:
        animation, = animations.values()
        return dataclasses.replace(animation, name=wanted.get('name', animation.name))
    name = wanted['name']
    if name not in animations:
        known = one_of(list(animations), name) if animations else (
            f'no animation: {Path(doll.model or "").name} has none')
        raise UnknownAnimation('animation.name', name, known)
    return animations[name]


def _playback_data(playback: Playback, folder: Path | None) -> dict:
    """Return a playback as ``animation`` of an entry, in the form of scene.schema.json."""
    keys = ('name', *PLAYBACK_KEYS)
    data = {key: value for key in keys if (value := getattr(playback, key)) != math.inf}
    if playback.file is not None:
        data['file'] = playback.file if folder is None else relative_path(folder, playback.file)
    return data | ({'bones': dict(playback.bones)} if playback.bones else {})


def _named_doll(name: str, path: Path) -> tuple[Ragdoll | None, list[ModelError]]:
    """Build the doll of another file; its errors have the file's name."""
    try:
        file = config.find(name, beside=path.parent)
        doll, found = build_doll(yaml_text.read(file), file)
    except ModelError as error:
        return None, [error]
    return doll, [error.at(f'({file.name})') for error in found]


def _with_swings(doll: Ragdoll, entry: dict, path: Path) -> tuple[Ragdoll | None, list[ModelError]]:
    """The doll with the swings of its scene's entry added to its own."""
    if not entry.get('swings'):
        return doll, []
    own = len(doll.swings)
    data = doll_data(doll)
    data['swings'] = data.get('swings', []) + entry['swings']
    dressed, found = build_doll(data, path)
    shift = re.compile(r'^swings\[(\d+)\]')
    return dressed, [type(error)(
        shift.sub(lambda match: f'swings[{int(match[1]) - own}]', error.path),
        error.value, error.expected) for error in found]

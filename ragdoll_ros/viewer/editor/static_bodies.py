"""Changes of static bodies: each returns a changed scene, or raises a ModelError.

A body is shown and changed as a bone: that of a stand-in, a scene of one doll of one bone with the
body's shape, pose, surface and colour.
"""
from __future__ import annotations

import dataclasses
from collections.abc import Callable

from ...model import errors
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Placement, Scene
from ...model.shapes import Box
from ...model.static_body import DEFAULT_COLOR, StaticBody
from ..widgets.form import FormValues
from . import bone_form
from .changes import NAME

FIELDS = ('shape', 'size', 'radius', 'length', 'position', 'rotation', 'friction',
          'rolling_friction', 'restitution', 'color')
"""Fields of a bone that a body has too."""

BONE = 'body'
"""Name of a stand-in's bone."""

NEW_SIZE = 0.4
"""m: edge of a body that is added."""


def find(scene: Scene, name: str) -> StaticBody:
    """The static body of a name; WrongForm lists the others."""
    for body in scene.bodies:
        if body.name == name:
            return body
    names = [body.name for body in scene.bodies]
    raise errors.WrongForm('body', name, errors.one_of(names, name))


def stand_in(scene: Scene, name: str) -> Scene:
    """A scene whose only bone has the shape, pose, surface and colour of a body."""
    body = find(scene, name)
    # With moments, shapes need not be centred.
    bone = Bone(BONE, body.shape, 1.0, body.position, body.orientation, body.friction,
                body.rolling_friction, body.restitution, body.color or DEFAULT_COLOR,
                moments=(1.0, 1.0, 1.0))
    return Scene(scene.name, (Placement(Ragdoll(BONE, (bone,))),))


def read_body(scene: Scene, name: str) -> FormValues:
    """Values of a body by the keys of FIELDS."""
    values = bone_form.read_bone(stand_in(scene, name), BONE)
    return {key: values[key] for key in FIELDS if key in values}


def change_body(scene: Scene, name: str, change: Callable[[Scene, str], Scene]) -> Scene:
    """Change a body as ``change``, of changes.py, changes a bone."""
    body, before = find(scene, name), stand_in(scene, name)
    old, new = before.bones[0], change(before, BONE).bones[0]
    changed = {key: getattr(new, key) for key in (
        'shape', 'position', 'orientation', 'friction', 'rolling_friction', 'restitution', 'color')
        if getattr(new, key) != getattr(old, key)}
    return _with_bodies(scene, [dataclasses.replace(each, **changed) if each is body else each
                                for each in scene.bodies])


def add_body(scene: Scene, name: str) -> Scene:
    """Add a cube on the ground beside the first doll; an error's path is ``name``."""
    if not NAME.fullmatch(name):
        raise errors.WrongForm('name', name, 'text without / and control characters')
    if name in {each.name for each in (*scene.dolls, *scene.bodies)}:
        raise errors.DuplicateName('name', name, 'a unique name')
    x, y, _ = scene.dolls[0].position
    place = (x + 2 * NEW_SIZE, y, NEW_SIZE / 2)
    return _with_bodies(scene, [*scene.bodies, StaticBody(name, Box((NEW_SIZE,) * 3), place)])


def remove_body(scene: Scene, name: str) -> Scene:
    """Remove a body."""
    body = find(scene, name)
    return _with_bodies(scene, [each for each in scene.bodies if each is not body])


def _with_bodies(scene: Scene, bodies: list[StaticBody]) -> Scene:
    return dataclasses.replace(scene, bodies=tuple(bodies))

"""Changes of static bodies: each returns a changed scene, or raises a ModelError.

A body is shown and changed as a bone: that of a stand-in, a scene of one doll of one bone with the
body's shape, pose, surface and colour. The bone of a mesh, a hull or a height field is its bounding
box, which scales it; that of a plane is a thin square, of a size that has no meaning.
"""
from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ...model import errors, rotation
from ...model.compound import Compound
from ...model.mesh import HeightField, Mesh, Surface
from ...model.plane import Plane
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Placement, Scene
from ...model.shapes import Box, Part
from ...model.static_body import DEFAULT_COLOR, StaticBody
from ...model.vectors import vector
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

FLAT = 1e-3
"""m: least edge of a bounding box that is shown; along it nothing is scaled."""


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
    shape, centre = body.shape, np.zeros(3)
    if isinstance(shape, Plane):
        shape = Compound((Part(Box((1.0, 1.0, FLAT))),))
    elif isinstance(shape, Surface):
        lower, upper = shape.bounds
        shape, centre = Box(vector(np.maximum(upper - lower, FLAT))), (lower + upper) / 2
    # With moments, shapes need not be centred.
    bone = Bone(BONE, shape, 1.0, vector(body.position + rotation.rotate(body.orientation, centre)),
                body.orientation, body.friction, body.rolling_friction, body.restitution,
                body.color or DEFAULT_COLOR, moments=(1.0, 1.0, 1.0))
    return Scene(scene.name, (Placement(Ragdoll(BONE, (bone,))),))


def read_body(scene: Scene, name: str) -> FormValues:
    """Values of a body by the keys of FIELDS."""
    values = bone_form.read_bone(stand_in(scene, name), BONE)
    # What has no solid parts cannot become a solid.
    kept = FIELDS if find(scene, name).shape.parts else FIELDS[1:]
    return {key: values[key] for key in kept if key in values}


def change_body(scene: Scene, name: str, change: Callable[[Scene, str], Scene]) -> Scene:
    """Change a body as ``change``, of changes.py, changes a bone."""
    body, before = find(scene, name), stand_in(scene, name)
    old, new = before.bones[0], change(before, BONE).bones[0]
    changed = {key: getattr(new, key) for key in (
        'shape', 'position', 'orientation', 'friction', 'rolling_friction', 'restitution', 'color')
        if getattr(new, key) != getattr(old, key)}
    if isinstance(body.shape, HeightField | Mesh):
        changed |= _surface_at(body.shape, old, new) if changed.keys() & {
            'shape', 'position', 'orientation'} else {}
    return _with_bodies(scene, [dataclasses.replace(each, **changed) if each is body else each
                                for each in scene.bodies])


def _surface_at(surface: HeightField | Mesh, old: Bone, new: Bone) -> dict[str, object]:
    """Shape and position of a surface whose bounding box became ``new``."""
    factors = np.divide(new.shape.size, old.shape.size)
    lower, upper = surface.bounds
    factors[upper - lower < FLAT] = 1.0
    if (factors != 1.0).any():
        surface = surface.scaled(factors)
    middle = factors * (lower + upper) / 2
    return {'shape': surface,
            'position': vector(new.position - rotation.rotate(new.orientation, middle))}


def add_body(scene: Scene, name: str) -> Scene:
    """Add a cube on the ground beside the first doll; an error's path is ``name``."""
    if not NAME.fullmatch(name):
        raise errors.WrongForm('name', name, 'text without / and control characters')
    if name in _names(scene):
        raise errors.DuplicateName('name', name, 'a unique name')
    x, y, floor = _beside_first_doll(scene)
    place = (x + NEW_SIZE / 2, y, floor + NEW_SIZE / 2)
    return _with_bodies(scene, [*scene.bodies, StaticBody(name, Box((NEW_SIZE,) * 3), place)])


def add_mesh(scene: Scene, name: str, mesh: Mesh) -> tuple[Scene, str]:
    """Add a mesh that stands beside the first doll. Also returns the body's name: ``name``, with a
    number if it is in use.
    """
    taken, free = _names(scene), name
    number = 2
    while free in taken:
        free, number = f'{name}_{number}', number + 1
    lower, upper = mesh.bounds
    place = _beside_first_doll(scene) - (lower[0], (lower[1] + upper[1]) / 2, lower[2])
    return _with_bodies(scene, [*scene.bodies, StaticBody(free, mesh, vector(place))]), free


def remove_body(scene: Scene, name: str) -> Scene:
    """Remove a body."""
    body = find(scene, name)
    return _with_bodies(scene, [each for each in scene.bodies if each is not body])


def _beside_first_doll(scene: Scene) -> np.ndarray:
    """Lowest x, middle y and lowest z (3,) m of a new body.

    z is 0 with a ground, else that of the doll.
    """
    x, y, z = scene.dolls[0].position
    return np.array((x + 1.5 * NEW_SIZE, y, z if scene.ground is None else 0.0))


def _names(scene: Scene) -> set[str]:
    return {each.name for each in (*scene.dolls, *scene.bodies)}


def _with_bodies(scene: Scene, bodies: list[StaticBody]) -> Scene:
    return dataclasses.replace(scene, bodies=tuple(bodies))

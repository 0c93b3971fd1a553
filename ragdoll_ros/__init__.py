"""A passive ragdoll: scenes and dolls as data, a simulation of them, and its errors.

The public names are imported on first access, so that a program that reads a scene loads no engine.
"""
from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .files.animation import load_animations as load_animations
    from .files.doll import load_doll as load_doll
    from .files.doll import save_doll as save_doll
    from .files.limits import load_limits as load_limits
    from .files.scene import load_scene as load_scene
    from .files.scene import save_scene as save_scene
    from .model.compound import Compound as Compound
    from .model.drive import Drive as Drive
    from .model.errors import RagdollError as RagdollError
    from .model.follow import Follow as Follow
    from .model.mesh import HeightField as HeightField
    from .model.mesh import Hull as Hull
    from .model.mesh import Mesh as Mesh
    from .model.motors import Motors as Motors
    from .model.plane import Plane as Plane
    from .model.push import Push as Push
    from .model.ragdoll import Bone as Bone
    from .model.ragdoll import Joint as Joint
    from .model.ragdoll import Ragdoll as Ragdoll
    from .model.scene import Ground as Ground
    from .model.scene import Placement as Placement
    from .model.scene import Scene as Scene
    from .model.shapes import Box as Box
    from .model.shapes import Capsule as Capsule
    from .model.shapes import Cylinder as Cylinder
    from .model.shapes import Part as Part
    from .model.shapes import Sphere as Sphere
    from .model.skeleton import Riders as Riders
    from .model.state import State as State
    from .model.static_body import StaticBody as StaticBody
    from .people.person import person as person
    from .physics.impact_uncertainty import impacts_with_uncertainty as impacts_with_uncertainty
    from .physics.run_many import run_many as run_many
    from .physics.sensors.head_injury import head_injury_criterion as head_injury_criterion
    from .physics.simulation import Simulation as Simulation
    from .recordings.recording import Recorder as Recorder
    from .recordings.save import save_recording as save_recording

_MODULES = {
    'Bone': 'model.ragdoll', 'Box': 'model.shapes', 'Capsule': 'model.shapes',
    'Compound': 'model.compound', 'Cylinder': 'model.shapes', 'Drive': 'model.drive',
    'Follow': 'model.follow', 'Ground': 'model.scene', 'HeightField': 'model.mesh',
    'Hull': 'model.mesh', 'Joint': 'model.ragdoll', 'Mesh': 'model.mesh',
    'Motors': 'model.motors',
    'Part': 'model.shapes', 'Placement': 'model.scene', 'Plane': 'model.plane',
    'Push': 'model.push',
    'Ragdoll': 'model.ragdoll', 'RagdollError': 'model.errors',
    'Recorder': 'recordings.recording', 'Riders': 'model.skeleton',
    'Scene': 'model.scene', 'Simulation': 'physics.simulation', 'Sphere': 'model.shapes',
    'State': 'model.state', 'StaticBody': 'model.static_body',
    'head_injury_criterion': 'physics.sensors.head_injury',
    'impacts_with_uncertainty': 'physics.impact_uncertainty',
    'load_animations': 'files.animation', 'load_doll': 'files.doll',
    'load_limits': 'files.limits', 'load_scene': 'files.scene', 'person': 'people.person',
    'run_many': 'physics.run_many', 'save_doll': 'files.doll',
    'save_recording': 'recordings.save', 'save_scene': 'files.scene'}
"""The module that defines each public name; the static imports above are for type checkers."""
__all__ = list(_MODULES)


if not TYPE_CHECKING:  # else every misspelt name would be an object to a type checker
    def __getattr__(name: str) -> object:
        if name not in _MODULES:
            raise AttributeError(f'ragdoll_ros has no {name!r}, but: {", ".join(_MODULES)}')
        value = getattr(importlib.import_module(f'.{_MODULES[name]}', __name__), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return [*globals(), *_MODULES]

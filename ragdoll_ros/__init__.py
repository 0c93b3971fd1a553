"""A passive ragdoll: scenes and dolls as data, a simulation that moves them, errors with it.

The names below are all that most programs need. Each is imported when it is first asked for, so
that what reads a scene loads no engine.
"""
from __future__ import annotations

import importlib

_HOMES = {
    'Bone': 'model.ragdoll', 'Box': 'model.shapes', 'Capsule': 'model.shapes',
    'Compound': 'model.compound', 'Cylinder': 'model.shapes', 'Drive': 'model.drive',
    'Ground': 'model.scene', 'Joint': 'model.ragdoll', 'Part': 'model.shapes',
    'Placement': 'model.scene',
    'Push': 'model.push', 'Ragdoll': 'model.ragdoll', 'RagdollError': 'model.errors',
    'Recorder': 'recordings.recording',
    'Scene': 'model.scene', 'Simulation': 'physics.simulation', 'Sphere': 'model.shapes',
    'State': 'model.state', 'load_doll': 'files.doll', 'load_scene': 'files.scene',
    'person': 'people.person', 'save_doll': 'files.doll', 'save_scene': 'files.scene',
    'save_recording': 'recordings.save'}
__all__ = list(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f'ragdoll_ros has no {name!r}, but: {", ".join(_HOMES)}')
    value = getattr(importlib.import_module(f'.{_HOMES[name]}', __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *_HOMES]

"""Engines by name."""
from __future__ import annotations

from ...model import errors
from .bullet import BulletEngine
from .mujoco import MujocoEngine
from .protocol import Engine

ENGINES: dict[str, type[Engine]] = {
    'auto': BulletEngine, 'bullet': BulletEngine, 'mujoco': MujocoEngine}
"""By name; 'auto' is the one that is right for most."""


def resolve_engine(engine: str | type[Engine]) -> type[Engine]:
    """The engine that a name stands for; OutOfRange for a name that is none."""
    if not isinstance(engine, str):
        return engine
    if engine not in ENGINES:
        raise errors.OutOfRange('engine', engine, 'one of ' + ', '.join(ENGINES))
    return ENGINES[engine]

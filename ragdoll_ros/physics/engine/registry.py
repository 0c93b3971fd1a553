"""Engines by name; what one needs is imported when it is asked for."""
from __future__ import annotations

from dataclasses import dataclass

from ...model import errors
from .. import kernels
from .protocol import Engine, MissingEngine

ENGINES = ('auto', 'rigid', 'bullet', 'mujoco')
"""'auto' is rigid where machine code can be made, else bullet."""


@dataclass(frozen=True)
class EngineChoice:
    """The engine that is taken, its name, and why it is not the rigid one, if 'auto' was asked."""

    name: str
    make: type[Engine]
    reason: str = ''


def resolve_engine(engine: str | type[Engine]) -> EngineChoice:
    """The engine for a name, or a class as it is; OutOfRange for a name that is none.

    Raises MissingEngine for the rigid engine where numba is missing or does not work.
    """
    if not isinstance(engine, str):
        return EngineChoice(engine.__name__, engine)
    check_engine(engine)
    problem = kernels.problem() if engine in ('auto', 'rigid') else ''
    if engine == 'rigid' and problem:
        raise MissingEngine(f'engine rigid: {problem}; expected numba 0.59 or newer, or engine '
                            'bullet')
    if engine == 'mujoco':
        from .mujoco import MujocoEngine
        return EngineChoice('mujoco', MujocoEngine)
    if engine == 'bullet' or problem:
        from .bullet import BulletEngine
        return EngineChoice('bullet', BulletEngine, problem)
    from .rigid import RigidEngine
    return EngineChoice('rigid', RigidEngine)


def check_engine(name: str) -> None:
    """Raise OutOfRange for a name that is none."""
    if name not in ENGINES:
        raise errors.OutOfRange('engine', name, 'one of ' + ', '.join(ENGINES))

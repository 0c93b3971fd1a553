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

    Raises MissingEngine for an engine whose library is missing or does not work.
    """
    if not isinstance(engine, str):
        return EngineChoice(engine.__name__, engine)
    check_engine(engine)
    problem = kernels.problem() if engine in ('auto', 'rigid') else ''
    if engine == 'rigid' and problem:
        raise MissingEngine(f'engine rigid: {problem}; expected numba 0.59 or newer, or engine '
                            'bullet')
    if engine == 'mujoco':
        from .substepped.mujoco import MujocoEngine
        return EngineChoice('mujoco', MujocoEngine)
    if engine == 'bullet' or problem:
        return EngineChoice('bullet', _bullet_engine(problem), problem)
    from .rigid.engine import RigidEngine
    return EngineChoice('rigid', RigidEngine)


def _bullet_engine(problem: str) -> type[Engine]:
    """PyBullet's; ``problem`` is what the rigid engine lacks, if that was asked for first."""
    try:
        from .substepped.bullet import BulletEngine
    except ImportError as error:
        reasons = [f'engine bullet: {error}', *([f'engine rigid: {problem}'] if problem else [])]
        raise MissingEngine('; '.join([*reasons, 'expected PyBullet, or numba 0.59 or newer for '
                                       'engine rigid'])) from error
    return BulletEngine


def check_engine(name: str) -> None:
    """Raise OutOfRange for a name that is none."""
    if name not in ENGINES:
        raise errors.OutOfRange('engine', name, 'one of ' + ', '.join(ENGINES))

"""Engines by name. The library of an engine is imported when the engine is requested."""
from dataclasses import dataclass

from ...model import errors
from .. import kernels
from .protocol import Engine, MissingEngine

ENGINES = ('auto', 'rigid', 'bullet', 'mujoco')
"""'auto' selects rigid where numba can compile, else bullet."""


@dataclass(frozen=True)
class EngineChoice:
    """The selected engine; ``reason`` says why 'auto' did not select rigid."""

    name: str
    make: type[Engine]
    reason: str = ''


def resolve_engine(engine: str | type[Engine]) -> EngineChoice:
    """Look up an engine by name, or wrap a class.

    Raises OutOfRange for an unknown name, MissingEngine if its library is missing or broken; for
    mujoco MissingEngine is raised only when the engine is made.
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
    """Import BulletEngine; ``problem``: why the rigid engine is not available, for the message."""
    try:
        from .substepped.bullet import BulletEngine
    except ImportError as error:
        reasons = [f'engine bullet: {error}', *([f'engine rigid: {problem}'] if problem else [])]
        raise MissingEngine('; '.join([*reasons, 'expected PyBullet, or numba 0.59 or newer for '
                                       'engine rigid'])) from error
    return BulletEngine


def check_engine(name: str) -> None:
    """Raise OutOfRange for an unknown engine name."""
    if name not in ENGINES:
        raise errors.OutOfRange('engine', name, 'one of ' + ', '.join(ENGINES))

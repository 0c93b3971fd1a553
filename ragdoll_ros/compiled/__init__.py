"""The sums of every tick as machine code, made by numba where that is installed.

Without it all works as well, by numpy and by asking PyBullet for accelerations, but slower, and
less accurate in the air. What can be either is made here.
"""
from __future__ import annotations

import functools
import os
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..coordinates import Layout
    from ..engine.protocol import Engine
    from ..flight import Dynamics
    from ..guard import Guard
    from ..limits import JointLimits
    from ..mechanics import Mechanics
    from ..reach import Reach
    from ..scene import Scene

SWITCH = 'RAGDOLL_COMPILED'
"""Variable of the environment that, set to 0, lets numba be."""

ORDER = 8
"""Of the method that flies in compiled code."""


@functools.cache
def ready() -> bool:
    """Tell whether compiled code is used; a numba that does not work is named once."""
    if os.environ.get(SWITCH, '1') == '0':
        return False
    try:
        import numba
    except ImportError as error:
        if getattr(error, 'name', None) != 'numba':
            warnings.warn(f'Not compiled, as numba does not work here: {error}', stacklevel=2)
        return False
    return not numba.config.DISABLE_JIT


def dynamics_of(scene: Scene, make_engine: type[Engine], layout: Layout) -> Dynamics:
    """The equations of motion of a scene in the air."""
    if ready():
        from .dynamics import CompiledDynamics
        return CompiledDynamics(scene)
    from ..flight import EngineDynamics
    return EngineDynamics(scene, make_engine, layout)


def mechanics_of(scene: Scene) -> Mechanics:
    """Sums over the bones of each doll."""
    if ready():
        from .mechanics import CompiledMechanics
        return CompiledMechanics(scene)
    from ..mechanics import Mechanics
    return Mechanics(scene)


def guard_of(scene: Scene, mechanics: Mechanics, layout: Layout) -> Guard:
    """Who keeps energy and momentum."""
    if ready():
        from .mechanics import CompiledGuard
        return CompiledGuard(scene, mechanics, layout)
    from ..guard import Guard
    return Guard(scene, mechanics, layout)


def limits_of(layout: Layout) -> JointLimits:
    """What joint limits have to say."""
    if ready():
        from .limits import CompiledLimits
        return CompiledLimits(layout)
    from ..limits import JointLimits
    return JointLimits(layout)


def reach_of(scene: Scene) -> Reach:
    """What bones can reach."""
    if ready():
        from .reach import CompiledReach
        return CompiledReach(scene)
    from ..reach import Reach
    return Reach(scene)

"""Machine code, made by numba where that is installed, and nothing else.

Without it all works as well, by numpy and by asking PyBullet for accelerations, but slower, and
less accurate in the air.
"""
from __future__ import annotations

import functools
import os
import warnings

SWITCH = 'RAGDOLL_COMPILED'
"""Variable of the environment that, set to 0, lets numba be."""

ORDER = 8
"""Of the method that flies in compiled code."""


@functools.cache
def ready() -> bool:
    """Whether compiled code is used; a numba that does not work is named once."""
    if os.environ.get(SWITCH, '1') == '0':
        return False
    try:
        import numba
    except ImportError as error:
        if getattr(error, 'name', None) != 'numba':
            warnings.warn(f'Not compiled, as numba does not work here: {error}', stacklevel=2)
        return False
    return not numba.config.DISABLE_JIT

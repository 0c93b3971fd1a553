"""Machine code, made by numba, and nothing else; who needs it asks first whether it can be made."""
from __future__ import annotations

import functools

ORDER = 8
"""Of the method that flies in compiled code."""


@functools.cache
def problem() -> str:
    """Why there is no machine code, in words; empty where it can be made."""
    try:
        import numba
    except Exception as error:  # whatever a numba raises that fits neither numpy nor Python
        return ('numba is missing' if getattr(error, 'name', None) == 'numba'
                else f'numba does not work here: {error}')
    return 'numba is told not to compile' if numba.config.DISABLE_JIT else ''


def ready() -> bool:
    """Whether machine code can be made."""
    return not problem()

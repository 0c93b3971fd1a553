"""Machine code, made by numba, and nothing else; who needs it asks first whether it can be made."""
from __future__ import annotations

import functools
import os

ORDER = 8
"""Of the method that flies in compiled code."""


@functools.cache
def problem() -> str:
    """Why there is no machine code, in words; empty where it can be made."""
    if os.environ.get('NUMBA_DISABLE_JIT', '0') not in ('', '0'):
        return 'NUMBA_DISABLE_JIT is set'
    try:
        import numba  # noqa: F401
    except Exception as error:  # whatever one raises that fits neither numpy nor Python
        return ('numba is missing' if getattr(error, 'name', None) == 'numba'
                else f'numba does not work here: {error}')
    return ''


def ready() -> bool:
    """Whether machine code can be made."""
    return not problem()

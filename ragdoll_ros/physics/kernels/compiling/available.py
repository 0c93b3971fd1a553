"""Whether kernels can be compiled here."""
from __future__ import annotations

import functools
import os


@functools.cache
def problem() -> str:
    """Why the kernels cannot be compiled; empty if they can."""
    if os.environ.get('NUMBA_DISABLE_JIT', '0') not in ('', '0'):
        return 'NUMBA_DISABLE_JIT is set'
    try:
        import numba  # noqa: F401
    except Exception as error:  # whatever one raises that fits neither numpy nor Python
        return ('numba is missing' if getattr(error, 'name', None) == 'numba'
                else f'numba does not work here: {error}')
    return ''


def ready() -> bool:
    """Whether the kernels can be compiled."""
    return not problem()

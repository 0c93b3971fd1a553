"""The kernels. What importing them compiles, one process compiles for all that start together."""
from .compiling.cache import alone

with alone():
    from . import advance

__all__ = ['advance']

"""Imports the kernels, which compiles them, in one process at a time; others load them."""
from .compiling.cache import alone

with alone():
    from . import advance
    from .collision import sweep_and_prune

__all__ = ['advance', 'sweep_and_prune']

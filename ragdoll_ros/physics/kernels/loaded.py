"""Imports the kernels, which compiles them, in one process at a time; others load them."""
from .compiling.cache import compile_lock

with compile_lock('rigid'):
    from . import advance, links
    from .collision import aabb_tree, sweep_and_prune

__all__ = ['aabb_tree', 'advance', 'links', 'sweep_and_prune']

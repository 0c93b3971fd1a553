"""Imports the kernels of swings and of oscillators, which compiles them, in one process at a time;
others load them.

Where numba does not work they are plain Python.
"""
import contextlib

from ..compiling.available import ready

if ready():
    from ..compiling.cache import compile_lock
else:
    compile_lock = contextlib.nullcontext

with compile_lock('swings'):
    from ..maths import oscillator
    from . import advance_chains, chain_modes

__all__ = ['advance_chains', 'chain_modes', 'oscillator']

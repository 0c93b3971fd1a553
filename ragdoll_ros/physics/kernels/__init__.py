"""Kernels: machine code, compiled by numba at the first import; ready() tells whether it can be."""
from .compiling.available import problem, ready

__all__ = ['ORDER', 'problem', 'ready']

ORDER = 8
"""Order of the Runge-Kutta method of flight."""

"""The kernels, ready to be called: loaded, or compiled by one process for all."""
from .cache import alone

with alone():
    from . import kernels

__all__ = ['kernels']

"""Decorators that compile functions to machine code, and short names of numba's types.

Without fastmath every sum, product, quotient and root is rounded by itself, in the order written,
as IEEE 754 prescribes: the same bits on all processors, for some 4 % of the speed. Where numba does
not work the decorators return functions unchanged: swings then run as plain Python.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .available import ready

if ready():
    import numba

    from .cache import keep
    from .linking import PartCompiler

    compiled = numba.njit(error_model='numpy', no_cpython_wrapper=True, no_cfunc_wrapper=True,
                          pipeline_class=PartCompiler)
    """Compile a function that only other compiled code calls."""

    inlined = numba.njit(inline='always', error_model='numpy')
    """Compile a function into its callers: twice as fast for one that is called with many arrays.
    """

    REAL, ADDRESS = numba.float64, numba.int64
else:
    def compiled(function: Callable) -> Callable:
        """Leave a function as it is."""
        return function

    inlined = compiled


def type_like(value: object) -> object:
    """Return numba's type of a number, an array, or a named tuple of arrays; None where kernels are
    not compiled.
    """
    return numba.typeof(value) if ready() else None


def entry(*types: object) -> Callable[[Callable], Callable]:
    """Return a decorator that compiles a function for calls from Python as soon as it is defined,
    for arguments of these ``types``: other numbers are converted, anything else raises TypeError.
    The compiled function releases the GIL and divides by zero without an exception. Where kernels
    are not compiled, the decorator returns the function unchanged.

    The code is cached on disk under the function's name, so the function must be at the top level
    of a module.
    """
    def compile_at_once(function: Callable) -> Callable:
        if not ready():
            return function
        dispatcher = numba.njit(error_model='numpy', nogil=True)(function)
        keep(dispatcher)
        dispatcher.compile(types)
        dispatcher.disable_compile()
        return dispatcher
    return compile_at_once


def rows_of(dtype: np.dtype, count: int) -> np.ndarray:
    """Allocate ``count`` zeroed records. Where kernels are not compiled, as a recarray: there they
    run as Python, and read fields as attributes.
    """
    rows = np.zeros(count, dtype)
    return rows if ready() else rows.view(np.recarray)

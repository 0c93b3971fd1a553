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
    """Numba's type of a number, an array, or a named tuple of arrays; None without numba."""
    return numba.typeof(value) if ready() else None


def entry(*types: object) -> Callable[[Callable], Callable]:
    """Compile a function that Python calls, when it is defined, for exactly these types of its
    arguments: others raise TypeError. It releases the GIL, and divides by zero without an
    exception. Where kernels are not compiled the function is returned as it is.

    The code is kept for the next process, under the function's name, so the function must be at the
    top level of a module.
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
    """Zeroed records (count,), whose fields Python code too reads by their names."""
    rows = np.zeros(count, dtype)
    return rows if ready() else rows.view(np.recarray)

"""How a function becomes machine code: three decorators, and short names of numba's types.

Without fastmath every sum, product, quotient and root is rounded by itself and in its order, which
IEEE 754 leaves no processor a choice in: the same bits on all of them, for some 4 % of the speed.
"""
from __future__ import annotations

from collections.abc import Callable

import numba

from .cache import keep
from .linking import PartCompiler

compiled = numba.njit(error_model='numpy', no_cpython_wrapper=True, no_cfunc_wrapper=True,
                      pipeline_class=PartCompiler)
"""Machine code, for what other compiled code calls."""

inlined = numba.njit(inline='always', error_model='numpy')
"""The same as a part of what calls it: twice as fast for what is called with many arrays."""

REAL, ADDRESS = numba.float64, numba.int64


def entry(*types: numba.types.Type) -> Callable[[Callable], Callable]:
    """Compile what Python calls, for these types of its arguments, when its file is imported.

    The code is kept for the next process, so that no simulation ever waits in its midst. It is
    kept by the function's name, so the function must be one of a module and not of a function.
    """
    def compile_at_once(function: Callable) -> Callable:
        dispatcher = numba.njit(error_model='numpy', nogil=True)(function)
        keep(dispatcher)
        dispatcher.compile(types)
        dispatcher.disable_compile()
        return dispatcher
    return compile_at_once

"""The processor's counter of cycles, as compiled code reads it in a few of them."""
from __future__ import annotations

import platform

import numba
from llvmlite import ir
from numba.extending import intrinsic

COUNTED = platform.machine() in ('x86_64', 'AMD64')
"""Whether there is a counter that every program may read."""


@intrinsic
def cycles(context: object) -> tuple:
    """Cycles since the processor started, at a constant rate; 0 where they are not counted."""
    def generate(context: object, builder: ir.IRBuilder, signature: object,
                 values: list) -> ir.Value:
        if not COUNTED:
            return ir.Constant(ir.IntType(64), 0)
        counter = builder.module.declare_intrinsic(
            'llvm.readcyclecounter', fnty=ir.FunctionType(ir.IntType(64), []))
        return builder.call(counter, [])
    return numba.int64(), generate



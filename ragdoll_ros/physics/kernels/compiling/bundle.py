"""Bundles: named tuples of arrays that compiled code passes on as one pointer.

Numba passes an array as ten numbers: sixty arrays make up most of what a call costs, and most of
what compiling it costs. A bundle is a pointer to a constant row of numbers: of each array its
address and its shape, of a nested tuple the address of its own row. There is no reference counting:
whoever made the row keeps the arrays as long as it is used.
"""
from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array, populate_array

WORD = ir.IntType(64)


class Bundle(types.Type):
    """Numba type of a bundle; ``fields``: place in the row and type of each field."""

    def __init__(self, name: str, fields: dict[str, tuple[int, types.Type]]) -> None:
        self.fields = fields
        super().__init__(f'Bundle({name})')


register_model(Bundle)(models.OpaqueModel)


def bundle_type(parts: tuple) -> Bundle:
    """Type of a bundle whose fields have the names and types of the named tuple ``parts``."""
    place, fields = 0, {}
    for name, part in zip(parts._fields, parts, strict=True):
        inner = isinstance(part, tuple)
        fields[name] = place, bundle_type(part) if inner else numba.typeof(part)
        place += 1 if inner else 1 + part.ndim
    return Bundle(type(parts).__name__, fields)


def bind(parts: tuple) -> list[np.ndarray]:
    """Rows of a named tuple of C-contiguous arrays: its own first, then those of nested tuples.
    Keep all of them, and the tuple, as long as the bundle is used.
    """
    row, rows = [], []
    for part in parts:
        if isinstance(part, tuple):
            inner = bind(part)
            rows += inner
            row.append(inner[0].ctypes.data)
        else:
            assert part.flags.c_contiguous
            row += [part.ctypes.data, *part.shape]
    return [np.array(row, np.int64), *rows]


def rebind(row: np.ndarray, kind: Bundle, name: str, part: np.ndarray) -> None:
    """Make field ``name`` of the bundle that has this ``row`` refer to another array, C-contiguous
    and of the same type, which the caller keeps alive.
    """
    assert part.flags.c_contiguous
    place, _ = kind.fields[name]
    row[place:place + 1 + part.ndim] = part.ctypes.data, *part.shape


def bundle_at(kind: Bundle) -> Callable[[int], object]:
    """A function for compiled code that returns the bundle at the address of a row."""
    @intrinsic
    def at(context: object, address: types.Type) -> tuple:
        def generate(context: object, builder: ir.IRBuilder, signature: object,
                     values: list) -> ir.Value:
            return builder.inttoptr(values[0], cgutils.voidptr_t)
        return kind(types.int64), generate
    return at


@intrinsic
def address_of(context: object, bundle: types.Type) -> tuple:
    """Address, int64, of the row that a bundle points to: a numba intrinsic."""
    def generate(context: object, builder: ir.IRBuilder, signature: object,
                 values: list) -> ir.Value:
        return builder.ptrtoint(values[0], WORD)
    return types.int64(bundle), generate


@infer_getattr
class _Fields(AttributeTemplate):
    """Tells numba the types of a bundle's fields."""

    key = Bundle

    def generic_resolve(self, kind: Bundle, name: str) -> types.Type | None:
        return kind.fields[name][1] if name in kind.fields else None


@lower_getattr_generic(Bundle)
def _take(context: object, builder: ir.IRBuilder, kind: Bundle, value: ir.Value,
          name: str) -> ir.Value:
    """Generate the code that reads a field."""
    place, field = kind.fields[name]
    row = builder.bitcast(value, WORD.as_pointer())

    def word(k: int) -> ir.Value:
        found = builder.load(builder.gep(row, [WORD(place + k)]))
        found.set_metadata('invariant.load', builder.module.add_metadata([]))
        return found

    if isinstance(field, Bundle):
        return builder.inttoptr(word(0), cgutils.voidptr_t)
    array = make_array(field)(context, builder)
    shape = [word(1 + k) for k in range(field.ndim)]
    size = WORD(context.get_abi_sizeof(context.get_data_type(field.dtype)))
    strides = [size]
    for length in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(array, builder.inttoptr(word(0), array.data.type), shape, strides, size, None)
    return array._getvalue()

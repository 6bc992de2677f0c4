"""Records on the stack of a compiled function.

Nothing that is handed to the function can be the same memory, and nothing outlives it: the compiler
keeps in registers what it can, and leaves out what nobody reads.
"""

from collections.abc import Callable
from typing import Any

from numba.core import cgutils, imputils, types
from numba.extending import intrinsic
from numba.np import arrayobj

_arrays: Any = arrayobj
_tools: Any = cgutils
_types: Any = types
_sharing: Any = imputils.impl_ret_borrowed
"""Numba tells no types of what makes arrays and types, takes memory, and shares an argument's."""

_ALIGNMENT = 64  # a line of the cache


@intrinsic(prefer_literal=True)
def room(_: Any, count: Any, layout: Any) -> tuple[Any, Callable[..., Any]]:
    """Return so many records of zeros on the stack; the compiler must know the number.

    They last as long as the function that calls this, so it must not return them.
    """
    records = types.Array(layout.dtype, 1, "C")
    flat = _types.UniTuple(types.float64, count.literal_value * layout.dtype.size // 8)

    def codegen(context: Any, builder: Any, *_: Any) -> Any:
        memory = _tools.alloca_once(builder, context.get_value_type(flat))
        memory.align = _ALIGNMENT
        shape, size = (
            context.get_constant(types.intp, n) for n in (count.literal_value, layout.dtype.size)
        )
        made = _arrays.make_array(records)(context, builder)
        _arrays.populate_array(
            made, data=builder.bitcast(memory, made.data.type), shape=[shape], strides=[size],
            itemsize=size, meminfo=None,
        )  # fmt: skip
        return made._getvalue()

    return records(count, layout), codegen


@intrinsic
def numbers(_: Any, records: Any) -> tuple[Any, Callable[..., Any]]:
    """Return the memory of an array of records as float64."""
    flat = types.Array(types.float64, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given = _arrays.make_array(records)(context, builder, args[0])
        size, each = (context.get_constant(types.intp, n) for n in (8, records.dtype.size // 8))
        seen = _arrays.make_array(flat)(context, builder)
        _arrays.populate_array(
            seen, data=builder.bitcast(given.data, seen.data.type),
            shape=[builder.mul(given.nitems, each)], strides=[size], itemsize=size,
            meminfo=given.meminfo,
        )  # fmt: skip
        return _sharing(context, builder, flat, seen._getvalue())

    return flat(records), codegen

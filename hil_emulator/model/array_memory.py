"""Memory as arrays and records, in machine code.

`view` shows flat memory as records, `as_floats` shows records as flat memory. Numba can do this as
well, but compiling it for each record type takes 20 % of the compile time of the whole model.

`stack_array` creates records on the stack of a compiled function. They cannot overlap an argument
of the function, and they end with the function. So the compiler keeps values in registers, and
omits unused ones.

`array_at_address` returns an array in memory whose address is given. Numba takes 30 ns to read an
array object of Python, and a tick needs fifteen arrays; so one array of addresses is passed.
"""

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core import cgutils, imputils, types
from numba.extending import intrinsic
from numba.np import arrayobj

_arrays: Any = arrayobj
_tools: Any = cgutils
_types: Any = types
_sharing: Any = imputils.impl_ret_borrowed
"""Numba has no types for constructors of arrays and types, or for shared memory of arguments."""

_Compiled = tuple[Any, Callable[..., Any]]

FLOAT, WHOLE, BYTE = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.uint8)

Addresses = np.ndarray[Any, np.dtype[np.int64]]

_ALIGNMENT = 64
"""Length of a cache line [byte]."""


@intrinsic
def view(_: Any, flat: Any, layout: Any) -> _Compiled:
    """Return the consecutive records of one type in an array of float64."""
    records = types.Array(layout.dtype, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        memory = _arrays.make_array(signature.args[0])(context, builder, args[0])
        size = context.get_constant(types.intp, layout.dtype.size)
        count = builder.sdiv(builder.mul(memory.nitems, memory.itemsize), size)
        array = _array(context, builder, records, memory.data, [count], [size], memory.meminfo)
        return _sharing(context, builder, records, array)

    return records(flat, layout), codegen


@intrinsic
def as_floats(_: Any, records: Any) -> _Compiled:
    """Return the memory of an array of records as float64."""
    flat = types.Array(types.float64, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        memory = _arrays.make_array(records)(context, builder, args[0])
        size, each = (context.get_constant(types.intp, n) for n in (8, records.dtype.size // 8))
        count = builder.mul(memory.nitems, each)
        array = _array(context, builder, flat, memory.data, [count], [size], memory.meminfo)
        return _sharing(context, builder, flat, array)

    return flat(records), codegen


@intrinsic(prefer_literal=True)
def stack_array(_: Any, count: Any, layout: Any) -> _Compiled:
    """Return `count` records of zeros on the stack; the count must be a compile-time constant.

    They end with the calling function, which must not return them.
    """
    records = types.Array(layout.dtype, 1, "C")
    flat = _types.UniTuple(types.float64, count.literal_value * layout.dtype.size // 8)

    def codegen(context: Any, builder: Any, *_: Any) -> Any:
        memory = _tools.alloca_once(builder, context.get_value_type(flat))
        memory.align = _ALIGNMENT
        shape, size = (
            context.get_constant(types.intp, n) for n in (count.literal_value, layout.dtype.size)
        )
        return _array(context, builder, records, memory, [shape], [size], None)

    return records(count, layout), codegen


@intrinsic
def array_at_address(_: Any, address: Any, shape: Any, layout: Any) -> _Compiled:
    """Return the array of a type and shape at an address, in C order."""
    array = types.Array(layout.dtype, len(shape), "C")
    extents = _types.UniTuple(types.intp, len(shape))

    def codegen(context: Any, builder: Any, _: Any, args: Any) -> Any:
        sizes = _tools.unpack_tuple(builder, args[1])
        size = context.get_abi_sizeof(context.get_data_type(layout.dtype))
        strides = [context.get_constant(types.intp, size)]
        for extent in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], extent))
        pointer = _arrays.make_array(array)(context, builder).data.type
        data = builder.inttoptr(args[0], pointer)
        return _array(context, builder, array, data, sizes, strides, None)

    return array(types.intp, extents, layout), codegen


def _array(
    context: Any, builder: Any, kind: Any, data: Any, shape: Any, strides: Any, meminfo: Any
) -> Any:
    """Return the value of an array type: its memory, its owner, shape and strides."""
    array = _arrays.make_array(kind)(context, builder)
    _arrays.populate_array(
        array, data=builder.bitcast(data, array.data.type), shape=shape, strides=strides,
        itemsize=strides[-1], meminfo=meminfo,
    )  # fmt: skip
    return array._getvalue()


def addresses(*arrays: np.ndarray[Any, Any]) -> Addresses:
    """Return address and length of arrays, one row each; the arrays must be kept alive."""
    rows = [(array.ctypes.data, len(array)) for array in arrays]
    return np.array(rows, np.int64).reshape(-1, 2)


def python_array_at_address(
    address: int, shape: tuple[int, ...], layout: Any
) -> np.ndarray[Any, Any]:
    """Return the same as `array_at_address` in Python."""
    kind = np.dtype(layout)
    memory = (ctypes.c_char * (math.prod(shape) * kind.itemsize)).from_address(int(address))
    return np.ndarray(shape, kind, memory)

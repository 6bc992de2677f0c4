"""Memory that a compiled function is told the address of.

Numba takes 30 ns to take an array apart that Python hands over, and a tick needs fifteen; of lent
memory only one array of addresses is handed over.
"""

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

_arrays: Any = arrayobj
_tools: Any = cgutils
_types: Any = types
"""Numba tells no types of what makes arrays and types, and takes tuples apart."""

FLOAT, WHOLE, BYTE = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.uint8)

Addresses = np.ndarray[Any, np.dtype[np.int64]]


def addresses(*arrays: np.ndarray[Any, Any]) -> Addresses:
    """Return where arrays begin and how long they are, a row for each; they must be kept alive."""
    rows = [(array.ctypes.data, len(array)) for array in arrays]
    return np.array(rows, np.int64).reshape(-1, 2)


@intrinsic
def lent(_: Any, address: Any, shape: Any, layout: Any) -> tuple[Any, Callable[..., Any]]:
    """Return the array of a type and shape that lies at an address, row by row."""
    lying = types.Array(layout.dtype, len(shape), "C")
    extents = _types.UniTuple(types.intp, len(shape))

    def codegen(context: Any, builder: Any, _: Any, args: Any) -> Any:
        sizes = _tools.unpack_tuple(builder, args[1])
        size = context.get_abi_sizeof(context.get_data_type(layout.dtype))
        strides = [context.get_constant(types.intp, size)]
        for extent in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], extent))
        made = _arrays.make_array(lying)(context, builder)
        _arrays.populate_array(
            made, data=builder.inttoptr(args[0], made.data.type), shape=sizes, strides=strides,
            itemsize=strides[-1], meminfo=None,
        )  # fmt: skip
        return made._getvalue()

    return lying(types.intp, extents, layout), codegen


def lent_in_python(address: int, shape: tuple[int, ...], layout: Any) -> np.ndarray[Any, Any]:
    """Return the same where nothing is compiled."""
    kind = np.dtype(layout)
    memory = (ctypes.c_char * (math.prod(shape) * kind.itemsize)).from_address(int(address))
    return np.ndarray(shape, kind, memory)

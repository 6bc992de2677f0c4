"""Flat memory seen as records, in machine code.

`ndarray.view` does the same for any two types; compiling what it asks of them for each record type
takes numba a fifth of the time that the whole model takes.
"""

from collections.abc import Callable
from typing import Any

from numba.core import imputils, types
from numba.extending import intrinsic
from numba.np import arrayobj

_arrays: Any = arrayobj
_sharing: Any = imputils.impl_ret_borrowed
"""Numba tells no types of what makes arrays, and of what shares the memory of an argument."""


@intrinsic
def view(_: Any, flat: Any, layout: Any) -> tuple[Any, Callable[..., Any]]:
    """Return the records, all of one type, that lie one after the other in an array of float64."""
    records = types.Array(layout.dtype, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        memory = _arrays.make_array(signature.args[0])(context, builder, args[0])
        size = context.get_constant(types.intp, layout.dtype.size)
        count = builder.sdiv(builder.mul(memory.nitems, memory.itemsize), size)
        seen = _arrays.make_array(records)(context, builder)
        _arrays.populate_array(
            seen, data=builder.bitcast(memory.data, seen.data.type), shape=[count], strides=[size],
            itemsize=size, meminfo=memory.meminfo,
        )  # fmt: skip
        return _sharing(context, builder, records, seen._getvalue())

    return records(flat, layout), codegen

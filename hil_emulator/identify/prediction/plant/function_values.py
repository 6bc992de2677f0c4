"""Functions of the compiled model as values: what takes one is compiled once for all models."""

from typing import Any

from numba.core import types
from numba.experimental import function_type

_types: Any = types
_functions: Any = function_type
"""Numba tells no types of what makes types, and of addresses of functions."""

_VECTOR = _types.Array(types.float64, 1, "C")
_PATH = _types.Array(types.float64, 2, "C")

TICK = _types.boolean(*[_VECTOR] * 5, _PATH, types.float64, types.int64)
"""Signature of `Kernel.tick`."""

RATE = _types.void(*[_VECTOR] * 5)
"""Signature of `Kernel.rate`."""

SENSE = _types.void(
    _VECTOR, _PATH, *[_VECTOR] * 4, types.float64, _VECTOR, _types.Array(types.int64, 1, "C")
)
"""Signature of `Kernel.sense`."""


class FunctionValue(_types.WrapperAddressProtocol):  # type: ignore[misc]
    """A function of a kernel, with its machine code's address.

    Args:
        compiled: the kernel's function.
        signature: its types.

    """

    def __init__(self, compiled: Any, signature: Any) -> None:
        self._compiled, self._signature = compiled, signature
        compiled.compile(signature.args)
        self._address = _functions._get_wrapper_address(compiled, signature)

    def __call__(self, *arguments: Any) -> Any:
        """Call it."""
        return self._compiled(*arguments)

    def __wrapper_address__(self) -> int:
        """Return where the machine code is."""
        return int(self._address)

    def signature(self) -> Any:
        """Return what it takes and gives."""
        return self._signature

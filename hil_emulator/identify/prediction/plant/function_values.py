"""First-class functions of the compiled model, so that loops are compiled once for all models."""

from typing import Any

from numba.core import types

from hil_emulator.model.compiling import address

_types: Any = types
"""Numba's types have no annotations."""

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
        self._address = address(compiled, signature)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function."""
        return self._compiled(*arguments)

    def __wrapper_address__(self) -> int:
        """Return the address of the machine code."""
        return self._address

    def signature(self) -> Any:
        """Return the types of arguments and result."""
        return self._signature

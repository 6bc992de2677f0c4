"""Calls of machine code with fixed argument objects.

Numba checks the type of every argument at every call; for a dozen arrays per tick this takes longer
than passing them.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numba


def bound(
    function: Any, *held: Any, left: Sequence[Any] = (), kept_alive: Sequence[Any] = ()
) -> Callable[..., Any]:
    """Return a function of the remaining arguments.

    Args:
        function: a compiled function, or a plain one.
        held: its first arguments, for all calls.
        left: one example of each remaining argument, for its type.
        kept_alive: arrays whose addresses the arguments hold; the result keeps them alive.

    """
    if hasattr(function, "compile"):
        function = function.compile(tuple(map(numba.typeof, (*held, *left))))
    call = functools.partial(function, *held)
    vars(call)["kept_alive"] = kept_alive
    return call

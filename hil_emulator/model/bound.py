"""Calls of machine code whose arguments stay the same objects from call to call.

Numba looks at the type of every argument at every call; for a tick's dozen arrays that takes
longer than handing them over.
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
        left: one example for the type of each of the others.
        kept_alive: arrays whose addresses the arguments hold; they live as long as the result.

    """
    if hasattr(function, "compile"):
        function = function.compile(tuple(map(numba.typeof, (*held, *left))))
    call = functools.partial(function, *held)
    vars(call)["kept_alive"] = kept_alive
    return call

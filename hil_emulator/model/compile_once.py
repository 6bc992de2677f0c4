"""One compilation of a function, however many processes ask for it at once."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

from hil_emulator.platform.file_lock import locked


def entry(module: Path | None, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles functions which are called from Python.

    Args:
        module: file of the functions' module, where their machine code is kept; None compiles for
            this process alone.
        options: as of `numba.njit`.

    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(cache=module is not None, **options)(function)
        if module is None:
            return dispatcher
        lock = module.with_name(f"{module.stem}.{function.__name__}.lock")
        compile_or_load = dispatcher.compile

        def once(signature: Any) -> Any:
            # numba's lock comes first, as in a thread that compiles a function which calls this one
            with global_compiler_lock, locked(lock):
                return compile_or_load(signature)

        dispatcher.compile = once
        return dispatcher

    return decorate

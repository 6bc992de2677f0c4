"""One compilation of a function, however many processes ask for it at once."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

from hil_emulator.model.inlined import lend_environments
from hil_emulator.model.optimisation import optimised
from hil_emulator.platform.file_lock import locked


@contextmanager
def uncollected() -> Iterator[None]:
    """Leave garbage alone for as long: a compiler makes much, and little of it has to go."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def entry(
    module: Path | None, rolled: bool = False, **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles functions which are called from Python.

    Args:
        module: file of the functions' module, where their machine code is kept; None compiles for
            this process alone.
        rolled: whether loops stay loops in it, see `pass_builder`.
        options: as of `numba.njit`.

    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(cache=module is not None, **options)(function)
        lock = module and module.with_name(f"{module.stem}.{function.__name__}.lock")
        compile_or_load = dispatcher.compile

        def once(signature: Any) -> Any:
            # numba's lock comes first, as in a thread that compiles a function which calls this one
            alone = locked(lock) if lock else nullcontext()
            with global_compiler_lock, alone, optimised(rolled), uncollected():
                address = compile_or_load(signature)
                lend_environments(dispatcher.targetctx.codegen())
                return address

        dispatcher.compile = once
        return dispatcher

    return decorate

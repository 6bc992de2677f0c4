"""Compilation of functions to machine code, stored for later processes.

Functions that Python calls are entry points; all that they call is compiled into them.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.experimental import function_type

from hil_emulator.model.checked_cache import CheckedCache
from hil_emulator.platform.file_lock import locked

Decorator = Callable[[Callable[..., Any]], Any]

_function_type: Any = function_type
"""Numba has no types for it."""

_ALLOCATING: dict[str, Any] = {"error_model": "numpy"}
"""Numpy's error model: a division by zero gives inf as in C, without a branch."""

ARITHMETIC: dict[str, Any] = {**_ALLOCATING, "_nrt": False}
"""Options of `numba.njit` for functions that create no array: without numba's runtime, which counts
references to arrays. A fifth of an integration step is saved."""

_CALLED_WITHIN: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""The wrappers for Python and C take 40 % of a compilation; only entry points need them."""


def inlined(**options: Any) -> Decorator:
    """Return a decorator for functions whose code becomes part of the functions that call them.

    Args:
        options: as of `numba.njit`.

    """
    wanted: dict[str, Any] = {**ARITHMETIC, **_CALLED_WITHIN, "forceinline": True, **options}
    decorator: Decorator = numba.njit(**wanted)
    return decorator


def allocating(**options: Any) -> Decorator:
    """Return the same as `inlined` for functions that create arrays."""
    return inlined(_nrt=True, **options)


def merged() -> Decorator:
    """Return a decorator for functions with a single caller, inserted into its source text.

    Otherwise LLVM optimises a model's code again for each enclosing function.
    """
    decorator: Decorator = numba.njit(inline="always", **ARITHMETIC)
    return decorator


def noinline() -> Decorator:
    """Return a decorator for functions that are called and have registers of their own."""
    decorator: Decorator = numba.njit(**ARITHMETIC, **_CALLED_WITHIN)
    return decorator


def entry_point(module: Path | None, rolled: bool = False, **options: Any) -> Decorator:
    """Return a decorator for functions that Python calls, compiled once for all processes.

    Args:
        module: file of the functions' module; machine code is stored in its folder. None compiles
            for this process only.
        rolled: whether loops stay loops, see `optimised`.
        options: as of `numba.njit`.

    """
    wanted: dict[str, Any] = {**ARITHMETIC, **options}

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**wanted)(function)
        cache = CheckedCache.of(function) if module else None
        if cache:
            dispatcher._cache = cache
        compile_or_load = dispatcher.compile

        def once(signature: Any) -> Any:
            # numba's lock comes first, as in a thread that compiles a function which calls this one
            alone = locked(cache.lock) if cache else nullcontext()
            with global_compiler_lock, alone, optimised(rolled), uncollected():
                return compile_or_load(signature)

        dispatcher.compile = once
        return dispatcher

    return decorate


def address(compiled: Any, signature: Any) -> int:
    """Return the address of an entry point's machine code for C."""
    compiled.compile(signature.args)
    return int(_function_type._get_wrapper_address(compiled, signature))


@contextmanager
def uncollected() -> Iterator[None]:
    """Pause Python's garbage collection: a compiler creates many objects and little garbage."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


@contextmanager
def optimised(rolled: bool) -> Iterator[None]:
    """Let LLVM optimise straight-line arithmetic; numba has these settings per process only.

    Args:
        rolled: whether loops stay loops. Loops over states and channels are too short to benefit
            from unrolling, which gives three times as much code.

    """
    codegen: Any = cpu_target.target_context.codegen()

    def build(opt: int = 3, **_: Any) -> Any:
        tuning = llvm.create_pipeline_tuning_options(speed_level=opt)
        tuning.loop_vectorization = False
        tuning.loop_interleaving = tuning.loop_unrolling = not rolled
        # a vector square root or division takes no longer than a scalar one
        tuning.slp_vectorization = opt > 0
        return llvm.create_pass_builder(codegen._tm, tuning)

    # an entry point may be compiled during the compilation of its caller
    outer = vars(codegen).get("_pass_builder")
    codegen._pass_builder = build
    try:
        yield
    finally:
        del codegen._pass_builder
        if outer:
            codegen._pass_builder = outer

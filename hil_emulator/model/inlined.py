"""Functions that are only ever inlined: their machine code is made once, where they end up.

Numba optimises each function by itself, with all that it calls, and makes machine code of it; in a
chain of ten that are inlined, the last is made ten times over.
"""

from collections.abc import Callable
from typing import Any

import numba
from numba.core import codegen, compiler

from hil_emulator.model.optimisation import pass_builder

_Compiler: Any = compiler.Compiler
_Library: Any = codegen.JITCodeLibrary
_Codegen: Any = codegen.CPUCodegen
"""Numba types none of them."""

_pending: dict[str, Any] = {}
"""What functions complain with that were inlined into code which is not complete yet."""


CALLED_WITHIN: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For `numba.njit`: doors for Python and C are two fifths of a compilation, and entries' alone."""


class _Nowhere:
    """A code generator that makes no machine code.

    Args:
        codegen: numba's.

    """

    _function_pass_manager = _Codegen._function_pass_manager

    def __init__(self, codegen: Any) -> None:
        self._whole = codegen

    def __getattr__(self, name: str) -> Any:
        """Return what numba's has."""
        return getattr(self._whole, name)

    def _pass_builder(self) -> Any:
        # what takes in the code is optimised in full
        return pass_builder(self._tm, rolled=True, level=1)

    def set_env(self, name: str, environment: Any) -> None:
        """Leave that to `lend_environments`: the name belongs to no machine code yet."""
        _pending[name] = environment


class _InlinedLibrary(_Library):  # type: ignore[misc]
    """What numba keeps of such a function: intermediate code, which those that call it take in."""

    def _optimize_final_module(self) -> None:
        """Leave that to those that call it."""

    def _finalize_final_module(self) -> None:
        self._finalized = True
        self._finalize_dynamic_globals()
        self._shared_module = self._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, numba's word for none."""
        return 0


class _InlinedCompiler(_Compiler):  # type: ignore[misc]
    """Numba's compiler with such a library."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        if library is None:
            library = _InlinedLibrary(_Nowhere(target.codegen()), "inlined")
            library.enable_object_caching()
        super().__init__(typing, target, library, *rest)


def inlined(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles functions for compiled ones, which take in their code.

    There is nothing that Python could call.

    Args:
        options: as of `numba.njit`.

    """
    wanted: dict[str, Any] = {**options, **CALLED_WITHIN, "forceinline": True}
    decorator: Callable[[Callable[..., Any]], Any] = numba.njit(
        pipeline_class=_InlinedCompiler, **wanted
    )
    return decorator


def lend_environments(codegen: Any) -> None:
    """Tell the machine code of an entry what the inlined functions in it complain with.

    Args:
        codegen: numba's.

    """
    for name in [name for name in _pending if codegen._engine.is_symbol_defined(name)]:
        codegen.set_env(name, _pending.pop(name))

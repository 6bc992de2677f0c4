"""Functions that are only ever inlined: their machine code is made once, where they end up.

Numba optimises each function by itself, with all that it calls, and makes machine code of it; in a
chain of ten that are inlined, the last is made ten times over.
"""

from collections.abc import Callable
from typing import Any

import numba
from numba.core import codegen, compiler

_Compiler: Any = compiler.Compiler
_Library: Any = codegen.JITCodeLibrary
"""Numba types none of them."""


CALLED_WITHIN: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For `numba.njit`: doors for Python and C are two fifths of a compilation, and entries' alone."""


class _InlinedLibrary(_Library):  # type: ignore[misc]
    """What numba keeps of such a function: intermediate code, which those that call it take in."""

    def _optimize_final_module(self) -> None:
        """Leave that to those that call it."""

    def _finalize_final_module(self) -> None:
        self._finalized = True
        shared = self._get_module_for_linking()
        # an own copy: what is linked has to stay as it is
        self._shared_module = shared.clone() if shared is self._final_module else shared
        for function in self._final_module.functions:
            if not function.is_declaration:
                function.linkage = "available_externally"
        super()._finalize_final_module()


class _InlinedCompiler(_Compiler):  # type: ignore[misc]
    """Numba's compiler with such a library."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        if library is None:
            library = _InlinedLibrary(target.codegen(), "inlined")
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

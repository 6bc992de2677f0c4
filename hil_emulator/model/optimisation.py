"""What LLVM does with the machine code: arithmetic in straight lines, not long loops."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba.core.registry import cpu_target


def pass_builder(target: Any, rolled: bool, level: int = 3) -> Any:
    """Return what numba asks for before it optimises; by itself it offers less of a choice.

    Args:
        target: machine for which code is made.
        rolled: whether loops stay loops. Those over states and channels, whose number code does not
            know, end before several rounds at once pay, and make three times as much code of it.
        level: of optimisation, from 0 to 3.

    """
    tuning = llvm.create_pipeline_tuning_options(speed_level=level)
    tuning.loop_vectorization = False
    tuning.loop_interleaving = tuning.loop_unrolling = not rolled
    # a root or a quotient of two takes no longer than that of one
    tuning.slp_vectorization = level > 0
    return llvm.create_pass_builder(target, tuning)


@contextmanager
def optimised(rolled: bool) -> Iterator[None]:
    """Let numba make such code: it knows that as a setting of the whole process alone."""
    codegen: Any = cpu_target.target_context.codegen()

    def build(opt: int = 3, **_: Any) -> Any:
        return pass_builder(codegen._tm, rolled, opt)

    # an entry that calls another one is compiled around that
    outer = vars(codegen).get("_pass_builder")
    codegen._pass_builder = build
    try:
        yield
    finally:
        del codegen._pass_builder
        if outer is not None:
            codegen._pass_builder = outer

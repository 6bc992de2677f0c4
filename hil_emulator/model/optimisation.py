"""What LLVM does with the machine code: arithmetic in straight lines, not long loops."""

from collections.abc import Iterator, Sequence
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


class _Twice:
    """Passes over a module, run twice.

    Loops are unrolled late among them: what this lays open, the second run works on. A step then
    takes four fifths of the time (measured).
    """

    def __init__(self, managers: Sequence[Any]) -> None:
        self._managers = managers

    def run(self, module: Any, builder: Any) -> None:
        """Optimise a module."""
        for manager in self._managers:
            manager.run(module, builder)


@contextmanager
def optimised(rolled: bool) -> Iterator[None]:
    """Let numba make such code: it knows that as a setting of the whole process alone."""
    codegen: Any = cpu_target.target_context.codegen()
    numbas = type(codegen)._module_pass_manager

    def build(opt: int = 3, **_: Any) -> Any:
        return pass_builder(codegen._tm, rolled, opt)

    def manage(**wanted: Any) -> tuple[Any, Any]:
        manager, builder = numbas(codegen, **wanted)
        if rolled or "cost" in wanted:
            return manager, builder
        # each runs once
        again, _ = numbas(codegen, **wanted)
        return _Twice((manager, again)), builder

    # an entry that calls another one is compiled around that
    outer = dict(vars(codegen))
    codegen._pass_builder, codegen._module_pass_manager = build, manage
    try:
        yield
    finally:
        for name in ("_pass_builder", "_module_pass_manager"):
            delattr(codegen, name)
            if name in outer:
                setattr(codegen, name, outer[name])

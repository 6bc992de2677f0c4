"""What is asked of LLVM when functions of the model, and loops over it, are compiled."""

import platform
from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.core.registry import cpu_target

from hil_emulator.model.compile_once import entry

Vector = np.ndarray[Any, np.dtype[np.float64]]


def add_up(values: Vector) -> float:
    """Return a sum of twelve: whether rounds of an unknown number are laid out hangs on the CPU."""
    total = 0.0
    for i in range(12):
        total += values[i] * values[i]
    return total


def roots(values: Vector, out: Vector) -> None:
    """Fill two roots, one after the other."""
    first, second = values[0], values[1]
    out[0], out[1] = np.sqrt(first), np.sqrt(second)


def machine_code(function: Any) -> list[str]:
    """Return its instructions."""
    (code,) = function.inspect_asm().values()
    return [line for line in code.splitlines() if line.startswith("\t") and line[1] != "."]


def test_loops_stay_loops_where_code_has_to_be_short() -> None:
    """They compute the same to the bit, in fewer instructions."""
    values = np.linspace(0.1, 0.9, 12)
    laid_out, rolled = entry(None)(add_up), entry(None, rolled=True)(add_up)
    assert laid_out(values) == rolled(values) == add_up(values)
    assert len(machine_code(rolled)) < len(machine_code(laid_out))


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names an instruction of that machine")
def test_two_roots_are_drawn_at_once() -> None:
    """An instruction for pairs takes no longer than one for a single number."""
    twice, out = entry(None, error_model="numpy")(roots), np.zeros(2)
    twice(np.array([4.0, 9.0]), out)
    assert out.tolist() == [2.0, 3.0]
    assert any("sqrtpd" in line for line in machine_code(twice))


def test_what_others_compile_is_left_alone() -> None:
    """Numba has its own settings again, also after a function that cannot be compiled."""
    codegen: Any = cpu_target.target_context.codegen()
    entry(None)(add_up)(np.ones(12))
    with pytest.raises(TypingError):
        entry(None)(add_up)(None)
    assert not {"_pass_builder", "_module_pass_manager"} & set(vars(codegen))

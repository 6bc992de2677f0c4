"""Functions that become machine code: entry points, and what is compiled into them."""

import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.core.registry import cpu_target

from hil_emulator.model.compiling import allocating, entry_point, inlined, merged, noinline

Vector = np.ndarray[Any, np.dtype[np.float64]]


def add_up(values: Vector) -> float:
    """Return a sum of twelve: unrolling a loop of unknown length depends on the CPU."""
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
    unrolled, rolled = entry_point(None)(add_up), entry_point(None, rolled=True)(add_up)
    assert unrolled(values) == rolled(values) == add_up(values)
    assert len(machine_code(rolled)) < len(machine_code(unrolled))


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names an instruction of that machine")
def test_two_roots_are_computed_by_one_instruction() -> None:
    """An instruction for pairs takes no longer than one for a single number."""
    both, out = entry_point(None)(roots), np.zeros(2)
    both(np.array([4.0, 9.0]), out)
    assert out.tolist() == [2.0, 3.0]
    assert any("sqrtpd" in line for line in machine_code(both))


def test_other_users_of_numba_keep_their_settings() -> None:
    """The settings end with a compilation, also with one that fails."""
    codegen: Any = cpu_target.target_context.codegen()
    entry_point(None)(add_up)(np.ones(12))
    with pytest.raises(TypingError):
        entry_point(None)(add_up)(None)
    assert "_pass_builder" not in vars(codegen)


def test_an_entry_point_may_call_another_one() -> None:
    """Each is compiled with its own settings, whichever is needed first."""
    inner = entry_point(None, rolled=True)(add_up)

    @entry_point(None)
    def outer(values: Vector) -> float:
        return 2.0 * float(inner(values))

    values = np.linspace(0.1, 0.9, 12)
    assert outer(values) == 2.0 * add_up(values)
    assert len(machine_code(inner)) == len(machine_code(_rolled(values)))


def _rolled(values: Vector) -> Any:
    rolled = entry_point(None, rolled=True)(add_up)
    rolled(values)
    return rolled


@pytest.mark.parametrize("decorator", [inlined, allocating, merged, noinline])
def test_an_inner_function_serves_many(decorator: Any) -> None:
    """Each function that calls it contains it and raises its message."""

    @decorator()
    def root(x: float) -> float:
        if x < 0.0:
            raise ValueError("no root")
        return float(x**0.5)

    @entry_point(None)
    def edge(x: float) -> float:
        return 6.0 * float(root(x))

    @entry_point(None)
    def diagonal(x: float) -> float:
        return float(root(x)) * float(root(2.0))

    assert (edge(4.0), diagonal(8.0), edge(9.0)) == (12.0, pytest.approx(4.0), 18.0)
    for function in (edge, diagonal):
        with pytest.raises(ValueError, match="no root"):
            function(-1.0)


KEPT = """
import sys
from pathlib import Path
from hil_emulator.model.compiling import entry_point, inlined

@inlined()
def root(x):
    if x < 0.0:
        raise ValueError("no root")
    return x**0.5

@entry_point(Path(__file__))
def doubled(x):
    return 2.0 * root(root(x))

try:
    doubled(-1.0)
except ValueError as error:
    print(doubled(81.0), error.args, sum(doubled.stats.cache_misses.values()))
"""


def test_processes_that_start_at_once_compile_once(tmp_path: Path) -> None:
    """On an empty cache one of three compiles; the others load its code, inner functions and all.

    The code returns and raises the same in all of them.
    """
    file = tmp_path / "kept.py"
    file.write_text(KEPT)
    begun = [subprocess.Popen([sys.executable, file], stdout=subprocess.PIPE, text=True)
             for _ in range(3)]  # fmt: skip
    lines = sorted(process.communicate()[0] for process in begun)
    assert lines == [f"6.0 ('no root',) {misses}\n" for misses in (0, 0, 1)]

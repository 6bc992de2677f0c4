"""Compiled functions whose code only those that call them have."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from hil_emulator.model.compile_once import entry
from hil_emulator.model.inlined import inlined

KEPT = """
import sys
from pathlib import Path
from hil_emulator.model.compile_once import entry
from hil_emulator.model.inlined import inlined

@inlined()
def root(x):
    if x < 0.0:
        raise ValueError("no root", x)
    return x**0.5

@inlined()
def fourth_root(x):
    return root(root(x))

@entry(Path(__file__), error_model="numpy")
def doubled(x):
    return 2.0 * fourth_root(x)

if __name__ == "__main__":
    try:
        doubled(-1.0)
    except ValueError as error:
        print(doubled(81.0), error.args, sum(doubled.stats.cache_hits.values()))
"""


def test_kept_machine_code_has_what_was_inlined(tmp_path: Path) -> None:
    """It computes and complains in the next process, which compiles nothing, as in the first."""
    file = tmp_path / "kept.py"
    file.write_text(KEPT)
    told = [subprocess.check_output([sys.executable, file], text=True) for _ in range(2)]
    assert told == ["6.0 ('no root', -1.0) 0\n", "6.0 ('no root', -1.0) 1\n"]


def test_one_function_is_inlined_into_many() -> None:
    """Each of those that call it has it, whether called before or after another one."""

    @inlined()
    def square(x: float) -> float:
        return x * x

    @entry(None)
    def area(x: float) -> float:
        return 3.0 * float(square(x))

    @entry(None)
    def volume(x: float) -> float:
        return 4.0 * x * float(square(x))

    assert (area(2.0), volume(2.0), area(3.0)) == (12.0, 32.0, 27.0)


def test_an_entry_that_calls_another_one_complains_for_both() -> None:
    """Either has what functions complain with that were inlined into it."""

    @inlined()
    def root(x: float) -> float:
        if x < 0.0:
            raise ValueError("no root", x)
        return float(x**0.5)

    @inlined()
    def inverse(x: float) -> float:
        if x == 0.0:
            raise ValueError("no inverse", x)
        return 1.0 / x

    @entry(None, rolled=True)
    def inner(x: float) -> float:
        return float(root(x))

    @entry(None)
    def outer(x: float) -> float:
        return float(inverse(x)) + float(inner(x))

    assert outer(4.0) == 2.25
    for wrong, why in ((-1.0, "no root"), (0.0, "no inverse")):
        with pytest.raises(ValueError, match=why):
            outer(wrong)


def test_nothing_is_made_of_an_inlined_function_by_itself() -> None:
    """No machine code belongs to its name, and some does to that of an entry."""

    @inlined()
    def cubed(x: float) -> float:
        return x * x * x

    @entry(None)
    def doubled(x: float) -> float:
        return 2.0 * float(cubed(x))

    doubled(1.5)
    assert [_has_machine_code(function) for function in (cubed, doubled)] == [False, True]


def _has_machine_code(function: Any) -> bool:
    (compiled,) = function.overloads.values()
    name: str = compiled.fndesc.mangled_name
    return bool(compiled.library.codegen._engine.is_symbol_defined(name))

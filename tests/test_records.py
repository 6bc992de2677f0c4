"""Records instead of positions: what belongs together is passed as one thing with named parts."""

import ast
from pathlib import Path

import pytest

import hil_emulator

PACKAGE = Path(hil_emulator.__file__).parent

MOST = 8
"""Most parameters of a function, `self` and `cls` aside."""


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) -> list[str]:
    """Return the names of what a function takes; `*args` and `**kwargs` count as one each."""
    a = function.args
    every = [*a.posonlyargs, *a.args, a.vararg, *a.kwonlyargs, a.kwarg]
    names = [one.arg for one in every if one]
    return names[1:] if names[:1] in (["self"], ["cls"]) else names


@pytest.mark.parametrize("room", sorted({f.relative_to(PACKAGE).parts[0]
                                         for f in PACKAGE.rglob("*.py")}))  # fmt: skip
def test_no_function_takes_more_than_a_reader_can_hold(room: str) -> None:
    """At most eight parameters: a call of many confuses one with its neighbour of the same type.

    A type checker does not notice two exchanged arrays or lengths. Longer lists of arguments become
    a named tuple (for machine code) or a dataclass, with unit and shape of each part.
    """
    files = (PACKAGE / room).rglob("*.py") if (PACKAGE / room).is_dir() else [PACKAGE / room]
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                taken = parameters(node)
                name = getattr(node, "name", "lambda")
                assert len(taken) <= MOST, f"{file.name}: {name}({', '.join(taken)})"

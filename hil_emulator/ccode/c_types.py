"""C types of the model's values."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


class TranslationError(ValueError):
    """The model's text holds something that cannot be translated to C."""


@dataclass(frozen=True)
class Number:
    """A number: "real" (double or float), "int" or "bool"."""

    kind: str


REAL, INT, BOOL, NOTHING = Number("real"), Number("int"), Number("bool"), Number("void")


@dataclass(frozen=True)
class Record:
    """A record of the model, passed by pointer.

    Attributes:
        name: name of the C structure.
        fields: name of each field, and the number of its values.

    """

    name: str
    fields: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Records:
    """An array of records."""

    of: Record


@dataclass(frozen=True)
class Numbers:
    """An array.

    Attributes:
        shape: length of each dimension; None for a first dimension known at run time only.
        of: type of the elements.
        fixed: whether the array is read-only.

    """

    shape: tuple[int | None, ...]
    of: Number = REAL
    fixed: bool = False


@dataclass(frozen=True)
class Several:
    """Several values in one structure: a named tuple, or the results of a function.

    Attributes:
        name: name of the C structure.
        fields: names and types of the values.

    """

    name: str
    fields: tuple[tuple[str, "CType"], ...]


CType = Number | Record | Records | Numbers | Several

_TAKEN = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
    "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "register",
    "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch",
    "typedef", "union", "unsigned", "void", "volatile", "while", "bool", "true", "false",
    "maximum", "minimum", "smaller", "modulo", "normal", "sense", "proceed", "forget",
    "held_of", "acos", "asin", "atan", "atan2", "ceil", "cos", "cosh", "exp", "exp2", "expm1",
    "fabs", "floor", "fma", "fmod", "gamma", "hypot", "j0", "j1", "jn", "log", "log10",
    "log1p", "log2", "pow", "round", "sin", "sinh", "sqrt", "tan", "tanh", "trunc", "y0",
    "y1", "yn", "index", "main",
}  # fmt: skip
"""Names that C, its library or the code around the translated functions use."""


def c_name(name: str) -> str:
    """Return a name of the model as a valid identifier of C."""
    plain = name.lstrip("_")
    return f"{plain}_" if plain in _TAKEN else plain


def record(name: str, layout: np.dtype[Any]) -> Record:
    """Return the structure that holds a record type of the model."""
    fields: Mapping[str, Any] = layout.fields or {}
    return Record(name, tuple((n, fields[n][0].itemsize // 8) for n in layout.names or ()))


def several_reals(count: int) -> Several:
    """Return the structure for a function's result of several numbers."""
    return Several(f"real{count}", tuple((f"v{i}", REAL) for i in range(count)))


def declared(kind: CType, name: str, real: str) -> str:
    """Return the declaration of a variable or an argument of a type.

    Args:
        kind: type of the variable.
        name: name of the variable; "" for the type alone.
        real: C type of real numbers, "double" or "float".

    """
    space = " " if name else ""
    match kind:
        case Number():
            return f"{real if kind is REAL else kind.kind}{space}{name}"
        case Record() | Records():
            of = kind.of if isinstance(kind, Records) else kind
            return f"{of.name} *{name}"
        case Several():
            return f"{kind.name}{space}{name}"
        case Numbers(shape, of, fixed):
            of_what = f"{'const ' if fixed else ''}{declared(of, '', real)}"
            inner = "".join(f"[{n}]" for n in shape[1:])
            return f"{of_what} (*{name}){inner}" if inner else f"{of_what} *{name}"

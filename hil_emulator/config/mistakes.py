"""What is wrong with a configuration, told so that it can be mended."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from hil_emulator.config.bench import Kind, kind_of
from hil_emulator.config.table import StrictTable
from hil_emulator.errors import brief
from hil_emulator.model.quantities import PARAMS
from hil_emulator.units import show


def describe(
    error: ValidationError,
    model: type[StrictTable],
    merged: Mapping[str, Any],
    origin: Mapping[tuple[str, ...], Path],
    files: Sequence[Path],
) -> str:
    """Return one message that lists every mistake with its file, path and remedy."""
    lines = [_line(mistake, model, merged, origin, files) for mistake in error.errors()]
    count = "1 mistake" if len(lines) == 1 else f"{len(lines)} mistakes"
    return "\n".join([f"{count} in the configuration:", *(f"  {line}" for line in lines)])


def _line(
    mistake: Any,
    model: type[StrictTable],
    merged: Mapping[str, Any],
    origin: Mapping[tuple[str, ...], Path],
    files: Sequence[Path],
) -> str:
    place = tuple(part for part in mistake["loc"])
    names = tuple(str(part) for part in place if isinstance(part, str))
    path = ".".join(str(part) for part in place)
    return (
        f"{_file(names, origin, files)}: {path or 'file'}: {_reason(mistake, names, model, merged)}"
    )


def _file(
    names: tuple[str, ...], origin: Mapping[tuple[str, ...], Path], files: Sequence[Path]
) -> Path:
    """Return the file that set the nearest enclosing table."""
    for length in range(len(names), 0, -1):
        if names[:length] in origin:
            return origin[names[:length]]
    return files[-1]


def _reason(
    mistake: Any, names: tuple[str, ...], model: type[StrictTable], merged: Mapping[str, Any]
) -> str:
    kind = mistake["type"]
    if kind == "extra_forbidden":
        known = _keys(model, names[:-1])
        near = difflib.get_close_matches(names[-1], known, n=1)
        return (
            f'unknown key; did you mean "{near[0]}"?'
            if near
            else f"unknown key; known here: {', '.join(known)}"
        )
    if kind == "missing":
        return _missing(names, kind_of(merged))
    if kind == "value_error":
        return str(mistake["ctx"]["error"])
    if kind == "model_type":
        return f"{_quoted(mistake['input'])} is not a table"
    text = str(mistake["msg"])
    return f"{_quoted(mistake['input'])}: {text[0].lower()}{text[1:]}"


def _missing(names: tuple[str, ...], bench: Kind) -> str:
    """Say what is missing with its unit and an example, or that a key is."""
    table, key = (*names, "")[:2]
    lacking = [
        f'{p.name} = "{show(p.typical, p.unit, p.shown)}" ({p.meaning})'
        for p in PARAMS.get(table, ()) if (p.name == key if key else bench.asks(table, p.name))
    ]  # fmt: skip
    if not lacking:
        return "missing; this value is required"
    return f"missing; {bench.describes.partition(':')[0]} needs {', '.join(lacking)}"


def _quoted(given: object) -> str:
    return repr(brief(given)) if isinstance(given, str) else brief(given)


def _keys(model: type[StrictTable], names: tuple[str, ...]) -> list[str]:
    """Return the keys that the table at a path knows."""
    current: Any = model
    for name in names:
        annotation = current.model_fields[name].annotation
        candidates = [annotation, *get_args(annotation)]
        current = next(c for c in candidates if isinstance(c, type) and issubclass(c, StrictTable))
    return list(current.model_fields)

"""Messages on the mistakes of a configuration, with place and remedy."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from hil_emulator.config.bench import Kind, kind_of
from hil_emulator.config.table import QuantityReader, StrictTable, TableOfWays
from hil_emulator.errors import brief
from hil_emulator.model.quantities import PARAMS

_NODE = """    [[node]]
    id = 5
    eds = "hydraulic_actuator.eds"      # a path from the configuration's file"""


SHOWN = 50
"""Largest number of mistakes in a message, which counts the others."""

_GONE = {
    ("valve", "reynolds_discharge"): (
        "every edge is laminar below a Reynolds number now; for its flow number lambda_c give "
        "critical_reynolds_number = 0.3 lambda_c"
    ),
}
"""Keys of former versions, and their replacement."""

_ELSEWHERE = {
    (("node",), ("dbc", "transmits", "signals", "j1939")): (
        "a node that a DBC describes is a table of its own: write [[partner]] with name and dbc"
    ),
}
"""Keys that belong to another table, by the table they were found in."""


def describe(
    error: ValidationError,
    model: type[StrictTable],
    merged: Mapping[str, Any],
    origin: Mapping[tuple[str, ...], Path],
    files: Sequence[Path],
) -> str:
    """Return one message that lists every mistake with its file, path and remedy."""
    mistakes = error.errors()
    lines = [_line(mistake, model, merged, origin, files) for mistake in mistakes[:SHOWN]]
    lines += [f"and {len(mistakes) - SHOWN} more"] if len(mistakes) > SHOWN else []
    count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
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
        if names in _GONE:
            return _GONE[names]
        for (above, moved), way_out in _ELSEWHERE.items():
            if names[:-1] == above and names[-1] in moved:
                return way_out
        keys = _keys(model, names[:-1])
        near = difflib.get_close_matches(names[-1], keys, n=1)
        return (
            f'unknown key; did you mean "{near[0]}"?'
            if near
            else f"unknown key; known here: {', '.join(keys)}"
        )
    if kind == "missing":
        return _missing(names, model, kind_of(merged))
    if kind == "value_error":
        return str(mistake["ctx"]["error"])
    if kind in ("model_type", "list_type", "tuple_type") and isinstance(mistake["input"], dict):
        return f"is a list of tables: write [[{names[-1]}]], in double brackets"
    if kind == "model_type":
        return f"{_quoted(mistake['input'])} is not a table: write [{'.'.join(names)}]"
    text = str(mistake["msg"])
    return f"{_quoted(mistake['input'])}: {text[0].lower()}{text[1:]}"


def _missing(names: tuple[str, ...], model: type[StrictTable], bench: Kind) -> str:
    """Return the message for a missing key or table, with unit and example."""
    *above, key = names
    if names == ("node",):
        return f"missing: nothing is on a bus; it needs, for example\n{_NODE}"
    reader = _readers(_table(model, above)).get(key)
    who = bench.describes.partition(":")[0]
    if reader is not None:
        return f"missing; {who} needs {reader.assignment} ({reader.param.meaning})"
    if above or key not in PARAMS:
        return "missing; this value is required"
    table = _table(model, names)
    sheet = table.data_sheet if issubclass(table, TableOfWays) else ()
    other = frozenset().union(*table.groups) if issubclass(table, TableOfWays) else frozenset()
    asked = [p.name for p in PARAMS[key] if bench.asks(key, p.name) and p.name not in other]
    needed = [_readers(table)[k] for k in (*sheet, *asked)]
    lines = [f"{r.assignment:<34}  # {r.param.meaning}" for r in needed]
    return "\n    ".join([f"missing; {who} needs, for example", f"[{key}]", *lines])


def _quoted(given: object) -> str:
    return repr(brief(given)) if isinstance(given, str) else brief(given)


def _keys(model: type[StrictTable], names: Sequence[str]) -> list[str]:
    """Return the keys of the table at a path."""
    return list(_table(model, names).model_fields)


def _table(model: type[StrictTable], names: Sequence[str]) -> type[StrictTable]:
    """Return the table at a path; for tables with free names, their common type."""
    current: type[StrictTable] = model
    for name in names:
        field = current.model_fields.get(name)
        if field is None:  # the name of one of several
            continue
        candidates = [field.annotation, *get_args(field.annotation)]
        current = next(c for c in candidates if isinstance(c, type) and issubclass(c, StrictTable))
    return current


def _readers(table: type[StrictTable]) -> dict[str, QuantityReader]:
    """Return the readers of a table's quantities."""
    return {
        name: reader
        for name, field in table.model_fields.items()
        for reader in field.metadata
        if isinstance(reader, QuantityReader)
    }

"""`result_json.md`: the fields of `result.json`, which `identify` and `gap` write."""

import dataclasses
import inspect
import types
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from build_time.reference.attributes import meanings, unit_of
from build_time.reference.markdown import code, page, sentence, table, text
from hil_emulator.identify.conclusion.result import INTERNAL, KEYS, VERDICTS, Result

_HEAD = """\
The fields of the file `result.json` in the folder of `identify --out` and `gap --out`. Numbers are
in SI units. A unit "see `unit`" stands in that field of the same object."""

_NAMES = {str: "text", int: "integer", float: "number", bool: "true or false", Any: "value"}


def write() -> str:
    """Return the page."""
    verdicts = table(("verdict", "meaning"), [(code(v), text(m)) for v, m in VERDICTS.items()])
    nested = [
        f"## {cls.__name__}\n\n{sentence((inspect.getdoc(cls) or '').partition(chr(10))[0])}"
        f"\n\n{_fields(cls)}"
        for cls in _nested(Result)[1:]
    ]
    return page("result.json", _HEAD, "## The file", _fields(Result), "## Verdicts", verdicts,
                *nested)  # fmt: skip


def _written(cls: type[Any]) -> dict[str, Any]:
    """Return the types of the attributes that are written."""
    hints = get_type_hints(cls)
    names = [f.name for f in dataclasses.fields(cls)]
    return {n: hints[n] for n in names if cls is not Result or n not in INTERNAL}


def _nested(cls: type[Any]) -> list[type[Any]]:
    """Return a dataclass and those inside it, in the order of the fields."""
    inside = [c for t in _written(cls).values() for c in _classes(t)]
    return list(dict.fromkeys([cls, *(n for c in inside for n in _nested(c))]))


def _classes(annotation: Any) -> list[type[Any]]:
    if dataclasses.is_dataclass(annotation) and isinstance(annotation, type):
        return [annotation]
    return [c for inner in get_args(annotation) for c in _classes(inner)]


def _fields(cls: type[Any]) -> str:
    declared = meanings(cls)
    rows = []
    for name, annotation in _written(cls).items():
        meaning, unit = unit_of(declared[name])
        shown = "see `unit`" if unit == "unit" else text(unit)
        rows.append((code(KEYS.get(name, name)), _type(annotation), shown, text(meaning)))
    return table(("field", "type", "unit", "meaning"), rows)


def _type(annotation: Any) -> str:
    """Return a type as JSON knows it, in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return "text"
    if origin in (Union, types.UnionType):
        return " or ".join("null" if i is types.NoneType else _type(i) for i in inner)
    if origin in (list, tuple):
        return f"list of {_type(inner[0])}"
    if origin is dict:
        return f"object of {_type(inner[1])}"
    if dataclasses.is_dataclass(annotation):
        name = annotation.__name__
        return f"[{name}](#{name.lower()})"
    return _NAMES[annotation]

"""Keys of a table of a TOML file, from its pydantic model."""

import types
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
from pydantic import BaseModel, BeforeValidator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined as Undefined

from build_time.reference.markdown import code, table, text
from hil_emulator.config.table import QuantityReader
from hil_emulator.model.declare import Param
from hil_emulator.units import show

HEADER = ("key", "value", "default", "bounds", "meaning")

_NAMES = {str: "text", int: "integer", float: "number", bool: "true or false"}


def keys(model: type[BaseModel], leave_out: Sequence[str] = ()) -> str:
    """Return the table of a model's keys.

    Raises:
        ValueError: a key is declared without a meaning.

    """
    fields = {f.alias or n: f for n, f in model.model_fields.items() if n not in leave_out}
    return table(HEADER, [_row(f"{model.__name__}.{n}", n, f) for n, f in fields.items()])


def params(declared: Mapping[str, Param]) -> str:
    """Return the table of quantities, by the keys that set them."""
    rows = [
        (code(name), quantity(p), "", text(QuantityReader(p).bounds), text(p.meaning))
        for name, p in declared.items()
    ]
    return table(HEADER, rows)


def quantity(param: Param) -> str:
    """Return how a quantity is written: its unit, or a plain number."""
    return "number" if param.display_unit == "1" else f"quantity [{text(param.display_unit)}]"


def _row(place: str, name: str, field: FieldInfo) -> tuple[str, str, str, str, str]:
    reader = next((m for m in field.metadata if isinstance(m, QuantityReader)), None)
    meaning = field.description or (reader.param.meaning if reader else "")
    if not meaning:
        raise ValueError(f"{place} has no meaning: write a docstring below the field")
    if reader is None:
        return code(name), _value(_input(field)), _default(field), _limits(field), text(meaning)
    words = "".join(f" or {code(repr(w).replace(chr(39), chr(34)))}" for w in reader.words)
    default = _default(field, reader.param)
    return code(name), quantity(reader.param) + words, default, text(reader.bounds), text(meaning)


def _input(field: FieldInfo) -> Any:
    """Return the type of what the user writes, which a validator may turn into another one."""
    before = (m for m in field.metadata if isinstance(m, BeforeValidator))
    written = [
        m.json_schema_input_type for m in before if m.json_schema_input_type is not Undefined
    ]
    return written[0] if written else field.annotation


def _default(field: FieldInfo, param: Param | None = None) -> str:
    """Return the default of a key; "" where the key may be left out without one."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or value in ((), [], "", {}) or isinstance(value, BaseModel):
        return ""
    if param is not None:
        return text(show(value, param.unit, param.shown))
    return code(str(value).lower() if isinstance(value, bool) else f'"{value}"'
                if isinstance(value, str) else value)  # fmt: skip


def _limits(field: FieldInfo) -> str:
    """Return the bounds of a number, or that a list must not be empty."""
    low = next((m.ge for m in field.metadata if isinstance(m, annotated_types.Ge)), None)
    high = next((m.le for m in field.metadata if isinstance(m, annotated_types.Le)), None)
    if any(isinstance(m, annotated_types.MinLen) for m in field.metadata):
        return "not empty"
    if low is None and high is None:
        return ""
    return f"{low} ... {high}" if high is not None else f"at least {low}"


def _value(annotation: Any) -> str:
    """Return what may stand there, in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        limits = [_limits(m) for m in inner[1:] if isinstance(m, FieldInfo)]
        return " ".join([_value(inner[0]), *limits])
    if origin is Literal:
        return ", ".join(code(f'"{choice}"') for choice in inner)
    if origin in (Union, types.UnionType):
        return " or ".join(_value(i) for i in inner if i is not type(None))
    if origin in (list, tuple):
        if isinstance(inner[0], type) and issubclass(inner[0], BaseModel):
            return "array of tables"
        return f"list of {_value(inner[0])}"
    if origin is dict or (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
        return "table"
    return _NAMES.get(annotation, "text")

"""`requests.md`: every request of control port and panel, and the JSON Schema of all of them."""

import json
import re
import struct
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from build_time.reference.markdown import page, table, text
from hil_emulator.protocol.base import Request
from hil_emulator.protocol.offered import OF_OPERATOR, OF_PAGE, OF_RIG, TO_LOOP, Requests
from hil_emulator.protocol.stream import HEAD, HEAD_FIELDS, offset
from hil_emulator.remote.http_server import ROUTES

SCHEMA = "protocol.schema.json"
GROUPS: dict[str, Requests] = {
    "Of control port and panel": OF_RIG,
    "Of the panel: an operator's": OF_OPERATOR,
    "Of the panel: what a page shows": OF_PAGE,
    "Between the panel's process and the loop": tuple(v for v in TO_LOOP if v not in OF_RIG),
}
_TYPES = {"H": "unsigned 16 bit", "I": "unsigned 32 bit", "d": "IEEE 754, 64 bit"}
_LIMITS = {
    "minimum": "≥ {}", "maximum": "≤ {}", "minLength": "at least {} characters",
    "maxLength": "up to {} characters", "maxItems": "up to {} items", "pattern": "`{}`",
    "const": "`\"{}\"`",
}  # fmt: skip


def schema() -> dict[str, Any]:
    """Return the JSON Schema of the protocol: a request is any of `anyOf`."""
    verbs = [verb for group in GROUPS.values() for verb in group]
    models = [*verbs, *dict.fromkeys(verb.answer for verb in verbs)]
    _, definitions = models_json_schema([(m, "validation") for m in models])
    for verb in verbs:
        model = definitions["$defs"][verb.__name__]
        model["required"] = ["do", *model.get("required", ())]
        model["x-answer"] = f"#/$defs/{verb.answer.__name__}"
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "hil-emulator: requests of control port and panel, and their answers",
        "anyOf": [{"$ref": f"#/$defs/{verb.__name__}"} for verb in verbs],
        **definitions,
    }


def write() -> str:
    """Return the page."""
    defs = schema()["$defs"]
    parts = [
        f"Every request as JSON Schema: [{SCHEMA}]({SCHEMA}). Transport, limits and the order of "
        "messages: [protocol](protocol.md)."
    ]
    for title, verbs in GROUPS.items():
        parts.append(f"## {title}")
        for verb in verbs:
            parts.append(f"### {verb.verb()}\n\n{verb.__doc__}")
            routes = [f"`{method} {path}`" for (method, path), v in ROUTES.items() if v is verb]
            parts += [f"HTTP: {', '.join(routes)}."] if routes else []
            parts += _fields("argument", verb, defs)
            parts.append(f"Answer: {verb.answer.__doc__}")
            parts += _fields("field", verb.answer, defs)
    shared = ("FaultStatus", "NodeStatus", "BusStatus", "TimingStatus", "Reading", "FrameToSend")
    parts.append("## Parts of them")
    for name in shared:
        parts.append(f"### {name}\n\n{defs[name]['description']}")
        parts.append(table(("field", "type", "meaning"), _rows(defs[name], ())))
    parts.append(
        f"## Head of a binary message\n\nLittle-endian, {HEAD.size} bytes.\n\n"
        + table(("offset", "field", "type", "meaning"), _layout())
    )
    return page("Requests", *parts)


def _layout() -> Iterable[tuple[object, ...]]:
    for field in HEAD_FIELDS:
        assert struct.calcsize(field.code) in (2, 4, 8)
        yield offset(field.name), f"`{field.name}`", _TYPES[field.code], field.meaning


def _fields(title: str, model: type[BaseModel], defs: dict[str, Any]) -> list[str]:
    hidden = ("do", "id") if issubclass(model, Request) else ()
    rows = list(_rows(defs[model.__name__], hidden))
    return [table((title, "type", "meaning"), rows)] if rows else []


def _rows(model: dict[str, Any], hidden: tuple[str, ...]) -> Iterable[tuple[str, str, str]]:
    required = model.get("required", ())
    for name, field in model.get("properties", {}).items():
        if name not in hidden:
            optional = "" if name in required or "default" not in field else " (optional)"
            yield f"`{name}`{optional}", _type(field), text(field.get("description", ""))
    more = model.get("additionalProperties")
    if isinstance(more, dict):
        yield "further fields", _type(more), "options of the fault, or settings, by name"


def _type(field: dict[str, Any]) -> str:
    """Return a type in words, with its limits."""
    if "anyOf" in field:
        return " or ".join(_type(each) for each in field["anyOf"])
    if "$ref" in field:
        name = field["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "enum" in field:
        return ", ".join(f"`{json.dumps(word)}`" for word in field["enum"])
    words = field.get("type", "")
    if words == "array" and isinstance(field.get("items"), dict):
        words = f"array of {_type(field['items'])}" if field["items"] else words
    if words == "object" and isinstance(field.get("additionalProperties"), dict):
        words = f"object of {_type(field['additionalProperties'])}"
    limits = [_LIMITS[key].format(_plain(field[key])) for key in _LIMITS if key in field]
    return ", ".join([words, *limits])


def _plain(limit: object) -> str:
    return re.sub(r"\s", " ", f"{limit:.12g}" if isinstance(limit, float) else str(limit))


def schema_text() -> str:
    """Return the JSON Schema as text."""
    return json.dumps(schema(), indent=1) + "\n"

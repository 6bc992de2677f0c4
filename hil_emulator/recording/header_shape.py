"""Schema of a recording's header, which may be damaged or come from an untrusted source."""

import math
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.input_files import MIB, parse_json

_FIELD = {
    "name": str, "start": int, "bits": int, "signed": bool, "real": bool, "factor": float,
    "unit": str, "index": int, "subindex": int, "low": (float, None), "high": (float, None),
    "choices": str, "offset": float,
}  # fmt: skip
_MESSAGE = {
    "node": str, "pdo": str, "can_id": int, "size": int, "transmission_type": int,
    "event_timer_ms": int, "fields": [_FIELD], "extended": bool,
}  # fmt: skip

DIRECTIONS = "directions"
"""Key of whether a log of candump states the direction of each frame."""

SHAPE: dict[str, Any] = {
    "provenance": {str: str},
    "files": [str],
    "seed": int,
    "nodes": [[int]],
    "tick_ns": int,
    "capture": str,
    "columns": {str: str},
    "messages": [_MESSAGE],
    "services": [_MESSAGE],
    "sync_ms": int,
    "configuration": [str],
    "effects": {str: str},
    "supply_mates": [str],
    DIRECTIONS: bool,
}
"""Shape by key: a type, one of several, a list of a shape, an object with these keys, an object of
texts."""

OPTIONAL = {"nodes", "configuration", "effects", "services", "supply_mates", DIRECTIONS}
"""Keys that are missing in recordings of earlier versions."""

LARGEST = 16 * MIB
"""Largest header [B]: sixteen configurations of the largest size."""

SHORTEST_NS, LONGEST_NS = 10_000, 1_000_000_000
"""Longest tick [ns]: ten times the limit of a configuration."""

_EVENT_DRIVEN = 255
"""Transmission type of a PDO without a stated cadence (CiA 301 7.5.2.36)."""

_WORD = 64
"""Number of bits of a frame's data."""


def header_of_entry(file: Path, payload: bytes) -> dict[str, Any]:
    """Return the header of a journal's first entry.

    Raises:
        UserError: if it is damaged.

    """
    try:
        content = _of_today(parse_json(payload)) if len(payload) <= LARGEST else {}
        sound = _is_header(content)
    except (LookupError, TypeError, ValueError):
        sound = False
    if not sound:
        raise UserError(f"{file}: its header is damaged, so it cannot be read")
    return dict(content)


def _of_today(content: Any) -> Any:
    """Return a header in the format of this version.

    `HILREC1` had messages by name, and no SYNC. The keys that its messages lacked are not needed
    to decode frames. Older messages have 11-bit identifiers, and fields without words for their
    values or offset.
    """
    if not isinstance(content, dict):
        return content
    content = {"sync_ms": 0} | content
    if not any("name" in m for m in content["messages"]):
        converted = [
            {
                "extended": False,
                **m,
                "fields": [{"choices": "", "offset": 0.0, **f} for f in m["fields"]],
            }
            for m in content["messages"]
        ]
        return content | {"messages": converted}
    messages = []
    for old in content["messages"]:
        pdo, _, node = old["name"].partition("_")
        fields = [{**f, "index": 0, "subindex": 0, "low": None, "high": None, "choices": "",
                   "offset": 0.0}
                  for f in old["fields"]]  # fmt: skip
        messages.append(
            {"node": node, "pdo": pdo, "can_id": old["can_id"], "size": old["size"],
             "transmission_type": _EVENT_DRIVEN, "event_timer_ms": 0, "fields": fields,
             "extended": False}
        )  # fmt: skip
    return content | {"messages": messages}


def _is_header(content: Any) -> bool:
    if not isinstance(content, dict):
        return False
    shape = {k: s for k, s in SHAPE.items() if k in content or k not in OPTIONAL}
    if not _fits({k: v for k, v in content.items() if k in shape}, shape):
        return False
    fields = [field for message in content["messages"] for field in message["fields"]]
    return (
        "time" in content["columns"]
        and {"configuration", "digest"} <= content["provenance"].keys()
        and content["seed"] >= 0
        and SHORTEST_NS <= content["tick_ns"] <= LONGEST_NS
        and all(len(pair) == 2 for pair in content.get("nodes", []))
        and all(map(_is_place, fields))
    )


def _is_place(field: dict[str, Any]) -> bool:
    start, bits = field["start"], field["bits"]
    inside = start >= 0 and bits > 0 and start + bits <= _WORD
    return inside and (not field["real"] or bits in (32, 64))


def _fits(value: Any, shape: Any) -> bool:
    """Return whether a value has a shape."""
    if isinstance(shape, list):
        return isinstance(value, list) and all(_fits(item, shape[0]) for item in value)
    if isinstance(shape, dict):
        if not isinstance(value, dict):
            return False
        if str in shape:
            return all(_fits(text, str) for pair in value.items() for text in pair)
        return value.keys() == shape.keys() and all(_fits(value[k], shape[k]) for k in shape)
    if isinstance(shape, tuple):
        return any(_fits(value, one) for one in shape)
    if shape is None:
        return value is None
    if shape is float:
        return type(value) in (int, float) and math.isfinite(value)
    if shape is str:
        return isinstance(value, str) and value.encode(errors="replace").decode() == value
    return type(value) is shape

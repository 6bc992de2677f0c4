"""JSON Schema of the files, by which editors complete and check them."""

from typing import Any

from hil_emulator.config.bench import Kind
from hil_emulator.config.machine import MachineTable
from hil_emulator.config.schema import schema
from hil_emulator.model.effects import CATALOGUE

DIALECT = "http://json-schema.org/draft-07/schema#"
"""Version of JSON Schema that TOML editors support."""

_LAYER = Kind("", "a file that may be laid over another one", {})
"""Kind without required keys: another file may state what one leaves out."""


def json_schema(what: str) -> dict[str, Any]:
    """Return the schema of a configuration, or of a machine of several actuators.

    It requires no table of the plant, because a file may be a layer, and the required keys depend
    on the bench. Effects are those of the catalogue.
    """
    model = MachineTable if what == "machine" else schema(CATALOGUE, _LAYER)
    schema_of_file: dict[str, Any] = _without_null(model.model_json_schema(by_alias=True))
    return {"$schema": DIALECT, **schema_of_file, "title": f"hil-emulator {what}"}


def _without_null(node: Any) -> Any:
    """Return a schema without null, which TOML lacks, and without titles that repeat the keys."""
    if isinstance(node, list):
        return [_without_null(inner) for inner in node]
    if not isinstance(node, dict):
        return node
    kept = {
        key: _without_null(inner) for key, inner in node.items()
        if not (key == "title" and isinstance(inner, str))
        and not (key == "default" and not isinstance(inner, str | int | list))
    }  # fmt: skip
    choices = [inner for inner in kept.get("anyOf", []) if inner != {"type": "null"}]
    if len(choices) == 1:
        kept |= choices[0] | {k: v for k, v in kept.items() if k != "anyOf"}
        del kept["anyOf"]
    elif choices:
        kept["anyOf"] = choices
    return kept

"""JSON Schema of the files, by which editors complete and check them."""

from typing import Any

from hil_emulator.config.bench import Kind
from hil_emulator.config.machine import MachineTable
from hil_emulator.config.schema import schema
from hil_emulator.config.table import QuantityReader
from hil_emulator.config.tolerances import KEY, LARGEST
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Param
from hil_emulator.model.effects import CATALOGUE

DIALECT = "http://json-schema.org/draft-07/schema#"
"""Version of JSON Schema that TOML editors support."""

TOLERANCE = Param(
    KEY, "1", "relative standard deviation of the value, for `identify`", 0.1, 0.0, LARGEST, "%"
)

_LAYER = Kind("", "a file that may be laid over another one", {})
"""Kind without required keys: another file may state what one leaves out."""


def json_schema(what: str) -> dict[str, Any]:
    """Return the schema of a configuration, or of a machine of several actuators.

    It requires no table of the plant, because a file may be a layer, and the required keys depend
    on the bench. Effects are those of the catalogue.
    """
    model = MachineTable if what == "machine" else schema(CATALOGUE, _LAYER)
    schema_of_file: dict[str, Any] = _without_null(model.model_json_schema(by_alias=True))
    if what == "configuration":
        _add_tolerances(schema_of_file["$defs"])
    return {"$schema": DIALECT, **schema_of_file, "title": f"hil-emulator {what}"}


def _add_tolerances(definitions: dict[str, Any]) -> None:
    """Let values of the plant, and its tables and effects, have a tolerance."""
    reader = QuantityReader(TOLERANCE)
    definitions[KEY] = {"anyOf": reader.forms, "description": reader.description}
    for table in PARAMS:
        effects = [_add_tolerance(form) for form in definitions[table]["properties"].values()]
        for name in {table, *filter(None, effects)}:
            properties = definitions[name]["properties"]
            if name != table:
                for form in properties.values():
                    _add_tolerance(form)
            properties[KEY] = {"$ref": f"#/$defs/{KEY}"}


def _add_tolerance(form: dict[str, Any]) -> str:
    """Add `{ value, tolerance }` to the forms of a value; return the effect whose table is one."""
    forms = form.pop("anyOf", None)
    if forms is None:
        forms = [{key: form.pop(key) for key in ("type", "pattern", "examples") if key in form}]
    plain = [f for f in forms if "$ref" not in f]
    uncertain = {
        "type": "object",
        "properties": {"value": {"anyOf": plain}, KEY: {"$ref": f"#/$defs/{KEY}"}},
        "required": ["value", KEY],
        "additionalProperties": False,
    }
    form["anyOf"] = [*forms, uncertain]
    return next((str(f["$ref"]).rpartition("/")[2] for f in forms if "$ref" in f), "")


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

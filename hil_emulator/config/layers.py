"""Layers of files, later ones over earlier ones, before the check."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator import input_files
from hil_emulator.config import datasheet
from hil_emulator.config.effect_files import read_effects
from hil_emulator.config.tolerances import FileTolerance, by_field, taken_out
from hil_emulator.config.toml_file import parse_toml
from hil_emulator.errors import UserError, brief
from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE

Admit = Callable[[Path, bytes], None]
"""Called before an effect file runs, with its path and content; raises `UserError` to refuse it."""


@dataclass(frozen=True)
class Layers:
    """Content of all files.

    Attributes:
        merged: their tables.
        origin: the file that sets a key, by its path.
        effects: the catalogue, with the files' own effects at its end.
        tolerances: relative standard deviation by field, where a file states it.

    """

    merged: dict[str, Any]
    origin: dict[tuple[str, ...], Path]
    effects: tuple[Effect, ...]
    tolerances: dict[str, float]


def laid(files: Sequence[Path], texts: Sequence[str], admit: Admit) -> Layers:
    """Lay the texts of files over each other.

    Raises:
        UserError: if a file is not TOML, names an effect file that fails, or describes a machine.

    """
    layers = [(f, parse_toml(f, text)) for f, text in zip(files, texts, strict=True)]
    user_effects = [e for file, layer in layers for e in _user_effects(file, layer, admit)]
    effects = (*CATALOGUE, *user_effects)
    knobs: dict[tuple[str, ...], str] = {(e.stage.table, e.name): e.knob.name for e in effects}
    merged: dict[str, Any] = {}
    origin: dict[tuple[str, ...], Path] = {}
    tolerances: dict[tuple[str, ...], FileTolerance] = {}
    for file, layer in layers:
        plain, stated = taken_out(layer, file)
        _lay_over(merged, _with_knobs(plain, knobs), file, origin)
        tolerances |= stated
    _refuse_machine(merged, origin)
    return Layers(merged, origin, effects, by_field(tolerances, origin, knobs))


def _refuse_machine(merged: Mapping[str, Any], origin: Mapping[tuple[str, ...], Path]) -> None:
    """Refuse a machine of several actuators; the message names the files of a single one."""
    if "actuator" not in merged:
        return
    given = merged["actuator"]
    first = given[0] if isinstance(given, list) and given else {}
    files = first.get("files") if isinstance(first, dict) else None
    named = " ".join(map(str, files)) if isinstance(files, list) else "knee.toml"
    raise UserError(
        f"{origin[('actuator',)]}: describes a machine of several actuators, this command takes "
        f"one: name its files, such as {brief(named)}; followed by those of a supply that it "
        "shares, they describe it alone on that"
    )


def _user_effects(file: Path, layer: dict[str, Any], admit: Admit) -> list[Effect]:
    """Import the effect files that a layer names; each defines a tuple EFFECTS."""
    table = layer.get("model")
    named = table.get("effects", []) if isinstance(table, dict) else []
    user_effects: list[Effect] = []
    for name in named if isinstance(named, list) else []:
        path = file.parent / str(name)
        try:
            content = input_files.read_bytes(path, input_files.EFFECTS)
            admit(path, content)
            user_effects += read_effects(path, content)
        except UserError:
            raise
        except (Exception, SystemExit) as error:  # the file is arbitrary Python
            raise UserError(
                f"{file}: model.effects: {path}: {type(error).__name__}: {error}; an effect file "
                "is Python that declares effects and lists them in EFFECTS"
            ) from None
    return user_effects


def _with_knobs(layer: dict[str, Any], knobs: Mapping[tuple[str, ...], str]) -> dict[str, Any]:
    """Expand `effect = "value"` to `effect = {knob = "value"}`."""

    def spelt(table: str, content: object) -> object:
        if not isinstance(content, dict):
            return content
        if table == "sensors":
            return {name: spelt("sensors.", channel) for name, channel in content.items()}
        place = table.rstrip(".")
        return {
            key: {knobs[place, key]: value}
            if (place, key) in knobs and not isinstance(value, dict)
            else value
            for key, value in content.items()
        }

    return {table: spelt(table, content) for table, content in layer.items()}


def _lay_over(
    below: dict[str, Any], above: dict[str, Any], file: Path, origin: dict[tuple[str, ...], Path],
    path: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Merge `above` into `below`; a new way to state a quantity replaces the old one."""
    for pair in datasheet.ALTERNATIVES.get(path[0], ()) if len(path) == 1 else ():
        for new, old in (pair, pair[::-1]):
            if new & above.keys() and not old & above.keys():
                for key in old & below.keys():
                    del below[key]
    for key, value in above.items():
        here = (*path, key)
        origin[here] = file
        if isinstance(value, dict) and isinstance(below.get(key), dict):
            _lay_over(below[key], value, file, origin, here)
        elif isinstance(value, dict):
            below[key] = {}
            _lay_over(below[key], value, file, origin, here)
        else:
            below[key] = value

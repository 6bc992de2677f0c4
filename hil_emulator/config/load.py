"""Reading of files into a `Configuration`, or into one message with every mistake."""

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil_emulator.config.assemble import configuration
from hil_emulator.config.bench import kind_of
from hil_emulator.config.configuration import Configuration
from hil_emulator.config.layers import Admit, laid
from hil_emulator.config.mistakes import describe
from hil_emulator.config.rated_current import KEY, rated_current
from hil_emulator.config.schema import schema
from hil_emulator.config.toml_file import read_text, read_toml
from hil_emulator.errors import UserError
from hil_emulator.units import axis

__all__ = [
    "Configuration",
    "built_in",
    "is_rotary",
    "load",
    "load_rig",
    "load_texts",
    "load_whole",
    "on_bus",
    "whole",
]


def load(files: Sequence[Path], *, on_bus: bool = False) -> Configuration:
    """Read and check configuration files, later ones laid over earlier ones.

    The effect files that they name are run.

    Args:
        files: the files.
        on_bus: whether nodes are required.

    Raises:
        UserError: with every mistake found, each with its place.

    """
    texts = [read_text(file, "configuration") for file in files]
    return load_texts(files, texts, lambda path, content: None, on_bus=on_bus)


def load_texts(
    files: Sequence[Path], texts: Sequence[str], admit: Admit, *, on_bus: bool = False
) -> Configuration:
    """Check the texts of configuration files without reading these.

    Args:
        files: origin of the texts; paths in them are relative to it.
        texts: of each file.
        admit: decides which effect files may run.
        on_bus: whether nodes are required.

    Raises:
        UserError: with every mistake and its place.

    """
    layers = laid(files, texts, admit)
    kind = kind_of(layers.merged)
    model = schema(layers.effects, kind, on_bus=on_bus and kind.whole)
    try:
        context = {KEY: rated_current(layers.merged)}
        with axis(rotary=_is_rotary(layers.merged)):
            checked = model.model_validate(layers.merged, context=context)
    except ValidationError as error:
        raise UserError(describe(error, model, layers.merged, layers.origin, files)) from None
    return configuration(checked, layers, files, texts)


def is_rotary(files: Sequence[Path]) -> bool:
    """Return whether configuration files describe a rotary axis; files with mistakes do not."""
    for file in reversed(files):
        with contextlib.suppress(UserError):
            rig = read_toml(file, "configuration").get("rig")
            if isinstance(rig, Mapping) and "motion" in rig:
                return bool(rig["motion"] == "rotary")
    return False


def _is_rotary(merged: Mapping[str, Any]) -> bool:
    """Return whether unchecked tables describe a rotary axis."""
    rig = merged.get("rig")
    return isinstance(rig, Mapping) and rig.get("motion") == "rotary"


def load_whole(files: Sequence[Path]) -> Configuration:
    """Read and check a configuration of a whole actuator, which can be simulated.

    Raises:
        UserError: as `load` does, or if it describes less, or an FMU replaces the plant.

    """
    return built_in(whole(load(files)))


def built_in(config: Configuration) -> Configuration:
    """Return a configuration with the built-in plant.

    Raises:
        UserError: if an FMU replaces it.

    """
    if config.fmu:
        raise UserError(
            f"needs the built-in plant, and {config.fmu.file.name} moves in its place: leave the "
            "file with [plant] fmu out"
        )
    return config


def whole(config: Configuration) -> Configuration:
    """Return a configuration that describes a whole actuator.

    Raises:
        UserError: if it describes less.

    """
    if not config.bench.whole:
        raise UserError(
            f"{config.files[-1]}: describes {config.bench}; this command simulates the whole "
            'actuator: write kind = "actuator" under [bench], or leave it out, and give the rest'
        )
    return config


def load_rig(files: Sequence[Path]) -> Configuration:
    """Read and check a configuration whose devices go on a bus.

    Raises:
        UserError: as `load_whole` does, or if there is no device.

    """
    return on_bus(load(files, on_bus=True))


def on_bus(config: Configuration) -> Configuration:
    """Return a configuration of a whole actuator that has devices on a bus.

    Raises:
        UserError: if it has no device, or does not describe a whole actuator.

    """
    whole(config)
    if not config.nodes:
        raise UserError(
            f"{config.files[-1]}: no [[node]]: nothing of it is on a bus; add "
            '[[node]] with id = 5 and eds = "hydraulic_actuator.eds"'
        )
    return config

"""`hil-emulator export`: EDS, DCF and DBC of a configuration."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.config.load import Configuration, load
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.export.can_database import database
from hil_emulator.export.electronic_data_sheet import dcf, eds
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.places import near
from hil_emulator.rig import nodes

BIT_RATE = 1_000_000
"""Assumed where the bus has none: the fastest classical CAN [bit/s]."""


def export(files: Sequence[Path], folder: Path) -> None:
    """Write EDS and DCF of each node, and a DBC of the bus.

    Raises:
        UserError: for whatever is wrong with the configuration, or for a folder that cannot be
            written to.

    """
    config = load(files)
    made = nodes(config, [c.name for c in CHANNELS])
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in contents(config, made).items():
            (folder / name).write_text(text, encoding="latin-1", newline="\r\n")
            click.echo(near(folder / name))
    except OSError as error:
        raise UserError(f"{folder}: cannot be written: {error.strerror}") from None


def contents(config: Configuration, made: Sequence[Node]) -> dict[str, str]:
    """Return the files' texts by their names."""
    files: dict[str, str] = {}
    pdos = {}
    bit_rate = int(config.bus.get("bitrate", BIT_RATE))
    for node, settings in zip(made, config.nodes, strict=True):
        name = f"{settings.eds.stem}_{node.node_id}"
        files[f"{name}.eds"] = eds(node.dictionary, f"{name}.eds")
        files[f"{name}.dcf"] = dcf(node.dictionary, f"{name}.dcf", name, bit_rate)
        pdos[name] = node.pdos
    bus = database(pdos, config.sync_period_ns // 1_000_000)
    files["bus.dbc"] = bus.as_dbc_string()
    return files

"""`hil-emulator export`: EDS and DCF of every node, a DBC of every bus."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import click

from hil_emulator.config.machine import MachineSettings, load_machine
from hil_emulator.device.collisions import collisions
from hil_emulator.device.message import message
from hil_emulator.device.node import Node
from hil_emulator.device.service_messages import services
from hil_emulator.errors import UserError
from hil_emulator.export.can_database import dbc
from hil_emulator.export.electronic_data_sheet import dcf, eds
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.platform.output_files import write_texts
from hil_emulator.platform.paths import near
from hil_emulator.simulation.node_factory import nodes


def export(files: Sequence[Path], folder: Path, *, overwrite: bool = False) -> None:
    """Write EDS and DCF of each node, and a DBC of each bus.

    Raises:
        UserError: for every error of the configuration, or for files that exist or cannot be
            written.

    """
    texts = {folder / name: text for name, text in contents(load_machine(files)).items()}
    write_texts(texts, overwrite=overwrite, encoding="latin-1", newline="\r\n")
    for file in texts:
        click.echo(near(file))


def contents(settings: MachineSettings) -> dict[str, str]:
    """Return the files' texts by their names.

    Raises:
        UserError: if a node cannot be made, or COB-IDs on a bus collide.

    """
    texts: dict[str, str] = {}
    for bus, wire in settings.wires.items():
        bit_rate = wire.assumed_bit_rate
        named = dict(_nodes(settings, bus))
        wrong = collisions(list(named.values()))
        if wrong:
            raise UserError(f"bus {bus}: {'; '.join(wrong)}")
        for name, node in named.items():
            texts[f"{name}.eds"] = eds(node.dictionary, f"{name}.eds")
            texts[f"{name}.dcf"] = dcf(node.dictionary, f"{name}.dcf", name, bit_rate)
        sync_ms = settings.actuators[0].config.sync_period_ns // 1_000_000
        messages = [message(name, p) for name, node in named.items() for p in node.pdos if p.active]
        texts[f"{bus}.dbc"] = dbc([*messages, *services(named)], sync_ms)
    return texts


def _nodes(settings: MachineSettings, bus: str) -> Iterator[tuple[str, Node]]:
    """Yield the nodes on a bus, each with a unique name."""
    several = len(settings.actuators) > 1
    for actuator in settings.actuators:
        if actuator.bus == bus:
            made = nodes(actuator.config, [channel.name for channel in CHANNELS])
            for node, source in zip(made, actuator.config.nodes, strict=True):
                name = f"{source.eds.stem}_{node.node_id}"
                yield f"{actuator.name}_{name}" if several else name, node

"""`hil-emulator check`: what a configuration would do, without doing it."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import Configuration, load
from hil_emulator.device.node import Node
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.places import near
from hil_emulator.rig import nodes

BIT_RATE = 1_000_000
"""Assumed where the bus has none: the fastest classical CAN [bit/s]."""


def check(files: Sequence[Path]) -> None:
    """Validate a configuration and print what it binds, maps and loads the bus with.

    Raises:
        UserError: for whatever is wrong with it.

    """
    config = load(files)
    made = nodes(config, [c.name for c in CHANNELS])
    click.echo(f"{', '.join(near(f) for f in config.files)}: valid (digest {config.digest})\n")
    for node, settings in zip(made, config.nodes, strict=True):
        click.echo(f"Node {node.node_id}, {near(settings.eds)}")
        click.echo(_bindings(node) + "\n")
        click.echo(_pdo_map(node) + "\n")
    click.echo(_load(config, made))


def _bindings(node: Node) -> str:
    rows = [
        (f"{b.index:04X}:{b.subindex:02X}", b.name, b.type, f"{b.factor:g} {b.unit}", b.bound_to)
        for b in node.bindings()
    ]
    return text_table(("object", "name", "type", "one count", "bound to"), rows)


def _pdo_map(node: Node) -> str:
    rows = [
        (
            p.name,
            f"{p.can_id:03X}" if p.exists else "-",
            p.transmission_type,
            f"{p.event_timer_ms} ms" if p.event_timer_ms else "-",
            p.size,
            ", ".join(p.entries),
        )
        for p in node.pdo_map()
    ]
    return text_table(("PDO", "COB-ID", "type", "timer", "bytes", "objects"), rows)


def _load(config: Configuration, made: Sequence[Node]) -> str:
    bits = sum(
        node.bus_load(config.sync_period_ns // 1000, config.tick_ns // 1000) for node in made
    )
    rate = int(config.bus.get("bitrate", BIT_RATE))
    text = (
        f"Bus load at most {bits / rate:.0%} of {rate / 1000:g} kbit/s "
        f"(SYNC each {config.sync_period_ns / 1e6:g} ms, set points at the same rate)"
    )
    if bits > rate:
        text += "\nwarning: more than it can carry; lengthen the event timers or raise the bit rate"
    return text

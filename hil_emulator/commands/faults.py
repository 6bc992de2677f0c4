"""`hil-emulator faults`: the vocabulary of faults."""

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.declare import FaultKind, FaultParam


def faults() -> None:
    """Print every kind of fault, what it can befall and what can be said about it."""
    rows = [(k.layer.value, k.name, k.meaning, _params(k), ", ".join(k.targets)) for k in KINDS]
    click.echo(text_table(("layer", "kind", "meaning", "parameters", "targets"), rows))
    click.echo(
        "\nEvery fault also takes start, duration, ramp (times), probability, seed, condition. A "
        "message is\nnmt, sync, emcy, sdo, heartbeat, rpdo1 ... tpdo4, or a COB-ID such as 0x185."
        "\nAn object is 0x7130:1, that of one node node7.0x7130:1."
    )


def _params(kind: FaultKind) -> str:
    return ", ".join(f"{p.name} [{_unit(p)}]" for p in kind.params)


def _unit(param: FaultParam) -> str:
    return {"span": "unit of the channel", "span/s": "unit of the channel/s", "text": "name"}.get(
        param.unit, param.shown or param.unit
    )

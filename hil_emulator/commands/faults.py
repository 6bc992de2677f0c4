"""`hil-emulator faults`: the vocabulary of faults."""

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.declare import SPAN, SPAN_PER_SECOND, TEXT, FaultKind, FaultParam
from hil_emulator.units import show


def faults() -> None:
    """Print every kind of fault, what it can befall and what can be said about it."""
    rows = [(k.layer.value, k.name, k.meaning, _params(k), ", ".join(k.targets)) for k in KINDS]
    click.echo(text_table(("layer", "kind", "meaning", "parameters", "targets"), rows))
    click.echo(
        "\nA value stands for what is not said; that of a sensor's fault is a part of the channel's"
        " span.\nEvery fault also takes start, duration, ramp (times), probability, seed,"
        " condition.\nA message is nmt, sync, emcy, sdo, heartbeat, rpdo1 ... tpdo4, or a COB-ID"
        " such as 0x185."
        "\nAn object is 0x7130:1, that of one node node7.0x7130:1."
    )


def _params(kind: FaultKind) -> str:
    return ", ".join(f"{p.name} = {_usual(p)}" for p in kind.params)


def _usual(param: FaultParam) -> str:
    """Return what a parameter is when nothing is said of it."""
    if param.unit == TEXT:
        return "NAME"
    assert param.default is not None
    if param.unit in (SPAN, SPAN_PER_SECOND):
        return f"{param.default:.3g} {_unit(param)}"
    return show(param.default, param.unit, param.shown)


def _unit(param: FaultParam) -> str:
    return {SPAN: "spans", SPAN_PER_SECOND: "spans/s"}[param.unit]

"""`hil-emulator faults`: the kinds of faults."""

import math

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.declare import SPAN, SPAN_PER_SECOND, TEXT, FaultKind, FaultParam
from hil_emulator.units import show


def faults() -> None:
    """Print every kind of fault with its targets and parameters."""
    rows = [(k.layer.value, k.name, k.meaning, _params(k), ", ".join(k.targets)) for k in KINDS]
    click.echo(text_table(("layer", "kind", "meaning", "parameters", "targets"), rows))
    click.echo(
        "\nThe values are defaults; those of a sensor's fault are shares of the channel's span."
        "\nEvery fault also takes start, duration, ramp (times), probability, seed,"
        " condition.\nA message is nmt, sync, emcy, sdo, heartbeat, rpdo1 ... tpdo4, or a COB-ID"
        " such as 0x185."
        "\nAn object is 0x7130:1, that of one node node7.0x7130:1."
    )


def _params(kind: FaultKind) -> str:
    return ", ".join(f"{p.name} = {usual(p)}" for p in kind.params)


def usual(param: FaultParam) -> str:
    """Return the default of a parameter, "NAME" for a required name."""
    if param.unit == TEXT:
        return "NAME"
    assert param.default is not None
    return _amount(param.default, param)


def bounds(param: FaultParam) -> str:
    """Return the smallest and the largest value of a parameter, "" for a name."""
    if param.unit == TEXT:
        return ""
    return f"{_amount(param.low, param)} ... {_amount(param.high, param)}"


def _amount(value: float, param: FaultParam) -> str:
    if param.unit in (SPAN, SPAN_PER_SECOND) and math.isfinite(value):
        return f"{value:.3g} {_unit(param)}"
    return show(value, param.unit, param.shown)


def _unit(param: FaultParam) -> str:
    return {SPAN: "spans", SPAN_PER_SECOND: "spans/s"}[param.unit]

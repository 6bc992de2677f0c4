"""`hil-emulator effects`: the catalogue."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import load
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.sensors import Channel
from hil_emulator.units import show


def effects(files: Sequence[Path], as_json: bool) -> None:
    """Print every effect the model knows, with those that configurations bring.

    Raises:
        UserError: for what is wrong with a configuration.

    """
    known = load(files).effects if files else CATALOGUE
    if as_json:
        click.echo(json.dumps([describe(e) for e in known], indent=2, ensure_ascii=False))
        return
    rows = [
        (
            e.stage.table,
            e.name,
            e.knob.name,
            amount(e.knob.typical, e.knob),
            f"{amount(e.knob.low, e.knob)} ... {amount(e.knob.high, e.knob)}",
            amount(e.off, e.knob),
            e.equation,
        )
        for e in known
    ]
    click.echo(text_table(("table", "effect", "knob", "typical", "range", "off", "equation"), rows))
    click.echo(
        "\nA sensor effect stands in [sensors.CHANNEL]; its values are shown as parts of the "
        "channel's span."
    )


def amount(value: float, param: Param | Channel) -> str:
    """Return a value for people; one of a transducer without a channel as a part of its span."""
    if param.unit.startswith("span") and math.isfinite(value):
        return f"{value:g} {param.unit}"
    return show(value, param.unit, param.shown)


def _number(value: float) -> float | str:
    """Return a number as JSON can hold it."""
    return value if math.isfinite(value) else str(value)


def _param(param: Param) -> dict[str, Any]:
    return {
        "name": param.name,
        "unit": param.unit,
        "meaning": param.meaning,
        "typical": _number(param.typical),
        "low": _number(param.low),
        "high": _number(param.high),
        "source": param.source,
    }


def describe(effect: Effect) -> dict[str, Any]:
    """Return everything an effect declares, SI, as JSON can hold it; infinity is "inf"."""
    return {
        "name": effect.name,
        "stage": effect.stage.name,
        "table": effect.stage.table,
        "knob": effect.knob.name,
        "meaning": effect.knob.meaning,
        "unit": effect.knob.unit,
        "off": _number(effect.off),
        "typical": _number(effect.knob.typical),
        "low": _number(effect.knob.low),
        "high": _number(effect.knob.high),
        "shape": [_param(p) for p in effect.shape],
        "equation": effect.equation,
        "source": effect.source,
        "signature": effect.signature,
        "not_modelled": effect.not_modelled,
    }

"""`hil-emulator effects`: the catalogue."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import load
from hil_emulator.model.constants import S1
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.sensors import Channel
from hil_emulator.units import show


def effects(files: Sequence[Path], as_json: bool) -> None:
    """Print every effect of the catalogue, with those of configurations.

    Raises:
        UserError: for every error of a configuration.

    """
    catalogue = load(files).effects if files else CATALOGUE
    if as_json:
        click.echo(json.dumps([describe(e) for e in catalogue], indent=2, ensure_ascii=False))
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
        for e in catalogue
    ]
    click.echo(text_table(("table", "effect", "knob", "typical", "range", "off", "equation"), rows))
    click.echo(
        "\nCurrents of the valve are those of a rated current of 10 mA, and scale with it. In a "
        'configuration they may be shares of it, such as "20 %".\n'
        "A sensor effect is set in [sensors.CHANNEL]; its values are shown as parts of the "
        f"channel's span.\n{S1}"
    )


def amount(value: float, param: Param | Channel) -> str:
    """Return a value as text; that of a transducer without a channel as a part of its span."""
    if param.unit.startswith("span") and math.isfinite(value):
        return f"{value:g} {param.unit}"
    return show(value, param.unit, param.shown)


def _number(value: float) -> float | str:
    """Return a number for JSON."""
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
    """Return the declaration of an effect for JSON, in SI; infinity is "inf"."""
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

"""`hil-emulator linear`: the linear model at an operating point, three ways."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from hil_emulator.api.linear_model import LinearModel, linearised, one_of_each_pair, pole_name
from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.load import load_whole
from hil_emulator.model.constants import S1
from hil_emulator.pages import drawing
from hil_emulator.platform.paths import near

_UNITS = {
    "k_qa": "m^3/(s*A)",
    "k_qb": "m^3/(s*A)",
    "k_ca": "m^3/(s*Pa)",
    "k_cb": "m^3/(s*Pa)",
    "k_pa": "Pa/A",
    "k_pb": "Pa/A",
    "k_uv": "N/(s*A)",
    "k_fh": "1/s",
    "k_xp": "N/m",
}


def run(
    files: Sequence[Path],
    position: float | None,
    current: float,
    as_json: bool,
    picture: Path | None,
    *,
    overwrite: bool = False,
) -> None:
    """Linearise at a position [m], at rest or in the steady motion of a current [A].

    Raises:
        UserError: if the configuration is wrong or has no equilibrium there.

    """
    config = load_whole(files)
    with waiting(PREPARING, json=as_json):
        forms = linearised(config, position, current)
    if as_json:
        click.echo(json.dumps(_content(forms), indent=2))
    else:
        click.echo(_text(forms))
    if picture:
        drawing.save(forms.figure(), picture, overwrite=overwrite)
        click.echo(f"picture: {near(picture)}", err=True)


def _root(value: complex) -> str:
    pair = f" ± {value.imag:.1f}j ({abs(value) / 2 / math.pi:.1f} Hz)" if value.imag else ""
    return f"{value.real:.2f}{pair}"


def _text(forms: LinearModel) -> str:
    lines = [
        f"{forms.operating_point}\n",
        text_table(
            ("coefficient", "value", "zero lap", "unit", "rests on an assumed"),
            [
                (
                    name,
                    f"{value + 0.0:.5g}",
                    f"{forms.zero_lap[name] + 0.0:.5g}",
                    unit,
                    ", ".join(forms.assumed.get(name, ())),
                )
                for (name, value), unit in zip(
                    forms.coefficients.items(), _UNITS.values(), strict=True
                )
            ],
        ),
        "\nvalue: with what leaks past the lands; around null both edges of a port pass oil, and "
        "the flow gain is that of both. zero lap: sharp lands without leakage, S1 eq. 3.21-3.37; "
        "at rest those of extension.",
    ]
    for name, responses in forms.responses.items():
        lines.append(f"\n{name}: poles [rad/s]")
        poles = one_of_each_pair(responses["load_force"].poles)
        lines += [f"  {_root(p)}{_assumed(forms, name, i)}" for i, p in enumerate(poles)]
        for output, response in responses.items():
            zeros = ", ".join(_root(z) for z in one_of_each_pair(response.zeros))
            lines.append(f"{name}: zeros of {output}/u [rad/s]: {zeros or 'no zeros'}")
    lines.append(
        "\nS1 and complete have viscous friction only; exact has every effect that is on, but for "
        "what is left out below. At rest dry friction is a stiff damper in it."
    )
    if forms.assumed:
        lines.append(
            "Rests on an assumed: no file states that value; where it lies as far from the default "
            "as among usual machines, the number changes by more than 10 %."
        )
    lines += [f"Left out: {text}" for text in forms.left_out]
    lines.append(S1)
    return "\n".join(lines)


def _assumed(forms: LinearModel, form: str, place: int) -> str:
    """Return the mark of a pole that rests on defaults."""
    fields = forms.assumed.get(pole_name(form, place), ())
    return f"  rests on an assumed {', '.join(fields)}" if fields else ""


def _pairs(values: Any) -> list[list[float]]:
    return [[float(np.real(v)), float(np.imag(v))] for v in values]


def _finite(numbers: Mapping[str, float]) -> dict[str, float | str]:
    """Return numbers for JSON, infinity as text."""
    return {name: n if math.isfinite(n) else str(n) for name, n in numbers.items()}


def _content(forms: LinearModel) -> dict[str, Any]:
    """Return all numbers for JSON; roots as [real, imaginary], rad/s."""
    return {
        "operating_point": {name: float(value) for name, value in forms.exact.signals.items()},
        "coefficients": _finite(forms.coefficients),
        "zero_lap": _finite(forms.zero_lap),
        "left_out": forms.left_out,
        "rests_on_assumed": {name: list(fields) for name, fields in forms.assumed.items()},
        "forms": {
            name: {
                output: {"zeros": _pairs(r.zeros), "poles": _pairs(r.poles)}
                for output, r in responses.items()
            }
            for name, responses in forms.responses.items()
        },
    }

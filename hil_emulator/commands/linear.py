"""`hil-emulator linear`: the linear model at an operating point, three ways."""

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import Configuration, load_whole
from hil_emulator.errors import UserError
from hil_emulator.model import linear as s1
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.linearise import Linearisation, rest, steady_motion
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, VERMILION
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.simulation.rig import compiled

_DECADES = np.logspace(-1, 3, 400)
"""Frequencies of the picture [Hz]."""

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


@dataclasses.dataclass(frozen=True)
class Forms:
    """S1's forms and the exact one at the same operating point.

    Attributes:
        exact: the Jacobians of the compiled model there.
        coefficients: S1's, by name, SI.
        responses: each form's transfer functions from valve current to both forces.

    """

    exact: Linearisation
    coefficients: dict[str, float]
    responses: dict[str, dict[str, Any]]


def run(
    files: Sequence[Path],
    position: float | None,
    current: float,
    as_json: bool,
    picture: Path | None,
) -> None:
    """Linearise at a position [m], at rest or in the steady motion that a current [A] causes.

    Raises:
        UserError: if the configuration is wrong or has no equilibrium there.

    """
    config = load_whole(files)
    forms = linearise(config, position, current)
    if as_json:
        click.echo(json.dumps(_content(forms), indent=2))
    else:
        click.echo(_text(forms))
    if picture:
        _draw(forms, picture)
        click.echo(f"picture: {near(picture)}", err=True)


def linearise(config: Configuration, position: float | None, current: float) -> Forms:
    """Return every form of the linear model of a configured actuator.

    Raises:
        UserError: if the position lies outside the stroke or nothing is in equilibrium there.

    """
    stroke = config.plant["cylinder_stroke"]
    where = config.plant["initial_position"] if position is None else position
    if not 0.0 < where < stroke:
        raise UserError(f"position {where * 1e3:g} mm is outside the stroke of {stroke * 1e3:g} mm")
    kernel = compiled(config.effects, cache_folder())
    try:
        exact = (
            steady_motion(kernel, config.plant, current, where)
            if current
            else rest(kernel, config.plant, where)
        )
        machine = s1.LinearisedMachine.of(config.plant)
        at = exact.signals
        point = s1.OperatingPoint(
            at["spool_position"], at["position"], at["pressure_a"], at["pressure_b"]
        )
        valve = s1.valve_coefficients(machine, point)
    except (NoEquilibriumError, ValueError) as error:
        raise UserError(
            f"no linear model at {where * 1e3:g} mm and {current * 1e3:g} mA: {error}"
        ) from None
    force = s1.force_coefficients(machine, point)
    coefficients = dataclasses.asdict(valve) | {"k_pa": valve.k_pa, "k_pb": valve.k_pb}
    analytic = {"S1": s1.reduced(machine, point), "complete": s1.complete(machine, point)}
    outputs = ("hydraulic_force", "load_force")
    responses: dict[str, dict[str, Any]] = {
        name: {output: getattr(response, output) for output in outputs}
        for name, response in analytic.items()
    }
    responses["exact"] = {output: s1.exact(exact, output) for output in outputs}
    return Forms(exact, coefficients | dataclasses.asdict(force), responses)


def _complex(values: Any) -> list[complex]:
    """Return roots in the order of their distance from the origin, one of each pair."""
    upper = [complex(v) for v in values if np.imag(v) >= 0.0]
    return sorted(upper, key=abs)


def _root(value: complex) -> str:
    pair = f" ± {value.imag:.1f}j ({abs(value) / 2 / math.pi:.1f} Hz)" if value.imag else ""
    return f"{value.real:.2f}{pair}"


def _operating_point(at: Any) -> str:
    """Return the signals that tell where a model is linear."""
    return (
        f"x {at['position'] * 1e3:.2f} mm, v {at['velocity'] * 1e3:.2f} mm/s, "
        f"u_v {at['spool_position'] * 1e3:.4f} mA, p_a {at['pressure_a'] * 1e-5:.2f} bar, "
        f"p_b {at['pressure_b'] * 1e-5:.2f} bar"
    )


def _text(forms: Forms) -> str:
    at = forms.exact.signals
    lines = [
        f"{_operating_point(at)}\n",
        text_table(
            ("coefficient", "value", "unit"),
            [(name, f"{value:.5g}", _UNITS[name]) for name, value in forms.coefficients.items()],
        ),
    ]
    for name, responses in forms.responses.items():
        lines.append(f"\n{name}: poles [rad/s]")
        lines += [f"  {_root(p)}" for p in _complex(responses["load_force"].poles)]
        for output, response in responses.items():
            zeros = ", ".join(_root(z) for z in _complex(response.zeros))
            lines.append(f"{name}: zeros of {output}/u [rad/s]: {zeros or 'none'}")
    lines.append(
        "\nS1 and complete know viscous friction alone; exact has every effect that is on. At rest "
        "dry friction is a stiff damper in it."
    )
    return "\n".join(lines)


def _pairs(values: Any) -> list[list[float]]:
    return [[float(np.real(v)), float(np.imag(v))] for v in values]


def _content(forms: Forms) -> dict[str, Any]:
    """Return everything as JSON can hold it; roots as [real, imaginary], rad/s."""
    return {
        "operating_point": {name: float(value) for name, value in forms.exact.signals.items()},
        "coefficients": {
            name: value if math.isfinite(value) else str(value)
            for name, value in forms.coefficients.items()
        },
        "forms": {
            name: {
                output: {"zeros": _pairs(r.zeros), "poles": _pairs(r.poles)}
                for output, r in responses.items()
            }
            for name, responses in forms.responses.items()
        },
    }


def _draw(forms: Forms, file: Path) -> None:
    """Draw the frequency responses of every form."""
    figure, axes = drawing.subplots((10, 6), 2, 2, sharex=True)
    styles = {"S1": "--", "complete": "-.", "exact": "-"}
    colours = {"S1": VERMILION, "complete": GREEN, "exact": BLUE}
    for name, responses in forms.responses.items():
        for column, (output, response) in enumerate(responses.items()):
            _, values = response.freqresp(2.0 * math.pi * _DECADES)
            look = {"color": colours[name], "linestyle": styles[name], "label": name}
            axes[0, column].loglog(_DECADES, np.abs(values) * 1e-3, **look)
            phase = np.degrees(np.unwrap(np.angle(values)))
            axes[1, column].semilogx(_DECADES, phase, **look)
            axes[0, column].set_title(output.replace("_", " "))
            axes[1, column].set_xlabel("frequency [Hz]")
    axes[0, 0].set_ylabel("force over current [N/mA]")
    axes[1, 0].set_ylabel("phase [°]")
    axes[0, 0].legend()
    figure.suptitle(f"at {_operating_point(forms.exact.signals)}", fontsize=10)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    drawing.save(figure, file)

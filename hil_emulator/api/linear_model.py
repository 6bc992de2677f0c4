"""The linear model at an operating point, three ways."""

import contextlib
import dataclasses
import math
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from hil_emulator.api.picture import Picture
from hil_emulator.config.assumed import moved_defaults
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.model import linear as s1
from hil_emulator.model.constants import S1
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.linearise import Linearisation, rest, steady_motion
from hil_emulator.model.rests_on import rests_on
from hil_emulator.model.smoothed import JUMP, OVERLAP, at_the_edge, left_out, sliding
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, VERMILION
from hil_emulator.platform.paths import cache_folder
from hil_emulator.simulation.assembly import compiled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DECADES = np.logspace(-1, 3, 400)
"""Frequencies of the picture [Hz]."""

_DPI = 110.0

_STILL = 1e-3
"""Distance of a pole from the origin that counts as zero [rad/s] (assumed): rounding."""


@dataclass(frozen=True)
class LinearModel:
    """S1's forms and the exact one at the same operating point.

    Attributes:
        exact: the Jacobians of the compiled model there.
        coefficients: S1's, by name, SI, with leakage past the lands.
        zero_lap: S1's coefficients for sharp lands without leakage; at rest those of extension.
        responses: each form's transfer functions from valve current to both forces.
        left_out: effects of the machine that a linear model lacks, one sentence each.
        assumed: fields of the defaults that a number depends on, by its name in `numbers`: one
            spread of such a default changes the number by more than 10 %.

    """

    exact: Linearisation
    coefficients: dict[str, float]
    zero_lap: dict[str, float]
    responses: dict[str, dict[str, Any]]
    left_out: list[str]
    assumed: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def numbers(self) -> dict[str, float]:
        """Coefficients, and the distance of each form's poles from the origin [rad/s]."""
        poles = {
            pole_name(form, i): abs(pole) if abs(pole) > _STILL else 0.0
            for form, responses in self.responses.items()
            for i, pole in enumerate(one_of_each_pair(responses["load_force"].poles))
        }
        return {**self.coefficients, **poles}

    @property
    def operating_point(self) -> str:
        """The operating point in words."""
        at = self.exact.signals
        return (
            f"x {at['position'] * 1e3:.2f} mm, v {at['velocity'] * 1e3:.2f} mm/s, "
            f"u_v {at['spool_position'] * 1e3:.4f} mA, p_a {at['pressure_a'] * 1e-5:.2f} bar, "
            f"p_b {at['pressure_b'] * 1e-5:.2f} bar"
        )

    def figure(self) -> "Figure":
        """Draw the frequency responses of every form."""
        figure, axes = drawing.subplots((10, 6), 2, 2, sharex=True)
        styles = {"S1": "--", "complete": "-.", "exact": "-"}
        colours = {"S1": VERMILION, "complete": GREEN, "exact": BLUE}
        for name, responses in self.responses.items():
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
        figure.suptitle(f"at {self.operating_point}\n{S1}", fontsize=9)
        for axis in axes.flat:
            axis.grid(alpha=0.3)
        return figure

    def plot(self) -> Picture:
        """Return the frequency responses of every form as a picture."""
        return Picture(drawing.png(self.figure(), _DPI))

    def __repr__(self) -> str:
        lines = [f"at {self.operating_point}"]
        lines += [f"{name}: poles {_listed(r['load_force'].poles)} rad/s"
                  for name, r in self.responses.items()]  # fmt: skip
        return "\n".join([*lines, *(f"left out: {text}" for text in self.left_out), S1])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{_listed(r['load_force'].poles)}</td>"
            f"<td>{_listed(r['load_force'].zeros)}</td></tr>"
            for name, r in self.responses.items()
        )
        head = "<tr><th>form<th>poles [rad/s]<th>zeros of the load force [rad/s]</tr>"
        below = "".join(f"<p>{escape(text)}</p>" for text in (*self.left_out, S1))
        return f"<table>{head}{rows}</table>{below}"


def linearised(config: Configuration, position: float | None, current: float) -> LinearModel:
    """Return every form of the linear model of a configured actuator.

    Raises:
        UserError: if the position is outside the stroke or there is no equilibrium.

    """
    stroke = config.plant["cylinder_stroke"]
    where = config.plant["initial_position"] if position is None else position
    if not 0.0 < where < stroke:
        raise UserError(f"position {where * 1e3:g} mm is outside the stroke of {stroke * 1e3:g} mm")
    lap = config.plant.get(OVERLAP, 0.0) - config.plant.get(JUMP, 0.0)
    if current and abs(current) <= lap:
        raise UserError(
            f"{current * 1e3:g} mA is within the dead band of ±{lap * 1e3:g} mA: the rod does not "
            "move; give a larger current, or leave it out for the linear model at rest"
        )
    kernel = compiled(config.effects, cache_folder())
    try:
        model = _forms(kernel, config, where, current)
    except (NoEquilibriumError, ValueError) as error:
        raise UserError(
            f"no linear model at {where * 1e3:g} mm and {current * 1e3:g} mA: {error}"
        ) from None
    others = {}
    for name, value in moved_defaults(config).items():
        other = replace(config, plant={**config.plant, name: value})
        with contextlib.suppress(NoEquilibriumError, ValueError):
            others[name] = _forms(kernel, other, where, current).numbers
    return replace(model, assumed=rests_on(model.numbers, others))


def _forms(kernel: Kernel, config: Configuration, where: float, current: float) -> LinearModel:
    """Return every form at a position [m], at rest or in the steady motion of a current [A]."""
    values = sliding(config.plant)
    if current:
        exact = steady_motion(kernel, values, current, where)
    else:
        values = at_the_edge(values)
        exact = rest(kernel, values, where)
    machine = s1.LinearisedMachine.of(values)
    at = exact.signals
    point = s1.OperatingPoint(
        at["spool_position"], at["position"], at["pressure_a"], at["pressure_b"]
    )
    analytic = {"S1": s1.reduced(machine, point), "complete": s1.complete(machine, point)}
    outputs = ("hydraulic_force", "load_force")
    responses: dict[str, dict[str, Any]] = {
        name: {output: getattr(response, output) for output in outputs}
        for name, response in analytic.items()
    }
    responses["exact"] = {output: s1.exact(exact, output) for output in outputs}
    sharp = dataclasses.replace(machine, underlap=min(0.0, machine.underlap))
    closed = point if current else dataclasses.replace(point, spool=0.0)
    return LinearModel(
        exact, _coefficients(machine, point), _coefficients(sharp, closed), responses,
        left_out(config.plant, at_rest=not current),
    )  # fmt: skip


def _coefficients(machine: s1.LinearisedMachine, point: s1.OperatingPoint) -> dict[str, float]:
    valve = s1.valve_coefficients(machine, point)
    sensitivities = {"k_pa": valve.k_pa, "k_pb": valve.k_pb}
    force = dataclasses.asdict(s1.force_coefficients(machine, point))
    return dataclasses.asdict(valve) | sensitivities | force


def one_of_each_pair(roots: Any) -> list[complex]:
    """Return roots in the order of their distance from the origin, one of each pair."""
    return sorted((complex(r) for r in roots if np.imag(r) >= 0.0), key=abs)


def pole_name(form: str, place: int) -> str:
    """Return the name of a form's pole in `LinearModel.numbers`."""
    return f"{form} pole {place + 1}"


def _listed(roots: Any) -> str:
    """Return roots, slowest first, one of each pair."""
    upper = one_of_each_pair(roots)
    return ", ".join(f"{r.real:.4g} ± {r.imag:.4g}j" if r.imag else f"{r.real:.4g}" for r in upper)

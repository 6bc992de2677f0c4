"""The linear model at an operating point, three ways."""

import dataclasses
import math
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from hil_emulator.api.picture import Picture
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.model import linear as s1
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.linearise import Linearisation, rest, steady_motion
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, VERMILION
from hil_emulator.platform.paths import cache_folder
from hil_emulator.simulation.assembly import compiled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DECADES = np.logspace(-1, 3, 400)
"""Frequencies of the picture [Hz]."""

_DPI = 110.0


@dataclass(frozen=True)
class LinearModel:
    """S1's forms and the exact one at the same operating point.

    Attributes:
        exact: the Jacobians of the compiled model there.
        coefficients: S1's, by name, SI.
        responses: each form's transfer functions from valve current to both forces.

    """

    exact: Linearisation
    coefficients: dict[str, float]
    responses: dict[str, dict[str, Any]]

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
        figure.suptitle(f"at {self.operating_point}", fontsize=10)
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
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{_listed(r['load_force'].poles)}</td>"
            f"<td>{_listed(r['load_force'].zeros)}</td></tr>"
            for name, r in self.responses.items()
        )
        head = "<tr><th>form<th>poles [rad/s]<th>zeros of the load force [rad/s]</tr>"
        return f"<table>{head}{rows}</table>"


def linearised(config: Configuration, position: float | None, current: float) -> LinearModel:
    """Return every form of the linear model of a configured actuator.

    Raises:
        UserError: if the position is outside the stroke or there is no equilibrium.

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
    return LinearModel(exact, coefficients | dataclasses.asdict(force), responses)


def _listed(roots: Any) -> str:
    """Return roots, slowest first, one of each pair."""
    upper = sorted((complex(r) for r in roots if np.imag(r) >= 0.0), key=abs)
    return ", ".join(f"{r.real:.4g} ± {r.imag:.4g}j" if r.imag else f"{r.real:.4g}" for r in upper)

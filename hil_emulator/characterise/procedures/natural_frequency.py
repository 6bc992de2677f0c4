"""Natural frequency and damping of the rod between its oil columns, valve closed.

With both ports closed each chamber is a spring, of S1 eq. 3.11-3.14 with no flow:

    K = A_p² (beta_a/V_a + alpha² beta_b/V_b),    omega_n = √(K/M),    zeta = (B + B_l)/(2 √(K M)).

An impulse makes the rod oscillate. The pole of the oscillation follows from the force of the
pressure sensors by the matrix pencil method (Hua and Sarkar 1990), without a model of the machine.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.lib.stride_tricks import sliding_window_view

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.bulk_modulus import mixture
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.size import quickness
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, VERMILION

_PARTS = np.linspace(0.1, 0.9, 9)  # positions, parts of the stroke
_COMPARED = (0, 4, 8)  # three of them
_BLOW = 0.1  # of the piston area times supply pressure
_STRUCK, _DURATION = 5e-3, 1.0  # for the reference machine's resonance [s]
_PERIOD = 1e-3  # of the readings, for the same resonance [s]
_RINGING, _QUIET = slice(6, 206), slice(-300, None)  # readings after the blow; before the end


@dataclass(frozen=True)
class Ringing:
    """Sensor readings after a blow: values at rest, and the pole of the oscillation."""

    position: float
    pressure_a: float
    pressure_b: float
    pole: complex


def ringing_pole(values: Series, period: float) -> complex:
    """Return the pole s of values = Re(c exp(s t)), upper half plane [rad/s].

    Args:
        values: without a mean, shape (n,).
        period: between two values [s].

    """
    windows = sliding_window_view(values, len(values) // 2).T
    basis = np.linalg.svd(windows, full_matrices=False)[0][:, :2]
    shift = np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0]
    poles = np.log(np.linalg.eigvals(shift).astype(complex)) / period
    return complex(poles[np.argmax(poles.imag)])


def stiffness(bench: Bench, position: float, pressure_a: float, pressure_b: float) -> float:
    """Return the stiffness of both closed oil columns [N/m]."""
    area, alpha = bench.value("cylinder_piston_area"), bench.value("cylinder_area_ratio")
    volume_a = bench.value("cylinder_dead_volume_a") + area * position
    stroke = bench.value("cylinder_stroke")
    volume_b = bench.value("cylinder_dead_volume_b") + alpha * area * (stroke - position)
    beta_a, beta_b = mixture(
        np.array([pressure_a, pressure_b]), bench.value("oil_bulk_modulus"),
        bench.value("entrained_air_fraction"), bench.value("entrained_air_polytropic_exponent"),
    )  # fmt: skip
    return float(area**2 * (beta_a / volume_a + alpha**2 * beta_b / volume_b))


def _ring(bench: Bench, position: float) -> Ringing:
    """Apply a blow to the rod at rest at a position [m], and evaluate the oscillation."""
    closed = bench.off("valve", "supply", "tank", "cylinder", "friction", "load",
                       keep=("viscous_friction", "load_viscous_friction"))  # fmt: skip
    quick = quickness(bench)
    period = bench.period(_PERIOD / quick)
    stand = bench.stand(closed | {"valve_gain": 1e-30, "initial_position": position}, period)
    area, alpha = bench.value("cylinder_piston_area"), bench.value("cylinder_area_ratio")
    supply = bench.value("supply_pressure")
    # at rest p_a = alpha p_b; S1 assumes p_a + p_b = p_s
    stand.plant.state["pressure_b"] = supply / (1.0 + alpha)
    stand.plant.state["pressure_a"] = alpha * supply / (1.0 + alpha)
    time = np.arange(0.0, _DURATION / quick, stand.period)
    record = stand.drive(0.0, np.where(time < _STRUCK / quick, _BLOW * area * supply, 0.0)).readings
    force = area * (record["pressure_a"] - alpha * record["pressure_b"])
    pole = ringing_pole((force - np.mean(force[_QUIET]))[_RINGING], stand.period)
    position, p_a, p_b = (
        float(np.mean(record[name][_QUIET])) for name in ("position", "pressure_a", "pressure_b")
    )
    return Ringing(position, p_a, p_b, pole)


def _formulas(bench: Bench, heard: Sequence[Ringing]) -> tuple[Series, Series]:
    """Return natural frequency [Hz] and damping ratio of spring, mass and viscous friction."""
    mass = bench.value("load_mass")
    damping = bench.value("viscous_friction_coefficient") * bench.relative_viscosity
    damping += bench.value("load_viscous_friction_coefficient")
    springs = np.array([stiffness(bench, h.position, h.pressure_a, h.pressure_b) for h in heard])
    return np.sqrt(springs / mass) / (2.0 * math.pi), damping / (2.0 * np.sqrt(springs * mass))


def _comparisons(
    position: Series, measured: tuple[Series, Series], expected: tuple[Series, Series]
) -> list[Comparison]:
    quantities = (
        ("natural frequency", "Hz", "√(K/M), S1 eq. 3.11-3.14", 5e-3),
        ("damping ratio", "1", "(B + B_l)/(2 √(K M))", 0.03),
    )
    return [
        Comparison(f"{name} at {position[i] * 1e3:.0f} mm", unit,
                   float(formula[i]), source, float(values[i]), tolerance, Agreement.DERIVED)
        for (name, unit, source, tolerance), values, formula
        in zip(quantities, measured, expected, strict=True)
        for i in _COMPARED
        if formula[i]
    ]  # fmt: skip


def run(bench: Bench) -> BenchResult:
    """Apply blows along the stroke and compare with both springs and the mass."""
    heard = [_ring(bench, part * bench.value("cylinder_stroke")) for part in _PARTS]
    position = np.array([h.position for h in heard])
    poles = np.array([h.pole for h in heard])
    hertz, ratio = np.abs(poles) / (2.0 * math.pi), -poles.real / np.abs(poles)
    expected = _formulas(bench, heard)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Both ports closed, dry friction switched off, a blow of 5 ms on the rod at nine "
            "positions. Frequency and decay of the force of both pressure sensors; stiffness of "
            "the oil at the position and the sensors' pressures at rest."
        ),
        columns={
            "position": column("mm", position * 1e3),
            "natural frequency": column("Hz", hertz),
            "natural frequency, formula": column("Hz", expected[0]),
            "damping ratio": column("%", ratio * 1e2),
            "damping ratio, formula": column("%", expected[1] * 1e2),
        },
        comparisons=_comparisons(position, (hertz, ratio), expected),
        again=lambda other: _comparisons(position, (hertz, ratio), _formulas(other, heard)),
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw natural frequency and damping along the stroke."""
    plots = figure.subplots(1, 2)
    names = (
        ("natural frequency", "natural frequency [Hz]"),
        ("damping ratio", "damping ratio [%]"),
    )
    for axes, (name, title) in zip(plots, names, strict=True):
        axes.plot(result["position"], result[f"{name}, formula"], color=BLACK, linewidth=1,
                  label="stiffness of the oil columns")  # fmt: skip
        axes.plot(result["position"], result[name], "o", color=VERMILION, label="from the sensors")
        axes.set_ylim(bottom=0)
        look.label(axes, "position [mm]", title, "Ringing of the rod, ports closed")
    look.legend(plots[0])


TEST = Procedure(
    "natural-frequency", "Natural frequency and damping with closed ports", run, draw,
    Chapter.DYNAMICS, 4,
)  # fmt: skip

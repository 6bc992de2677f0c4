"""Effective bulk modulus of the oil against pressure, by compression (S1 eq. 3.1, S2 eq. 1).

The valve's ports are plugged and a press pushes the rod in, so chamber a holds a fixed mass of
oil and air: beta = -V dp/dV from a laboratory gauge and the displacement of the press. The expected
value is the exact expression for oil of constant modulus E with air of volume r_v at atmosphere,

    beta = E (1 + w)/(1 + w E/(kappa p)),    w = r_v (p_0/p)^(1/kappa).
"""

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Comparison,
    DocumentFigure,
    Series,
    column,
)
from hil_emulator.characterise.stand import Bench
from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.pages.palette import BLACK, BLUE, GREY, VERMILION

MOST_AIR, ADIABATIC, STRONG_AIR = 0.2, 1.4, 100e5
"""Most air at atmosphere, its exponent, pressure below which it acts strongly [Pa] (S2)."""
_LOWEST, _HIGHEST = 1.5e5, 250e5  # just above atmosphere, and the sensor's range [Pa]
_DURATION = 4.0  # [s]
_CHECKED = (10e5, 50e5, 100e5, 200e5)  # pressures of the comparison [Pa]


def mixture(pressure: Series, modulus: float, fraction: float, exponent: float) -> Series:
    """Return the bulk modulus of oil with entrained air [Pa] (S2 eq. 1, corrected).

    The printed form divides by r_v and does not tend to E for r_v = 0.
    """
    gas = fraction * (ATMOSPHERE / pressure) ** (1.0 / exponent)
    return np.asarray(modulus * (1.0 + gas) / (1.0 + gas * modulus / (exponent * pressure)))


def _compress(bench: Bench) -> tuple[Series, Series]:
    """Return pressure [Pa] and bulk modulus [Pa] between samples of one compression."""
    plugged = bench.off("valve", "cylinder", "friction", "load", "supply") | {
        "supply_pressure": 2.0 * _LOWEST,  # both chambers start near _LOWEST
        "valve_gain": 1e-30,
        "load_mass": 1.0,
        "load_viscous_friction_coefficient": 1e5,  # of the press, so that nothing oscillates
    }
    stand = bench.stand(plugged)
    area = bench.value("cylinder_piston_area")
    time = np.arange(0.0, _DURATION, stand.period)
    push = area * _LOWEST * (_HIGHEST / _LOWEST) ** (time / _DURATION)
    record = stand.drive(0.0, push - area * _LOWEST)
    p, v = record.signals["pressure_a"], record.signals["volume_a"]
    rising = (np.diff(p) > 1e-5 * p[1:]) & (p[1:] > _LOWEST)
    beta = -(v[1:] + v[:-1]) / 2.0 * np.diff(p) / np.diff(v)
    return ((p[1:] + p[:-1]) / 2.0)[rising], beta[rising]


def _exact(bench: Bench, pressure: Series) -> Series:
    """Return the configured bulk modulus [Pa]."""
    return mixture(
        pressure, bench.value("oil_bulk_modulus"), bench.value("entrained_air_fraction"),
        bench.value("entrained_air_polytropic_exponent"),
    )  # fmt: skip


def _comparisons(bench: Bench, p: Series, beta: Series) -> list[Comparison]:
    exact = _exact(bench, p)
    return [
        Comparison(
            f"effective bulk modulus at {at * 1e-5:.0f} bar", "MPa",
            float(np.interp(at, p, exact)) * 1e-6, "S2 eq. 1, corrected",
            float(np.interp(at, p, beta)) * 1e-6, 1e-3, Agreement.CONFIGURED,
        )
        for at in _CHECKED
    ]  # fmt: skip


def run(bench: Bench) -> BenchResult:
    """Compress chamber a and differentiate."""
    p, beta = _compress(bench)
    order = np.argsort(p)
    p, beta = p[order], beta[order]
    modulus = bench.value("oil_bulk_modulus")
    air = bench.value("entrained_air_fraction")
    exact = _exact(bench, p)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Ports plugged, a press pushes the rod in: chamber a is compressed from 1.5 to "
            "250 bar; beta = -V dp/dV between samples of pressure and volume."
        ),
        columns={
            "pressure": column("bar", p * 1e-5),
            "bulk modulus": column("MPa", beta * 1e-6),
            "exact expression": column("MPa", exact * 1e-6),
            "20 % of air, S2": column("MPa", mixture(p, modulus, MOST_AIR, ADIABATIC) * 1e-6),
        },
        comparisons=_comparisons(bench, p, beta),
        again=lambda other: _comparisons(other, p, beta),
        notes=[f"{air:.2%} of air at atmosphere; {modulus * 1e-6:.0f} MPa without air (S1 3.1.1)."],
        figures=[
            DocumentFigure("S2 on eq. 1", "up to 20 % of air at atmosphere, kappa = 1.4, a strong "
                           "effect below 100 bar", "the expression for that air with the machine's "
                           "modulus, and a line at 100 bar"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the bulk modulus against pressure."""
    axes = figure.add_subplot()
    axes.semilogx(result["pressure"], result["bulk modulus"], color=BLUE, linewidth=3,
              label="emulated compression")  # fmt: skip
    axes.plot(result["pressure"], result["exact expression"], "--", color=BLACK, linewidth=1,
              label="oil with entrained air, exact")  # fmt: skip
    if result.figures:
        axes.plot(result["pressure"], result["20 % of air, S2"], ":", color=VERMILION,
                  linewidth=1.5, label="20 % of air, the most of S2 on eq. 1")  # fmt: skip
        axes.axvline(STRONG_AIR * 1e-5, color=GREY, linewidth=0.8)
    axes.set_ylim(bottom=0)
    look.decade_axis(axes)
    look.label(axes, "absolute pressure [bar]", "effective bulk modulus [MPa]",
               "Stiffness of the oil in chamber a")  # fmt: skip
    look.legend(axes)


TEST = Procedure(
    "bulk-modulus", "Effective bulk modulus against pressure", run, draw, Chapter.OIL, 2
)

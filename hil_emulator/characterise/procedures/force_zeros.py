"""Zeros of hydraulic force and load force, from sensors under sines of large stroke.

Piston and load are a linear filter between both forces, independent of the valve:

    f/f_h = (M_l s + B_l)/((M_l + m) s + B_l + B) = g (s - z_f)/(s - z_h)

with the zeros z_f of df/du and z_h of df_h/du (S1 eq. 3.38-3.40). Dry friction is switched off, as
in the linear model.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.motion import Mover, sine
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.sine import fundamental
from hil_emulator.characterise.size import fastest
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

DOCUMENT_ZEROS = (-10.0, -30.0)
"""Zeros of load force and hydraulic force [rad/s] (S1 Fig. 3.14)."""
_HERTZ = np.array([0.8, 1.2, 1.6, 2.4, 3.2, 4.8, 6.4, 9.6])
_SPEED = 0.25  # largest speed of the sines [m/s]
_PART = 0.3  # largest amplitude, part of the stroke
_SLOWEST = 0.2  # smallest scale of the frequencies, to limit the duration of a test (assumed)
_OF_SPOOL = 0.5  # highest frequency, part of the spool's natural frequency
_NOISE = 0.02  # relative error of a zero from the noise of usual sensors (assumed)
_SECONDS = 8.0  # measured for each sine, after one second


def _ratio(bench: Bench, hertz: float, slow: float) -> complex:
    """Return load force over hydraulic force at one frequency, from the sensors.

    Args:
        bench: the machine.
        hertz: the frequency.
        slow: speed of the test relative to the documents' machine.

    """
    stroke, omega = bench.value("cylinder_stroke"), 2.0 * math.pi * hertz
    stand = bench.stand(bench.smooth() | {"initial_position": 0.5 * stroke})
    path = sine(
        0.5 * stroke, min(_PART * stroke, min(_SPEED, fastest(bench)) / omega), hertz, stand.period,
        hertz * (_SECONDS + 1.0) / slow,
    )  # fmt: skip
    record = Mover(bench, stand).follow(path).after(1.0 / slow)
    area, alpha = bench.value("cylinder_piston_area"), bench.value("cylinder_area_ratio")
    hydraulic = area * (record.readings["pressure_a"] - alpha * record.readings["pressure_b"])
    load = fundamental(record.time, record.readings["load_force"], omega)
    return load / fundamental(record.time, hydraulic, omega)


def fit_zeros(omega: Series, ratio: Series) -> tuple[float, float]:
    """Return z_f and z_h [rad/s] by least squares on ratio (s - z_h) = g (s - z_f)."""
    s = 1j * omega
    # unknowns: z_h, g, g z_f; each row is weighted by the error of the ratio
    rows = np.column_stack([ratio, s, -np.ones_like(s)]) / np.abs(s)[:, None]
    wanted = ratio * s / np.abs(s)
    both = np.vstack([rows.real, rows.imag])
    z_h, gain, product = np.linalg.lstsq(
        both, np.concatenate([wanted.real, wanted.imag]), rcond=None
    )[0]
    return float(product / gain), float(z_h)


def run(bench: Bench) -> BenchResult:
    """Measure the ratio of both forces and its zero and pole."""
    mass = bench.value("load_mass")
    b_l, b = (
        bench.value("load_viscous_friction_coefficient"),
        bench.value("viscous_friction_coefficient"),
    )
    formula = (-b_l / mass, -(b_l + b) / (mass + bench.value("rod_mass_mass")))
    follows = _OF_SPOOL * bench.value("valve_natural_frequency") / float(_HERTZ[-1])
    scale = max(_SLOWEST, min(formula[1] / DOCUMENT_ZEROS[1], follows))
    hertz = _HERTZ * scale
    ratio = np.array([_ratio(bench, f, min(1.0, scale)) for f in hertz])
    omega = 2.0 * math.pi * hertz
    zeros = fit_zeros(omega, ratio)
    # zeros far below the slowest sine follow from differences of nearly equal numbers
    tolerance = _NOISE * max(1.0, 3.0 * float(omega[0]) / abs(formula[1]))
    names = ("zero of the load force f", "zero of the hydraulic force f_h")
    s = 1j * omega
    model = (s - formula[0]) * mass / (mass + bench.value("rod_mass_mass")) / (s - formula[1])
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            f"Sines of the position at {hertz[0]:.2g} to {hertz[-1]:.2g} Hz, dry friction switched "
            "off; load cell over "
            "pressure force at each frequency, and the first-order filter through them."
        ),
        columns={
            "frequency": column("Hz", hertz),
            "gain f/f_h": column("1", np.abs(ratio)),
            "phase f/f_h": column("degree", np.degrees(np.angle(ratio))),
            "gain, linear model": column("1", np.abs(model)),
            "phase, linear model": column("degree", np.degrees(np.angle(model))),
        },
        comparisons=[
            Comparison(f"{name}, {what}", "rad/s", expected, source, value, tolerance, kind)
            for what, source, pair, kind in (
                ("S1", "S1 Fig. 3.14", DOCUMENT_ZEROS, Agreement.DOCUMENT),
                (
                    "formula",
                    "-B_l/M_l and -(B_l + B)/(M_l + m), configured",
                    formula,
                    Agreement.DERIVED,
                ),
            )
            for name, expected, value in zip(names, pair, zeros, strict=True)
            if expected
        ],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the Bode plot of f over f_h."""
    gain, phase = figure.subplots(2, 1, sharex=True)
    for axes, kind, colour in ((gain, "gain", BLUE), (phase, "phase", VERMILION)):
        axes.semilogx(result["frequency"], result[f"{kind}, linear model"], color=BLACK,
                      linewidth=1, label="linear model")  # fmt: skip
        axes.semilogx(result["frequency"], result[f"{kind} f/f_h"], "o", color=colour,
                      label="from the sensors")  # fmt: skip
        look.legend(axes)
    look.label(gain, "", "f / f_h", "Load force over hydraulic force: zero over zero")
    look.label(phase, "frequency [Hz]", "phase [degree]")
    look.decade_axis(phase)


TEST = Procedure(
    "force-zeros", "Zeros of hydraulic force and load force", run, draw, Chapter.DYNAMICS, 2
)

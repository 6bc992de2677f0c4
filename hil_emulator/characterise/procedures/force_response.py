"""Frequency response of hydraulic force and load force about rest (S1 eq. 3.38, 3.40).

Small sines of the current, much smaller than the opening at null, about the current that holds the
rod; f_h from the pressure sensors, f from the load cell. Dry friction is switched off, as in the
linear model. An overlap is switched off, too: the operating point is at the edge of the dead band,
as with a driver that compensates it. The picture shows the measured responses, both transfer
functions of S1, whose edges are turbulent, and the exact linearisation of the model.
"""

import math

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.force_poles import rest_point
from hil_emulator.characterise.result import Agreement, BenchResult, Column, Comparison, column
from hil_emulator.characterise.sine import fundamental
from hil_emulator.characterise.size import quickness
from hil_emulator.characterise.stand import Bench
from hil_emulator.model import linear, linearise
from hil_emulator.model.smoothed import at_the_edge, left_out
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

Response = NDArray[np.complex128]

_HERTZ = np.geomspace(10.0, 200.0, 37)  # of the reference machine; others by their resonance
_OF_NULL = 0.2  # amplitude of the sines, part of the opening at null: nearly linear there
_OF_PUSH = 0.03  # largest force at resonance, part of the largest push (assumed)
_TIGHT = 1e-3  # amplitude for edges closed at null, part of the rated current
_CLEAR = 0.1  # part of the largest gain below which sensor noise biases the amplitude
_FORCES = {"f_h": "hydraulic_force", "f": "load_force"}
_PERIOD = 2e-4  # of the signal generator [s]
_SETTLING, _MEASURED = 0.4, 0.8  # of the reference machine [s]
_DECAYS, _LONGEST = 4.0, 2.0  # settling of a lightly damped machine: time constants, longest [s]


def _amplitude(bench: Bench, rest: linearise.Linearisation) -> float:
    """Return the amplitude of the sines [A], small relative to the opening at null and the push."""
    omega = 2.0 * math.pi * quickness(bench) * _HERTZ
    gain = float(np.max(np.abs(rest.response("valve_current", "hydraulic_force", omega))))
    push = bench.value("supply_pressure") * bench.value("cylinder_piston_area")
    null = _OF_NULL * bench.null_opening or _TIGHT * bench.rated_current
    return min(null, _OF_PUSH * push / gain) if gain else null


def _decay(rest: linearise.Linearisation) -> float:
    """Return the decay rate of the slowest oscillation [1/s]."""
    swinging = rest.poles[np.abs(rest.poles.imag) > 1.0].real
    return float(np.min(np.abs(swinging), initial=math.inf))


def _responses(bench: Bench, hertz: float, rest: linearise.Linearisation) -> list[complex]:
    """Return hydraulic force and load force over current at one frequency [N/A]."""
    stroke, omega = bench.value("cylinder_stroke"), 2.0 * math.pi * hertz
    quick = quickness(bench)
    period = bench.period(_PERIOD / quick)
    smooth = at_the_edge({**bench.values, **bench.smooth()})
    stand = bench.stand(smooth | {"initial_position": 0.5 * stroke}, period)
    for name, value in rest.equilibrium.items():
        stand.plant.state[name] = value
    settling = max(_SETTLING / quick, min(_DECAYS / _decay(rest), _LONGEST / quick))
    ticks = round((settling + _MEASURED / quick) / period)
    middle = period * (np.arange(ticks) + 0.5)
    amplitude = _amplitude(bench, rest)
    record = stand.drive(rest.current + amplitude * np.sin(omega * middle))
    record = record.after(settling)
    area, alpha = bench.value("cylinder_piston_area"), bench.value("cylinder_area_ratio")
    hydraulic = area * (record.readings["pressure_a"] - alpha * record.readings["pressure_b"])
    forces = (hydraulic, record.readings["load_force"])
    return [fundamental(record.time, force, omega) / amplitude for force in forces]


def _columns(force: str, response: str, values: Response) -> dict[str, Column]:
    return {
        f"gain {force}, {response}": column("N/mA", np.abs(values) * 1e-3),
        f"phase {force}, {response}": column("degree", np.degrees(np.unwrap(np.angle(values)))),
    }


def _comparisons(
    force: str, hertz: NDArray[np.float64], measured: Response, exact: Response
) -> list[Comparison]:
    peak = int(np.argmax(np.abs(measured)))
    clear = np.abs(exact) > _CLEAR * np.max(np.abs(exact))
    deviation = float(np.median(np.abs(measured[clear] / exact[clear])))
    return [
        Comparison(f"gain {force}/u at {hertz[peak]:.0f} Hz", "N/mA",
                   float(abs(exact[peak])) * 1e-3, "exact linearisation",
                   float(abs(measured[peak])) * 1e-3, 0.05, Agreement.DERIVED),
        Comparison(f"gain {force}/u over exact one, median", "1", 1.0, "exact linearisation",
                   deviation, 0.05, Agreement.DERIVED),
    ]  # fmt: skip


def _linear(bench: Bench) -> linearise.Linearisation:
    """Return the exact linearisation at rest at mid-stroke."""
    position = 0.5 * bench.value("cylinder_stroke")
    return linearise.rest(bench.kernel, at_the_edge({**bench.values, **bench.smooth()}), position)


def _with_exact(
    rest: linearise.Linearisation, hertz: NDArray[np.float64], responses: Response
) -> list[Comparison]:
    """Compare both measured responses with the exact ones, unless the edges are closed at null."""
    rows = []
    for measured, (symbol, name) in zip(responses, _FORCES.items(), strict=True):
        exact = rest.response("valve_current", name, 2.0 * math.pi * hertz)
        if np.all(exact != 0.0):
            rows += _comparisons(symbol, hertz, measured, exact)
    return rows


def run(bench: Bench) -> BenchResult:
    """Measure both Bode plots and compare them with both linear models."""
    rest = _linear(bench)
    values = at_the_edge({**bench.values, **bench.smooth()})
    analytic = linear.reduced(linear.LinearisedMachine.of(values), rest_point(rest))
    hertz = quickness(bench) * _HERTZ
    responses = np.array([_responses(bench, f, rest) for f in hertz]).T
    omega = 2.0 * math.pi * hertz
    columns = {"frequency": column("Hz", hertz)}
    comparisons = _with_exact(rest, hertz, responses)
    for measured, (symbol, name) in zip(responses, _FORCES.items(), strict=True):
        exact = rest.response("valve_current", name, omega)
        printed = getattr(analytic, name).freqresp(omega)[1]
        for kind, response in (("sensors", measured), ("S1", printed), ("exact", exact)):
            columns |= _columns(symbol, kind, response)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Sines of at most 20 % of the opening at null and 3 % of the largest push about rest "
            "at mid-stroke, dry friction switched off; force of both pressure sensors, and load "
            "cell, over current."
        ),
        columns=columns,
        comparisons=comparisons,
        again=lambda other: _with_exact(_linear(other), hertz, responses),
        notes=[
            f"The current that holds the rod is {rest.current * 1e6:+.1f} uA.",
            *left_out(bench.values, at_rest=True),
        ],
        inapplicable=[] if comparisons else ["gain: edges closed at null; give land_leakage."],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw both Bode plots."""
    grid = figure.subplots(2, 2, sharex=True)
    for (gain, phase), symbol in zip(grid.T, _FORCES, strict=True):
        for axes, kind in ((gain, "gain"), (phase, "phase")):
            plot = axes.loglog if kind == "gain" else axes.semilogx
            plot(result["frequency"], result[f"{kind} {symbol}, exact"], color=BLUE,
                 linewidth=3, label="exact linearisation")  # fmt: skip
            plot(result["frequency"], result[f"{kind} {symbol}, S1"], "--", color=BLACK,
                 linewidth=1, label="S1 eq. 3.38, 3.40")  # fmt: skip
            plot(result["frequency"], result[f"{kind} {symbol}, sensors"], "o", color=VERMILION,
                 markersize=3, label="from the sensors")  # fmt: skip
        look.label(
            gain, "", f"{symbol} / u [N/mA]", _FORCES[symbol].replace("_", " ") + " over current"
        )
        phase.set_yticks(np.arange(-180.0, 91.0, 90.0))
        look.label(phase, "frequency [Hz]", "phase [degree]")
        look.decade_axis(phase)
    look.legend(grid[0, 0])


TEST = Procedure(
    "force-response",
    "Frequency response of hydraulic and load force",
    run,
    draw,
    Chapter.DYNAMICS,
    1,
)

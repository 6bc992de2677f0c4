"""Frequency response of the spool at small and full amplitude (S1 3.3.1).

The valve's bandwidth is 250 Hz at ±25 % and 100 Hz at ±100 % of the rated current, at 210 bar.
Bandwidth is the frequency at which the fundamental of the spool's motion is 3 dB below its static
value.
"""

import math
from itertools import product

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
from hil_emulator.characterise.sine import crossing, fundamental
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, PINK, SKY, VERMILION

DOCUMENT_BANDWIDTH = {0.25: 250.0, 1.0: 100.0}
"""-3 dB in Hz by amplitude in rated currents, at 210 bar (S1 3.3.1)."""
_PRESSURES = (210e5, 160e5)
_DOCUMENTED = 250.0  # natural frequency of the documents' spool [Hz]
_HERTZ = np.geomspace(10.0, 500.0, 30)  # for that spool; scaled by the natural frequency
_PERIOD = 1e-4  # of the signal generator and the recorder, scaled too [s]
_SLOW = 0.5  # part of that frequency below which fewer and shorter sines are used
_SLOW_HERTZ = np.geomspace(40.0, 500.0, 20)
_SETTLING, _MEASURED = 6, 8  # periods of the sine
_SHORT = (2, 4)  # settling and measured periods of slow spools


def _response(bench: Bench, pressure: float, amplitude: float, hertz: float) -> complex:
    """Return spool over current at one frequency, from the spool's displacement transducer."""
    changes = bench.off("supply", "tank") | bench.blocked() | {"supply_pressure": pressure}
    scale = _scale(bench)
    settling, measured = (_SETTLING, _MEASURED) if scale >= _SLOW else _SHORT
    period = bench.period(_PERIOD / scale)
    stand = bench.stand(changes, period)
    omega = 2.0 * math.pi * hertz
    ticks = round((settling + measured) / hertz / period)
    middle = period * (np.arange(ticks) + 0.5)  # a held value applies to the middle of its tick
    record = stand.drive(amplitude * np.sin(omega * middle)).after(settling / hertz)
    return fundamental(record.time, record.signals["spool_position"], omega) / amplitude


def _scale(bench: Bench) -> float:
    """Return the spool's natural frequency relative to the documents' spool."""
    return bench.value("valve_natural_frequency") / _DOCUMENTED


def _pilot(bench: Bench, pressure: float) -> float:
    """Return the speed of the pilot stage relative to its rated pressure, if that effect is on."""
    rated = bench.value("pilot_supply_rated_pressure")
    return 1.0 + bench.value("pilot_supply_share") * (math.sqrt(pressure / rated) - 1.0)


def _decibel(response: Series) -> Series:
    return np.asarray(20.0 * np.log10(np.abs(response)))


def run(bench: Bench) -> BenchResult:
    """Sweep the frequency at two amplitudes and two supply pressures."""
    rows, comparisons, notes = [], [], []
    scale = _scale(bench)
    hertz = (_HERTZ if scale >= _SLOW else _SLOW_HERTZ) * scale
    for pressure, part in product(_PRESSURES, DOCUMENT_BANDWIDTH):
        amplitude = part * bench.rated_current
        values = np.array([_response(bench, pressure, amplitude, f) for f in hertz])
        level, phase = _decibel(values), np.degrees(np.unwrap(np.angle(values)))
        rows += [
            (pressure * 1e-5, part * 100.0, *row) for row in zip(hertz, level, phase, strict=True)
        ]
        width = crossing(hertz, level, -3.0103)
        quarter = crossing(hertz, phase, -90.0)
        where = f"±{part:.0%} at {pressure * 1e-5:.0f} bar"
        notes.append(f"{where}: -3 dB at {width:.0f} Hz, -90 degrees at {quarter:.0f} Hz.")
        expected = DOCUMENT_BANDWIDTH[part] * _pilot(bench, pressure)
        if pressure == _PRESSURES[0]:
            comparisons.append(Comparison(
                f"spool bandwidth, {where}", "Hz", expected, "S1 3.3.1", width, 0.05,
                Agreement.DOCUMENT,
            ))  # fmt: skip
        elif bench.value("pilot_supply_share"):
            comparisons.append(Comparison(
                f"spool bandwidth, {where}", "Hz", expected, "S1 3.3.1 times √(p_s/210 bar)",
                width, 0.05, Agreement.DERIVED,
            ))  # fmt: skip
    names = (("supply pressure", "bar"), ("amplitude", "%"), ("frequency", "Hz"),
             ("gain", "dB"), ("phase", "degree"))  # fmt: skip
    table = np.array(rows).T
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Ports blocked, sines of ±25 % and ±100 % of the rated current at 210 and 160 bar; "
            "gain and phase of the fundamental of the spool's displacement."
        ),
        columns={name: column(unit, v) for (name, unit), v in zip(names, table, strict=True)},
        comparisons=comparisons,
        notes=notes,
        figures=[
            DocumentFigure(
                "S1 3.3.1",
                "250 Hz at ±25 % and 100 Hz at ±100 %, at 210 bar",
                "two points, assuming that the figures are for -3 dB",
            ),
        ],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the Bode plot."""
    gain, phase = figure.subplots(2, 1, sharex=True)
    styles = zip((BLUE, VERMILION, SKY, PINK), ("-", "-", "--", "--"), strict=True)
    for (pressure, part), (colour, line) in zip(
        product(_PRESSURES, DOCUMENT_BANDWIDTH), styles, strict=True
    ):
        rows = (result["supply pressure"] == pressure * 1e-5) & (result["amplitude"] == part * 100)
        text = f"±{part:.0%}, {pressure * 1e-5:.0f} bar"
        gain.semilogx(
            result["frequency"][rows], result["gain"][rows], line, color=colour, label=text
        )
        phase.semilogx(result["frequency"][rows], result["phase"][rows], line, color=colour)
    if result.figures:
        gain.plot(list(DOCUMENT_BANDWIDTH.values()), [-3.0103] * len(DOCUMENT_BANDWIDTH), "s",
                  color=BLACK, markerfacecolor="none", label="S1 3.3.1")  # fmt: skip
    gain.axhline(-3.0103, color=BLACK, linewidth=0.8, linestyle=":")
    phase.axhline(-90.0, color=BLACK, linewidth=0.8, linestyle=":")
    gain.set_ylim(-15, 3)
    look.label(gain, "", "gain [dB]", "Spool position over current")
    look.label(phase, "frequency [Hz]", "phase [degree]")
    look.decade_axis(phase)
    look.legend(gain)


TEST = Procedure("spool-response", "Frequency response of the spool", run, draw, Chapter.VALVE, 4)

"""Noise, resolution and delay of every sensor channel (S1 3.4.3).

Noise and resolution at rest; gain and delay from a sine of the rod, each channel compared with a
laboratory instrument for the same quantity.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.motion import Mover, sine
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Comparison,
    DocumentFigure,
    Series,
    column,
)
from hil_emulator.characterise.sine import fundamental
from hil_emulator.characterise.size import fastest, of_documents
from hil_emulator.characterise.stand import Bench, BenchRecord
from hil_emulator.model.sensors import CHANNELS, Channel
from hil_emulator.pages.palette import BLACK, BLUE, GREEN, PINK, SKY, VERMILION

DOCUMENT_LOAD_CELL_NOISE = 50.0
"""±50 N of the load cell (S1 3.4.3), taken as three standard deviations [N]."""
_REST = 4.0  # [s]
_HERTZ, _PART = 4.0, 0.25  # of the sine; amplitude, part of the stroke
_TIMING = 5e-5  # error of a measured delay from noise [s]
_SHOWN = {"bar": 1e-5, "mm": 1e3}  # factors from SI to the unit of a channel, if they differ


@dataclass(frozen=True)
class _Measured:
    """Measured values of one channel, SI; nan if the sine does not excite it."""

    noise: float
    step: float
    gain: float
    delay: float


def _step(reading: Series) -> float:
    """Return the smallest distance between two different readings, beyond round-off."""
    steps = np.diff(np.unique(reading))
    real = steps[steps > 1e-9 * np.ptp(reading)]
    return float(real.min()) if real.size else 0.0


def _measure(channel: Channel, rest: BenchRecord, moving: BenchRecord) -> _Measured:
    omega = 2.0 * math.pi * _HERTZ
    truth = fundamental(moving.time, moving.signals[channel.signal], omega)
    ratio = complex(math.nan, math.nan)
    if abs(truth) > 1e-4 * channel.span:
        ratio = fundamental(moving.time, moving.readings[channel.name], omega) / truth
    return _Measured(
        noise=float(np.std(rest.readings[channel.name] - rest.signals[channel.signal])),
        step=_step(moving.readings[channel.name]),
        gain=abs(ratio),
        delay=-float(np.angle(ratio)) / omega,
    )


def expected_delay(given: Mapping[str, float], omega: float) -> float:
    """Return the delay [s] of a sine through filters, estimator and dead time of a channel.

    The delay of a filter is its phase, arg H(j omega)/omega, for 1/(1 + tau s) and a Butterworth
    low-pass of second order; at low frequency it is tau and sqrt(2)/(2 pi f_c).
    """
    delay = given.get("delay_time", 0.0) + 0.5 * given.get("velocity_estimator_window", 0.0)
    lag = math.atan(omega * given.get("lag_time_constant", 0.0))
    w = omega / (2.0 * math.pi * given.get("anti_aliasing_cut_off", math.inf))
    return delay + (lag + math.atan2(math.sqrt(2.0) * w, 1.0 - w * w)) / omega


def _rows(channel: Channel, given: Mapping[str, float], result: _Measured) -> list[Comparison]:
    """Compare one channel with its configuration."""
    factor, name = _SHOWN.get(channel.shown, 1.0), channel.name.replace("_", " ")
    sigma, step = given.get("noise_sigma", 0.0), given.get("resolution_step", 0.0)
    noise = math.hypot(sigma, step / 12**0.5)
    delay = expected_delay(given, 2.0 * math.pi * _HERTZ)
    rows = [
        (sigma, f"noise of {name}, standard deviation", channel.shown, noise * factor,
         result.noise * factor, 0.05),
        (step, f"resolution of {name}", channel.shown, step * factor, result.step * factor, 1e-3),
        (delay, f"delay of {name}", "ms", delay * 1e3, result.delay * 1e3,
         max(0.05, _TIMING / delay) if delay else 0.0),
    ]  # fmt: skip
    return [
        Comparison(
            quantity, unit, expected, "configured", measured, tolerance, Agreement.CONFIGURED
        )
        for on, quantity, unit, expected, measured, tolerance in rows
        if on and not math.isnan(measured)
    ]


def _comparisons(bench: Bench, results: Mapping[str, _Measured]) -> list[Comparison]:
    rows = [
        row for c in CHANNELS for row in _rows(c, bench.sensors.get(c.name, {}), results[c.name])
    ]
    noise = results["load_force"].noise
    if noise and of_documents(bench):
        rows.append(Comparison(
            "noise of the load cell, three standard deviations", "N", DOCUMENT_LOAD_CELL_NOISE,
            "configured as a third of S1 3.4.3: ±50 N", 3.0 * noise, 0.05, Agreement.CONFIGURED,
        ))  # fmt: skip
    return rows


def run(bench: Bench) -> BenchResult:
    """Measure every channel at rest and under a sine."""
    centre = 0.5 * bench.value("cylinder_stroke")
    start = {"initial_position": centre}
    stand = bench.stand(start)
    rest = stand.drive(np.zeros(round(_REST / stand.period)))
    stand = bench.stand(start)
    reach = min(_PART * 2.0 * centre, fastest(bench) / (2.0 * math.pi * _HERTZ))
    path = sine(centre, reach, _HERTZ, stand.period, 12.0)
    moving = Mover(bench, stand).follow(path).after(2.0 / _HERTZ)
    results = {c.name: _measure(c, rest, moving) for c in CHANNELS}
    shown = slice(100, 600)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Four seconds with the valve centred for noise and resolution; a sine of ±25 % of the "
            "stroke at 4 Hz for gain and delay, against the quantity itself."
        ),
        columns={"time": column("s", rest.time[shown])}
        | {
            c.name.replace("_", " "): column(
                c.shown, (rest.readings[c.name] - rest.signals[c.signal])[shown]
                * _SHOWN.get(c.shown, 1.0)
            )
            for c in CHANNELS
        },
        comparisons=_comparisons(bench, results),
        notes=[
            f"{name}: gain {s.gain:.4f}, delay {s.delay * 1e3:.2f} ms at {_HERTZ:g} Hz."
            for name, s in results.items()
            if not math.isnan(s.gain)
        ],
        figures=[
            DocumentFigure("S1 3.4.3", "noise of the load cell ±1 % of the whole range, ±50 N",
                           "two lines at ±50 N"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the error of every channel at rest."""
    names = [name for name in result.columns if name != "time"]
    rows = figure.subplots(len(names), 1, sharex=True)
    colours = (BLUE, VERMILION, GREEN, PINK, SKY)
    for i, (axes, name) in enumerate(zip(rows, names, strict=True)):
        axes.plot(result["time"], result[name], linewidth=0.6, color=colours[i % len(colours)])
        title = name
        if name == "load force" and result.figures:
            title += ", dotted: S1 3.4.3"
            for sign in (1.0, -1.0):
                axes.axhline(sign * DOCUMENT_LOAD_CELL_NOISE, color=BLACK, linewidth=0.8,
                             linestyle=":")  # fmt: skip
        look.label(
            axes, "time [s]" if axes is rows[-1] else "", f"[{result.columns[name].unit}]", title
        )


TEST = Procedure(
    "sensors", "Noise, resolution and delay of the sensors", run, draw, Chapter.SENSORS, 1
)

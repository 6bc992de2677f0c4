"""Noise, resolution and delay of every sensor channel (S1 3.4.3).

Noise and resolution at rest; gain and delay from a sine of the rod, each channel against the
quantity it measures as a laboratory instrument shows it.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.motion import Mover, sine
from hil_emulator.characterise.procedure import Procedure
from hil_emulator.characterise.result import Comparison, Result, Series, column
from hil_emulator.characterise.sine import fundamental
from hil_emulator.characterise.stand import Bench, Recording
from hil_emulator.model.sensors import CHANNELS, Channel

DOCUMENT_LOAD_CELL_NOISE = 50.0
"""±50 N of the load cell (S1 3.4.3), taken as three standard deviations [N]."""
_REST = 4.0  # [s]
_HERTZ, _PART = 4.0, 0.1  # of the sine; amplitude, part of the stroke
_SHOWN = {"bar": 1e-5, "mm": 1e3, "N": 1.0}  # from SI to the unit of a channel


def _noise_and_step(reading: Series, truth: Series) -> tuple[float, float]:
    """Return standard deviation of the error and smallest step between readings."""
    steps = np.diff(np.unique(reading))
    real = steps[steps > 1e-9 * max(1e-12, float(np.ptp(reading)))]
    return float(np.std(reading - truth)), float(real.min()) if real.size else 0.0


def _gain_and_delay(channel: Channel, seen: Recording) -> tuple[float, float]:
    """Return gain and delay [s] of a channel from the fundamental of the sine."""
    omega = 2.0 * math.pi * _HERTZ
    truth = fundamental(seen.time, seen.signals[channel.signal], omega)
    if abs(truth) < 1e-4 * channel.span:
        return math.nan, math.nan
    ratio = fundamental(seen.time, seen.readings[channel.name], omega) / truth
    return abs(ratio), -float(np.angle(ratio)) / omega


def _expected_noise(bench: Bench, channel: str) -> float:
    """Return what white noise and rounding make together."""
    given = bench.sensors.get(channel, {})
    return math.hypot(given.get("noise_sigma", 0.0), given.get("resolution_step", 0.0) / 12**0.5)


def _comparisons(bench: Bench, found: dict[str, tuple[float, float]]) -> list[Comparison]:
    rows = []
    for channel in CHANNELS:
        noise, step = found[channel.name]
        factor, name = _SHOWN.get(channel.shown, 1.0), channel.name.replace("_", " ")
        given = bench.sensors.get(channel.name, {})
        if given.get("noise_sigma"):
            rows.append(Comparison(
                f"noise of {name}, standard deviation", channel.shown,
                _expected_noise(bench, channel.name) * factor, "configured noise and resolution",
                noise * factor, 0.05,
            ))  # fmt: skip
            if given.get("resolution_step"):
                rows.append(Comparison(
                    f"resolution of {name}", channel.shown, given["resolution_step"] * factor,
                    "configured", step * factor, 1e-3,
                ))  # fmt: skip
    noise = found["load_force"][0]
    if noise:
        rows.append(Comparison(
            "noise of the load cell, three standard deviations", "N", DOCUMENT_LOAD_CELL_NOISE,
            "S1 3.4.3: ±50 N", 3.0 * noise, 0.05,
        ))  # fmt: skip
    return rows


def run(bench: Bench) -> Result:
    """Measure every channel at rest and under a sine."""
    centre = 0.5 * bench.value("cylinder_stroke")
    start = {"initial_position": centre}
    stand = bench.stand(start)
    rest = stand.drive(np.zeros(round(_REST / stand.period)))
    found = {
        c.name: _noise_and_step(rest.readings[c.name], rest.signals[c.signal]) for c in CHANNELS
    }
    stand = bench.stand(start)
    path = sine(centre, _PART * 2.0 * centre, _HERTZ, stand.period, 12.0)
    moving = Mover(bench, stand).follow(path).after(2.0 / _HERTZ)
    dynamic = {c.name: _gain_and_delay(c, moving) for c in CHANNELS}
    shown = slice(None, 500)
    notes = [
        f"{name}: gain {gain:.4f}, delay {delay * 1e3:.2f} ms at {_HERTZ:g} Hz."
        for name, (gain, delay) in dynamic.items()
        if not math.isnan(gain)
    ]
    return Result(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Four seconds with the valve centred for noise and resolution; a sine of ±10 % of the "
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
        comparisons=_comparisons(bench, found),
        notes=notes,
    )  # fmt: skip


def draw(result: Result, figure: Figure) -> None:
    """Draw the error of every channel at rest."""
    names = [name for name in result.columns if name != "time"]
    rows = figure.subplots(len(names), 1, sharex=True)
    colours = (look.BLUE, look.ORANGE, look.GREEN, look.PINK, look.SKY)
    for i, (axes, name) in enumerate(zip(rows, names, strict=True)):
        axes.plot(result["time"], result[name], linewidth=0.6, color=colours[i % len(colours)])
        look.label(
            axes, "time [s]" if axes is rows[-1] else "", f"[{result.columns[name].unit}]", name
        )


TEST = Procedure("sensors", "Noise, resolution and delay of the sensors", run, draw)

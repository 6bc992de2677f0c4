"""Pictures of the gap: traces, and residuals of the balances."""

import textwrap
from typing import Any

import numpy as np

from hil_emulator.identify.conclusion.findings import Unexplained
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.residuals import Binned, Map, shown_as
from hil_emulator.identify.measured.experiment import UNITS, Array
from hil_emulator.identify.prediction.free_terms.regressors import REGRESSORS
from hil_emulator.identify.reporting.canvas import (
    AFTER,
    BEFORE,
    MEASURED,
    figure,
    logarithmic,
    png,
)

SHOWN_SAMPLES = 2000
"""Longest drawn stretch of a trace [samples]."""


READABLE = 10
"""Largest number of crossings of the mean in a readable stretch (assumed)."""

TELLING = 0.1
"""Least squared error of a readable stretch, relative to the largest (assumed)."""


def widest_trace(result: Result) -> str:
    """Return the trace whose disagreement shrank by the largest factor, or else the widest one.

    Traces with a stretch that is slow enough to read come first.
    """

    def worth(name: str) -> tuple[bool, float]:
        trace = result.traces[name]
        old, new = (_mean_square(trace, when) for when in ("before", "after"))
        readable = _readable(trace, trace["free_before" if _free(trace) else "before"])
        return bool(readable.any()), old / new if result.effects else old

    return max(result.traces, key=worth)


def _mean_square(trace: dict[str, Array], when: str) -> float:
    error = trace[f"free_{when}"] if _free(trace) else trace[when]
    finite = error[np.isfinite(error)]  # empty if the channel ended early
    return float(np.sum((finite / trace["noise"][0]) ** 2)) / max(len(finite), 1) + 1e-12


def _free(trace: dict[str, Array]) -> bool:
    return bool(np.isfinite(trace["free_before"]).any())


def trace(result: Result, name: str) -> bytes:
    """Draw measurement, both models and their errors in the stretch with the largest error."""
    t = result.traces[name]
    free = _free(t)
    prefix = "free_" if free else ""
    factor, unit = shown_as(UNITS[name.rpartition("/")[2]])
    old, new = t[f"{prefix}before"], t[f"{prefix}after"]
    here = _stretch(t, old)
    drawn, (top, bottom) = figure(3.9, rows=2, sharex=True, height_ratios=(3, 2))
    both = bool(result.effects)
    top.plot(
        t["time"][here], factor * t["measured"][here], color=MEASURED, lw=1.4, label="measured"
    )
    models = [("configured model", old, BEFORE, "--")]
    if both:
        models.append(("completed model", new, AFTER, "-"))
    for label, error, colour, line in models:
        top.plot(t["time"][here], factor * (t["measured"] - error)[here], line, color=colour,
                 lw=1.1, label=label)  # fmt: skip
        bottom.plot(t["time"][here], factor * error[here], line, color=colour, lw=0.9)
    bottom.axhline(0.0, color=MEASURED, lw=0.5)
    experiment, _, channel = name.rpartition("/")
    top.set_ylabel(f"{channel.replace('_', ' ')} [{unit}]", fontsize=9)
    bottom.set_ylabel(f"error [{unit}]", fontsize=9)
    bottom.set_xlabel("time [s]", fontsize=9)
    run = "free run, restarted every 0.5 s" if free else "force balance"
    top.set_title(f"{experiment}: {run}", fontsize=9, loc="left", parse_math=False)
    top.legend(fontsize=8, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return png(drawn)


def _stretch(trace: dict[str, Array], error: Array) -> Any:
    """Return the samples of the stretch in which an error is largest, among readable ones first."""
    within = _within(np.nan_to_num(error) ** 2)
    readable = _readable(trace, error)
    first = int(np.argmax(np.where(readable, within, -1.0) if readable.any() else within))
    return slice(first, first + min(len(error), SHOWN_SAMPLES))


def _readable(trace: dict[str, Array], error: Array) -> Any:
    """Return which stretches are slow and have a visible error, by their first sample."""
    measured = np.nan_to_num(trace["measured"] - np.nanmean(trace["measured"]))
    crossings = np.diff(np.signbit(measured), append=measured[-1] < 0.0).astype(float)
    within = _within(np.nan_to_num(error) ** 2)
    return (_within(crossings) <= READABLE) & (within >= TELLING * within.max())


def _within(values: Array) -> Array:
    """Return the sum of values in each stretch, by its first sample."""
    count = min(len(values), SHOWN_SAMPLES)
    total = np.concatenate([[0.0], np.cumsum(values)])
    sums: Array = total[count:] - total[:-count]
    return sums


def balance(drawn_map: Map, both: bool) -> bytes:
    """Draw the residual of a balance over its regressor, before and after, and over frequency."""
    wide = len(drawn_map.frequency) > 0
    widths = [1.0, 1.0, 0.9] if both else [1.2, 1.0]
    drawn, axes = figure(2.9, columns=len(widths), width_ratios=widths)
    panels = [("configured model", drawn_map.before, BEFORE)]
    if both:
        panels.append(("completed model", drawn_map.after, AFTER))
    for one, (label, binned, colour) in zip(axes, panels, strict=False):
        _band(one, drawn_map, binned, colour)
        one.set_title(label, fontsize=9, loc="left", color=colour)
        words = textwrap.fill(f"{drawn_map.regressor} [{drawn_map.regressor_unit}]", 28)
        one.set_xlabel(words, fontsize=8)
    axes[0].set_ylabel(f"lacks [{drawn_map.unit}]", fontsize=9)
    if both:
        axes[1].sharey(axes[0])
    last = axes[-1]
    if wide:
        for (_, _, colour), power, line in zip(
            panels, drawn_map.spectra, ("--", "-"), strict=False
        ):
            last.plot(drawn_map.frequency, power, line, color=colour, lw=1.2)
        logarithmic(last.xaxis)
        logarithmic(last.yaxis, 60.0)
        last.set_xlabel("frequency [Hz]", fontsize=8)
        last.set_ylabel(f"density [{drawn_map.unit}/√Hz]", fontsize=8)
        last.set_title("spectrum", fontsize=9, loc="left")
    return png(drawn)


def _band(axes: Any, drawn_map: Map, binned: Binned, colour: str) -> None:
    """Draw median and spread of a residual in bins of its regressor."""
    axes.fill_between(drawn_map.centres, binned.low, binned.high, color=colour, alpha=0.25, lw=0)
    axes.plot(drawn_map.centres, binned.middle, "o-", color=colour, ms=3, lw=1.2)
    axes.axhline(0.0, color=MEASURED, lw=0.5)


def term(unexplained: Unexplained) -> bytes:
    """Draw an unexplained term over its regressor."""
    factor, unit = shown_as(unexplained.unit)
    drawn, axes = figure(2.4)
    knots = np.array(unexplained.knots)
    scale, regressor_unit = shown_as(REGRESSORS[unexplained.regressor].unit)
    axes.plot(scale * knots, factor * np.array(unexplained.curve), "o-", color=BEFORE)
    axes.axhline(0.0, color=MEASURED, lw=0.5)
    axes.set_xlabel(f"{unexplained.regressor} [{regressor_unit}]", fontsize=9)
    axes.set_ylabel(f"lacking in the\n{unexplained.balance} [{unit}]", fontsize=8)
    return png(drawn)

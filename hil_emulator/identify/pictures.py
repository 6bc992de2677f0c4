"""Pictures of a result, as PNG in memory."""

import base64
import io
from typing import Any

import numpy as np

from hil_emulator.identify.result import Result

BEFORE, AFTER = "#c44e52", "#4c72b0"


def ranking(result: Result) -> str:
    """Draw what the likeliest effects gain in the first round."""
    figure, axes = _figure(7.0, 3.2)
    scores = result.search.rounds[0].scores[:12] if result.search else []
    found = {f.name for f in result.effects}
    names = [s.coordinate.name for s in scores][::-1]
    gains = [max(s.statistic, 1.0) for s in scores][::-1]
    colours = [AFTER if n in found else "#bbbbbb" for n in names]
    axes.barh(names, gains, color=colours)
    axes.set_xscale("log")
    axes.set_xlabel("gain in chi-square, ordinary parameters projected out (blue: named)")
    return _png(figure)


def gap(result: Result) -> str:
    """Draw the gap per channel before and after, on training and validation data."""
    figure, axes = _figure(7.0, 3.0)
    channels = list(result.gap)
    place = np.arange(len(channels))
    for k, part in enumerate(("training", "validation")):
        for when, colour in (("before", BEFORE), ("after", AFTER)):
            values = [result.gap[c].get(part, {}).get(when, np.nan) for c in channels]
            shift = 0.2 * (2 * k + (when == "after")) - 0.3
            axes.bar(place + shift, values, 0.18, color=colour, alpha=1.0 - 0.4 * k,
                     label=f"{part}, {when}")  # fmt: skip
    axes.set_xticks(place, channels)
    axes.set_ylabel(f"rms [{result.measure}]", fontsize=8)
    axes.legend(fontsize=7, ncols=2)
    return _png(figure)


def trace(result: Result, name: str) -> str:
    """Draw the one-step disagreement of one channel over time, before and after."""
    figure, axes = _figure(7.0, 2.2)
    t = result.traces[name]
    axes.plot(t["time"], t["before"], color=BEFORE, lw=0.6, label="before")
    axes.plot(t["time"], t["after"], color=AFTER, lw=0.6, label="after")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"[{result.measure}]", fontsize=7)
    axes.set_title(name, fontsize=9)
    axes.legend(fontsize=7, loc="upper right")
    return _png(figure)


def term(result: Result, index: int) -> str:
    """Draw an unexplained term over its driver."""
    figure, axes = _figure(5.0, 2.6)
    u = result.unknown[index]
    axes.plot(u.knots, u.curve, "o-", color=BEFORE)
    axes.set_xlabel(f"{u.driver} (SI)")
    axes.set_ylabel(f"term in the {u.balance} [{u.unit}]", fontsize=8)
    return _png(figure)


def correlations(result: Result) -> str:
    """Draw how the fitted parameters depend on each other."""
    figure, axes = _figure(5.4, 4.6)
    if result.search is None or result.search.final is None:
        return _png(figure)
    cov = result.search.final.covariance()
    spread = np.sqrt(np.maximum(np.diag(cov), 1e-30))
    picture = axes.imshow(cov / np.outer(spread, spread), cmap="RdBu_r", vmin=-1, vmax=1)
    names = [c.name for c in result.search.final.coordinates]
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
    axes.set_yticks(range(len(names)), names, fontsize=6)
    figure.colorbar(picture)
    return _png(figure)


def _figure(width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def _png(figure: Any) -> str:
    """Return a picture as text for an HTML page."""
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=110)
    return base64.b64encode(memory.getvalue()).decode()

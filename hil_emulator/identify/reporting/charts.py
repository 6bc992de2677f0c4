"""Charts of a result: the gap by channel, the ranking, the ladder, the correlations."""

from collections.abc import Mapping

import numpy as np

from hil_emulator.identify.conclusion.findings import Finding
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.canvas import (
    AFTER,
    BEFORE,
    FLOOR,
    MEASURED,
    figure,
    logarithmic,
    png,
)
from hil_emulator.identify.reporting.channel_errors import in_noise
from hil_emulator.identify.selection.levels import NORMAL_95

LEAST_KNOWN = 0.5
"""Relative standard deviation of a size up to which a picture scales to it."""

_WHOLE = 100.0
"""Gain from which on a chart leaves out its decimals."""

RANKED = 12
"""Candidates that a ranking shows."""


def gap(result: Result) -> bytes:
    """Draw the gap per channel before and after over its floor, one step ahead and free."""
    channels = list(result.gap)[::-1]
    entries = [_held_out(result.gap[c]) for c in channels]
    free = any("free_before" in e for e in entries)
    kinds = {"": "one step ahead", "free_": "free run of 0.5 s"} if free else {"": ""}
    drawn, axes = figure(1.2 + 0.36 * len(channels), columns=len(kinds), squeeze=False, sharey=True)
    place = np.arange(len(channels))
    for one, (kind, words) in zip(axes[0], kinds.items(), strict=True):
        for when, colour, mark, size in (
            ("floor", FLOOR, "|", 15), ("before", BEFORE, "o", 7), ("after", AFTER, "s", 5),
        ):  # fmt: skip
            if when == "after" and not result.effects:
                continue
            values = [e.get(f"{kind}{when}", np.nan) for e in entries]
            one.plot(values, place, mark, color=colour, ms=size, mew=2.0 if mark == "|" else 1.0,
                     label=when)  # fmt: skip
        logarithmic(one.xaxis)
        one.set_title(words, fontsize=9, loc="left")
        one.grid(axis="x", lw=0.3)
        one.set_xlabel(f"rms [{_unit(result)}]", fontsize=9)
    axes[0, 0].set_yticks(place, [c.replace("_", " ") for c in channels], fontsize=9)
    axes[0, 0].set_ylim(-0.6, len(channels) - 0.4)
    axes[0, -1].legend(fontsize=8, ncols=3, frameon=False, loc="lower right",
                       bbox_to_anchor=(1.0, 1.0))  # fmt: skip
    return png(drawn)


def _unit(result: Result) -> str:
    return "multiple of the noise" if in_noise(result) else result.measure


def _held_out(parts: Mapping[str, Mapping[str, float]]) -> Mapping[str, float]:
    return parts.get("validation") or parts["training"]


def ranking(result: Result) -> bytes:
    """Draw the gains of the likeliest effects in the first round."""
    scores = result.search.rounds[0].scores[:RANKED][::-1] if result.search else []
    named = {f.name for f in result.effects}
    drawn, axes = figure(0.9 + 0.22 * len(scores))
    names = [s.coordinate.name for s in scores]
    gains = [max(s.statistic, 0.0) for s in scores]
    bars = axes.barh(names, gains, color=[AFTER if n in named else FLOOR for n in names],
                     height=0.7)  # fmt: skip
    # bars start at zero, so lengths show ratios; short bars have their value as text
    written = [f"{gain:.1f}" if gain < _WHOLE else f"{gain:.0f}" for gain in gains]
    axes.bar_label(bars, written, padding=3, fontsize=8)
    axes.margins(x=0.1)
    axes.set_xlabel("gain in chi-square, ordinary parameters projected out (blue: named)",
                    fontsize=9)  # fmt: skip
    return png(drawn)


def _ends(result: Result, finding: Finding) -> list[float]:
    """Return the ends of an interval relative to the reported size."""
    named = result.search.effects if result.search else []
    knob = next(c for c in named if c.name == finding.name)
    if knob.inverse:
        return sorted(finding.value / end for end in finding.interval)
    return sorted((end - knob.neutral) / (finding.value - knob.neutral) for end in finding.interval)


def sizes(result: Result) -> bytes:
    """Draw each experiment's estimate relative to the reported size, with 95 % intervals."""
    findings = [f for f in result.effects if f.by_experiment][::-1]
    rows = [(f, w) for f in findings for w in f.by_experiment[::-1]]
    drawn, axes = figure(0.9 + 0.2 * len(rows) + 0.25 * len(findings))
    ticks, begin, extent = [], 0.0, [1.0]
    for f in findings:
        of_it = f.by_experiment[::-1]
        places = begin + np.arange(len(of_it))
        ticks += places.tolist()
        ends = _ends(result, f)
        # an experiment with a wide interval may exceed the picture
        extent += [*ends, *(w.size for w in of_it if w.deviation < LEAST_KNOWN)]
        axes.fill_betweenx([begin - 0.6, places[-1] + 0.6], *ends, color=FLOOR, alpha=0.25, lw=0)
        for place, w in zip(places, of_it, strict=True):
            later = w.experiment in result.held_out
            axes.errorbar(w.size, place, xerr=NORMAL_95 * w.deviation, fmt="s" if later else "o",
                          color=AFTER if later else MEASURED, ms=4, lw=1.2)  # fmt: skip
        axes.text(0.01, places[-1] + 0.65, f.name, fontsize=9, va="bottom",
                  transform=axes.get_yaxis_transform())  # fmt: skip
        begin = float(places[-1]) + 2.25
    axes.axvline(1.0, color=FLOOR, lw=0.8)
    axes.set_yticks(ticks, [w.experiment for _, w in rows], fontsize=8)
    axes.set_ylim(-0.8, begin - 1.0)
    room = 0.1 * (max(extent) - min(extent)) + 0.01
    axes.set_xlim(min(extent) - room, max(extent) + room)
    axes.set_xlabel("estimate of an experiment, relative to the reported size; grey: its interval; "
                    "squares: held out", fontsize=9)  # fmt: skip
    return png(drawn)


def ladder(result: Result) -> bytes:
    """Draw the gain of every accepted effect, on training and on held-out data."""
    steps = result.ladder[::-1]
    drawn, axes = figure(1.1 + 0.42 * len(steps))
    place = np.arange(len(steps))
    for shift, part, colour in ((0.18, "training", FLOOR), (-0.18, "validation", AFTER)):
        gains = [max(s[part], 1.0) if s[part] is not None else np.nan for s in steps]
        label = "training" if part == "training" else "held out"
        axes.barh(place + shift, gains, 0.34, color=colour, label=label)
    names = [s["effect"] + (f"\nwith {s['beside']}" if s["beside"] else "") for s in steps]
    axes.set_yticks(place, names, fontsize=9)
    axes.set_xlim(left=1.0)
    logarithmic(axes.xaxis)
    axes.set_xlabel("gain in chi-square of the joint refit", fontsize=9)
    axes.legend(fontsize=8, ncols=2, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return png(drawn)


def correlations(result: Result) -> bytes:
    """Draw how the fitted parameters depend on each other."""
    final = result.search.reported if result.search else None
    assert final is not None
    cov = final.covariance()
    spread = np.sqrt(np.maximum(np.diag(cov), 1e-30))
    names = [c.name for c in final.coordinates]
    drawn, axes = figure(max(2.6, 0.9 + 0.27 * len(names)))
    axes.spines[:].set_visible(False)
    shown = axes.imshow(cov / np.outer(spread, spread), cmap="PuOr", vmin=-1, vmax=1)
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    drawn.colorbar(shown, shrink=0.7).set_label("correlation", fontsize=8)
    return png(drawn)

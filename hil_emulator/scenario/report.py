"""Reports of outcomes: a table, JUnit XML, one HTML page."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from hil_emulator import __version__, units
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, PINK, VERMILION
from hil_emulator.pages.render import render
from hil_emulator.scenario.outcome import Outcome, Span
from hil_emulator.signals.columns import MODEL, columns

_PANELS = (
    ("position", ("position", "model.position")),
    ("load force", ("load_force",)),
    ("pressure", ("pressure_a", "pressure_b", "supply_pressure")),
    ("valve current", ("valve_current",)),
)
_COLOURS = (BLUE, VERMILION, PINK)
_APART = 0.25  # part of the duration: labels of closer events are stacked
_ROOM = 0.08  # part of the axis that is added above and below (assumed)
_LABEL = 48  # longest label of an event in characters (assumed)


def rows(outcomes: Sequence[Outcome]) -> list[tuple[str, str, str, str, str]]:
    """Return a row per scenario: verdict, title, expectations met, speed, digest."""
    return [
        (
            "pass" if o.passed else "FAIL",
            o.title,
            f"{sum(c.passed for c in o.checks)}/{len(o.checks)}",
            f"{o.elapsed:.1f} s",
            o.digest,
        )
        for o in outcomes
    ]


def failures(outcomes: Sequence[Outcome]) -> list[str]:
    """Return a line for each expectation that is not met, and each scenario that could not run."""
    lines = []
    for o in outcomes:
        if o.error:
            lines.append(f"{o.title}: {o.error}")
            continue
        lines += [f"{o.title}: {c.text}: {c.observed}" for c in o.checks if not c.passed]
    return lines


def junit(outcomes: Sequence[Outcome], file: Path) -> None:
    """Write JUnit XML: a test case per scenario."""
    failed = sum(bool(not o.passed and not o.error) for o in outcomes)
    suite = ElementTree.Element(
        "testsuite",
        name="hil-emulator scenarios",
        tests=str(len(outcomes)),
        failures=str(failed),
        errors=str(sum(bool(o.error) for o in outcomes)),
        time=f"{sum(o.elapsed for o in outcomes):.3f}",
    )
    for o in outcomes:
        case = ElementTree.SubElement(
            suite, "testcase", classname="scenario", name=o.title, time=f"{o.elapsed:.3f}"
        )
        if o.error:
            ElementTree.SubElement(case, "error", message=o.error)
            continue
        missed = [f"{c.text}: {c.observed}" for c in o.checks if not c.passed]
        if missed:
            ElementTree.SubElement(case, "failure", message=missed[0]).text = "\n".join(missed)
    ElementTree.ElementTree(suite).write(file, encoding="utf-8", xml_declaration=True)


def page(outcomes: Sequence[Outcome], file: Path) -> None:
    """Write one self-contained HTML page."""
    text = render(
        "scenario.html",
        title="Scenarios",
        version=__version__,
        summary=rows(outcomes),
        scenarios=[(o, b"" if o.error else _picture(o)) for o in outcomes],
    )
    file.write_text(text, encoding="utf-8")


def _picture(o: Outcome) -> bytes:
    """Return the signals over time as PNG: faults and expected bands behind, events above them."""
    panels = [*_PANELS, *_other_expected(o)]
    figure, axes = drawing.subplots((9.6, 1.9 * len(panels)), len(panels), sharex=True)
    for axis, (quantity, names) in zip(axes, panels, strict=True):
        scale, unit = _written(columns()[names[0]], rotary=o.rotary)
        for fault in o.faults:
            axis.axvspan(fault.begin, fault.end, color=VERMILION, alpha=0.12, lw=0)
        for name, colour in zip(names, _COLOURS, strict=False):
            line = "--" if name.startswith("model.") else "-"
            axis.plot(o.curves["time"], o.curves[name] * scale, line, color=colour, lw=1.1,
                      label=name)  # fmt: skip
        _expected(axis, [b for b in o.bands if b.signal in names], scale)
        for moment, _ in o.events:
            axis.axvline(moment, color="0.5", lw=0.7, ls=":")
        axis.set_ylabel(f"{quantity} [{unit}]")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.005, 0.5), frameon=False)
    axes[-1].set_xlabel("emulator time [s]")
    _label_events(axes[0], o)
    return drawing.png(figure, 120)


def _written(unit: str, *, rotary: bool) -> tuple[float, str]:
    """Return the factor to the unit of a panel, and that unit."""
    with units.axis(rotary=rotary):
        shown = units.read_as(unit)
        return (1.0 / units.factor(unit, shown) if shown != unit else 1.0), shown


def _other_expected(o: Outcome) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield a panel for each expected signal that no other panel shows."""
    shown = {name for _, names in _PANELS for name in names}
    for name in dict.fromkeys(band.signal for band in o.bands if band.signal not in shown):
        yield name.removeprefix(MODEL).replace("_", " "), (name,)


def _expected(axis: Any, bands: Sequence[Span], scale: float) -> None:
    """Draw the expected bands of a signal; the axis grows to show an edge of each of them."""
    low, high = axis.get_ylim()
    for band in bands:
        bottom, top = (value * scale for value in band.band)
        low, high = min(low, top), max(high, bottom)
    room = _ROOM * (high - low)
    low, high = low - room, high + room
    for number, band in enumerate(bands):
        ends = [min(max(value * scale, low), high) for value in band.band]
        label = None if number else "expected"
        axis.fill_between([band.begin, band.end], *ends, color=GREEN, alpha=0.18, lw=0, label=label)
        for end in {value * scale for value in band.band if low < value * scale < high}:
            axis.plot([band.begin, band.end], [end, end], color=GREEN, lw=0.8)
    axis.set_ylim(low, high)


def _label_events(axis: Any, o: Outcome) -> None:
    """Label the actions above the pictures, and the faults of the shaded spans."""
    height, free = 0, -1.0
    for moment, words in o.events:
        if words in {fault.words for fault in o.faults}:
            continue
        height = height + 1 if moment < free else 0
        free = moment + _APART * o.duration
        axis.annotate(textwrap.shorten(words, _LABEL), (moment, 1.0), (2, 3 + 11 * height),
                      xycoords=("data", "axes fraction"), textcoords="offset points",
                      fontsize=7.5, color="0.25", annotation_clip=False)  # fmt: skip
    for fault in o.faults:
        axis.annotate(fault.words, (fault.begin, 0.02), (3, 2), fontsize=7.5, color=VERMILION,
                      xycoords=("data", "axes fraction"), textcoords="offset points")  # fmt: skip

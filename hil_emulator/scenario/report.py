"""Outcomes for people and for continuous integration: a table, JUnit XML, one HTML page."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from hil_emulator import __version__
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE, GREEN, VERMILION
from hil_emulator.pages.render import render
from hil_emulator.scenario.outcome import Outcome

_PANELS = (
    ("position [mm]", 1e3, ("position", "model.position")),
    ("load force [N]", 1.0, ("load_force",)),
    ("pressure [bar]", 1e-5, ("pressure_a", "pressure_b", "supply_pressure")),
    ("valve current [mA]", 1e3, ("valve_current",)),
)
_COLOURS = (BLUE, VERMILION, GREEN)


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
    """Return a line for each expectation that is not met, and for what could not run."""
    lines = []
    for o in outcomes:
        if o.error:
            lines.append(f"{o.title}: {o.error}")
        lines += [f"{o.title}: {c.text}: {c.found}" for c in o.checks if not c.passed]
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
        missed = [f"{c.text}: {c.found}" for c in o.checks if not c.passed]
        if missed:
            ElementTree.SubElement(case, "failure", message=missed[0]).text = "\n".join(missed)
    ElementTree.ElementTree(suite).write(file, encoding="utf-8", xml_declaration=True)


def page(outcomes: Sequence[Outcome], file: Path) -> None:
    """Write one HTML page with everything in it, pictures too."""
    text = render(
        "scenario.html",
        title="Scenarios",
        version=__version__,
        summary=rows(outcomes),
        scenarios=[(o, b"" if o.error else _picture(o)) for o in outcomes],
    )
    file.write_text(text, encoding="utf-8")


def _picture(o: Outcome) -> bytes:
    """Return the signals over time as PNG."""
    figure, axes = drawing.subplots((9, 7), len(_PANELS), sharex=True)
    for axis, (label, scale, names) in zip(axes, _PANELS, strict=True):
        for name, colour in zip(names, _COLOURS, strict=False):
            line = "--" if name.startswith("model.") else "-"
            axis.plot(o.curves["time"], o.curves[name] * scale, line, color=colour, lw=0.9,
                      label=name)  # fmt: skip
        for moment in o.events:
            axis.axvline(moment, color="0.6", lw=0.6, ls=":")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.97),
                    frameon=False)  # fmt: skip
    axes[-1].set_xlabel("emulator time [s]")
    return drawing.png(figure, 120)

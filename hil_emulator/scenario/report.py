"""Outcomes for people and for continuous integration: a table, JUnit XML, one HTML page."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from hil_emulator import __version__
from hil_emulator.scenario.outcome import Outcome

_PANELS = (
    ("position [mm]", 1e3, ("position", "model.position")),
    ("load force [N]", 1.0, ("load_force",)),
    ("pressure [bar]", 1e-5, ("pressure_a", "pressure_b", "supply_pressure")),
    ("valve current [mA]", 1e3, ("valve_current",)),
)
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto }
table { border-collapse: collapse; width: 100% } td, th { text-align: left; padding: .25rem .6rem;
border-bottom: 1px solid #ccc } .pass { color: #176b3a } .fail { color: #b3261e }
img { width: 100% }
"""


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
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><title>Scenarios</title>",
        f"<style>{_STYLE}</style><h1>Scenarios</h1><p>hil-emulator {__version__}</p><table>",
        "<tr><th>verdict<th>scenario<th>expectations met<th>time<th>digest",
    ]
    for i, row in enumerate(rows(outcomes)):
        kind = "pass" if outcomes[i].passed else "fail"
        cells = "".join(f"<td>{html.escape(cell)}" for cell in row[2:])
        link = f'<a href="#s{i}">{html.escape(row[1])}</a>'
        parts.append(f"<tr><td class={kind}>{row[0]}<td>{link}{cells}")
    parts.append("</table>")
    for i, o in enumerate(outcomes):
        parts.append(_section(i, o))
    file.write_text("\n".join(parts), encoding="utf-8")


def _section(number: int, o: Outcome) -> str:
    lines = [f'<h2 id="s{number}">{html.escape(o.title)}</h2>']
    if o.error:
        return "\n".join([*lines, f"<p class=fail>{html.escape(o.error)}</p>"])
    lines.append("<table>")
    for c in o.checks:
        kind, word = ("pass", "met") if c.passed else ("fail", "NOT MET")
        lines.append(
            f"<tr><td class={kind}>{word}<td>{html.escape(c.text)}<td>{html.escape(c.found)}"
        )
    lines += ["</table>", f'<img alt="signals over time" src="{_picture(o)}">']
    return "\n".join(lines)


def _picture(o: Outcome) -> str:
    """Return the signals over time as a data URL."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        len(_PANELS), 1, sharex=True, figsize=(9, 7), layout="constrained"
    )
    for axis, (label, scale, names) in zip(axes, _PANELS, strict=True):
        for name in names:
            dashed = "--" if name.startswith("model.") else "-"
            axis.plot(o.curves["time"], o.curves[name] * scale, dashed, lw=0.9, label=name)
        for moment in o.events:
            axis.axvline(moment, color="0.6", lw=0.6, ls=":")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left", fontsize=8, ncols=3)
    axes[-1].set_xlabel("emulator time [s]")
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=90)
    pyplot.close(figure)
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode()

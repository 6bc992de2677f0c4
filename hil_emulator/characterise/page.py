"""All results on one HTML page that needs no other file."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path

from hil_emulator.characterise.result import BenchResult, Comparison
from hil_emulator.errors import UserError

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 60rem;
       margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 3rem; }
table { border-collapse: collapse; width: 100%; font-size: 0.85rem; }
th, td { padding: 0.3rem 0.6rem; border-bottom: 1px solid #ddd; text-align: left; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.agrees { color: #00614a; } td.differs { color: #a33c00; font-weight: bold; }
img { max-width: 100%; } .note { color: #555; font-size: 0.9rem; }
.scroll { overflow-x: auto; }
"""

_HEAD = (
    "Quantity", "Unit", "Document", "Emulator", "Difference", "Allowed", "Verdict", "Source",
)  # fmt: skip


_SOURCES = (
    "S1: T. Boaventura, Hydraulic Compliance Control of the Quadruped Robot HyQ, chapter 3. "
    "S2: Analysis of the Nonlinearities in the Hydraulic Actuators."
)


def _row(test: str, comparison: Comparison) -> str:
    c = comparison
    verdict = "agrees" if c.agrees else "differs"
    numbers = (
        f"{c.expected:.4g}", f"{c.measured:.4g}", f"{c.difference:+.2%}",
        f"±{100.0 * c.tolerance:.3g}%",
    )  # fmt: skip
    cells = "".join(f'<td class="number">{n}</td>' for n in numbers)
    return (
        f'<tr><td><a href="#{test}">{html.escape(c.quantity)}</a></td>'
        f"<td>{html.escape(c.unit)}</td>{cells}"
        f'<td class="{verdict}">{verdict}</td><td>{html.escape(c.source)}</td></tr>'
    )


def _summary(results: Sequence[BenchResult]) -> str:
    head = "".join(f"<th>{name}</th>" for name in _HEAD)
    rows = "\n".join(_row(r.name, c) for r in results for c in r.comparisons)
    return (
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead>\n'
        f"<tbody>{rows}</tbody></table></div>"
    )


def _section(result: BenchResult, folder: Path) -> str:
    picture = base64.b64encode((folder / f"{result.name}.png").read_bytes()).decode()
    notes = "".join(f'<p class="note">{html.escape(note)}</p>' for note in result.notes)
    title = html.escape(result.title)
    return (
        f'<h2 id="{result.name}">{title}</h2>\n<p>{html.escape(result.procedure)}</p>\n'
        f'<img alt="{title}" src="data:image/png;base64,{picture}">\n{notes}\n'
    )


def page(results: Sequence[BenchResult], folder: Path) -> str:
    """Return the page; the pictures are read from the folder."""
    agreeing = sum(c.agrees for r in results for c in r.comparisons)
    total = sum(len(r.comparisons) for r in results)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Bench tests of the emulated actuator</title><style>{_STYLE}</style></head><body>\n"
        "<h1>Bench tests of the emulated actuator</h1>\n"
        f"<p>{agreeing} of {total} quantities agree with their document: with its "
        "number, or with what its formula gives for the configured machine.</p>\n"
        f'<p class="note">{_SOURCES}</p>\n'
        + _summary(results)
        + "".join(_section(result, folder) for result in results)
        + "</body></html>\n"
    )


def write_page(results: Sequence[BenchResult], folder: Path) -> None:
    """Write index.html beside the results' files.

    Raises:
        UserError: if the folder cannot be written.

    """
    try:
        (folder / "index.html").write_text(page(results, folder), encoding="utf-8")
    except OSError as error:
        raise UserError(
            f"cannot write the page into {folder}: {error}; choose another folder"
        ) from error

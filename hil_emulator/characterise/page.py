"""All results on one HTML page that needs no other file."""

from collections.abc import Sequence
from pathlib import Path

from hil_emulator.characterise.result import BenchResult
from hil_emulator.errors import UserError
from hil_emulator.pages.render import render

_TITLE = "Bench tests of the emulated actuator"

_SOURCES = (
    "S1: T. Boaventura, Hydraulic Compliance Control of the Quadruped Robot HyQ, chapter 3. "
    "S2: Analysis of the Nonlinearities in the Hydraulic Actuators."
)


def page(results: Sequence[BenchResult], folder: Path) -> str:
    """Return the page; the pictures are read from the folder."""
    comparisons = [c for r in results for c in r.comparisons]
    return render(
        "characterise.html",
        title=_TITLE,
        sources=_SOURCES,
        agreeing=sum(c.agrees for c in comparisons),
        total=len(comparisons),
        tests=[(r, (folder / f"{r.name}.png").read_bytes()) for r in results],
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

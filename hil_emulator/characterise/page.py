"""All results on one self-contained HTML page."""

from collections.abc import Sequence
from pathlib import Path

from hil_emulator.characterise.result import BenchResult, grouped
from hil_emulator.model.constants import S1, S2
from hil_emulator.pages.render import render

_TITLE = "Bench tests of the emulated actuator"

_SOURCES = (
    f"{S1}. {S2}. Only data that the documents "
    "state as numbers are drawn; S1 Fig. 3.11 and S2 Fig. 1 to 4 state no numbers."
)


def page(results: Sequence[BenchResult], folder: Path) -> str:
    """Return the page; the pictures are read from the folder."""
    return render(
        "characterise.html",
        title=_TITLE,
        sources=_SOURCES,
        groups=grouped(results),
        tests=[(r, (folder / f"{r.name}.png").read_bytes()) for r in results],
    )

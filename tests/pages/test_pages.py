"""HTML pages, read with Python's HTML parser."""

import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError

from hil_emulator.characterise.page import page as characterise_page
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, DocumentFigure
from hil_emulator.identify.conclusion.findings import Finding, Refitted
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.report import report
from hil_emulator.pages.render import render
from hil_emulator.scenario.outcome import Check, Outcome
from hil_emulator.scenario.report import page as scenario_page

HOSTILE = """<script src="x">alert('1')<script>&lt;"""
"""A name that a file may have, and that would run if it were pasted into a page."""


class Page(HTMLParser):
    """A page that has been read.

    Attributes:
        tags: how often each tag opens.
        texts: pieces of text, and the values of attributes.
        fetched: addresses a browser would fetch.

    """

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: dict[str, int] = {}
        self.texts: list[str] = []
        self.fetched: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Count the tag, and store the values of its attributes."""
        self.tags[tag] = self.tags.get(tag, 0) + 1
        self.texts += [value or "" for _, value in attrs]
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_data(self, data: str) -> None:
        """Keep a piece of text."""
        self.texts.append(data)

    def count(self, text: str) -> int:
        """Return the number of pieces that contain a text."""
        return sum(text in piece for piece in self.texts)


def characterised(folder: Path) -> str:
    """Return a page of one bench test of which everything is called so."""
    row = Comparison(HOSTILE, HOSTILE, 1.0, HOSTILE, 1.0, 0.01, Agreement.DERIVED, (HOSTILE,))
    drawn = DocumentFigure(HOSTILE, HOSTILE, HOSTILE)
    (folder / f"{HOSTILE}.png").write_bytes(b"\x89PNG")
    result = BenchResult(HOSTILE, HOSTILE, HOSTILE, {}, [row], [HOSTILE], [drawn], [HOSTILE])
    return characterise_page([result], folder)


def judged(folder: Path) -> str:
    """Return a page of one scenario that ran and one that did not."""
    channels = ("position", "model.position", "load_force", "valve_current")
    channels += ("pressure_a", "pressure_b", "supply_pressure")
    curves = {name: np.linspace(0.0, 1.0, 3) for name in ("time", *channels)}
    ran = Outcome("x", HOSTILE, (Check(HOSTILE, False, HOSTILE),), curves=curves)
    scenario_page([ran, replace(ran, error=HOSTILE)], folder / "page.html")
    return (folder / "page.html").read_text("utf-8")


def identified(_: Path) -> str:
    """Return a page on an effect and files that are called so."""
    effect = Finding(
        HOSTILE, HOSTILE, 1.0, "N", "N", (0.5, 1.5), 0.9, 700.0, None, (HOSTILE,), True, (),
        form=HOSTILE, words=HOSTILE,
    )  # fmt: skip
    size = {
        "before": 2.0, "before_rms": 2.0, "before_percent": 20.0,
        "after": 1.0, "after_rms": 1.0, "after_percent": 10.0,
    }  # fmt: skip
    gap = {"load_force": {"training": size}}
    values = {HOSTILE: Refitted(1.0, 1.1, 0.9, 1.3, "N", "N")}
    return report(
        Result(
            "missing_effects", HOSTILE, [effect], gap=gap, measure=HOSTILE, parameters=values,
            unseen=[HOSTILE], next_experiment=HOSTILE, notes=[HOSTILE], digests={HOSTILE: HOSTILE},
        ), HOSTILE, HOSTILE,
    )  # fmt: skip


@pytest.mark.parametrize(("made", "times"), [(characterised, 12), (judged, 7), (identified, 13)])
def test_a_hostile_name_is_text(made: Callable[[Path], str], times: int, tmp_path: Path) -> None:
    """Whatever a file, a test or an effect is called: it is shown as it is, and runs nothing."""
    page = Page(made(tmp_path))
    assert "script" not in page.tags
    assert page.count(HOSTILE) == times
    assert all(a.startswith(("#", "data:image/png;base64,")) for a in page.fetched)


def test_a_template_leaves_nothing_open() -> None:
    """A value that is missing stops the page rather than leaving a hole in it."""
    with pytest.raises(UndefinedError, match="scenarios"):
        render("scenario.html", title="", version="", summary=[])


def test_numbers_stand_to_the_right(tmp_path: Path) -> None:
    """Whatever begins like a number does; a word does not."""
    right = re.findall(r'<td class="number">([^<]*)', identified(tmp_path))
    effect = ["1", "0.5 ... 1.5", "90 %", "700"]
    assert right[:6] == [*effect, "2 (20)", "1 (10)"]
    assert right[6:] == ["1", "1.1", "0.9 ... 1.3", "+10.0 %"]

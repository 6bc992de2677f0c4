"""The reference pages agree with the declarations."""

import re
from pathlib import Path

import pytest
from build_time.reference.attributes import meanings, unit_of
from build_time.reference.keys import keys
from build_time.reference.markdown import table, text
from build_time.reference.pages import PAGES, texts
from pydantic import Field
from test_docs import anchors

from hil_emulator.config.table import DescribedTable
from hil_emulator.model.effects import CATALOGUE

BY_HAND = ("machines", "eds_files", "python", "protocol")
"""Pages of the folder that are not generated, in the order of the index."""

FOLDER = Path(__file__).parent.parent / "docs" / "reference"
COMMAND = "python docs/build_time/write_reference.py"


@pytest.fixture(scope="module")
def written() -> dict[str, str]:
    """Return the pages as the declarations are now."""
    return texts()


def test_the_committed_pages_are_current(written: dict[str, str]) -> None:
    """A reader of the repository finds what the code declares, and no page of former times."""
    committed = {file.name: file.read_text(encoding="utf-8") for file in FOLDER.glob("*")
                 if file.stem not in BY_HAND}  # fmt: skip
    differ = {n for n in written.keys() | committed.keys() if written.get(n) != committed.get(n)}
    assert not differ, f"{', '.join(sorted(differ))}: not current; run: {COMMAND}"


def test_every_row_has_the_cells_of_its_header(written: dict[str, str]) -> None:
    """A bar inside a cell is escaped, so that every viewer shows the same columns."""
    for name, content in written.items():
        for block in re.findall(r"(?:^\|.*\n)+", content, re.M):
            counts = {len(re.split(r"(?<!\\)\|", line)) for line in block.splitlines()}
            assert len(counts) == 1, f"{name}: {block[:200]}"


def test_every_link_leads_to_a_page_and_a_heading(written: dict[str, str]) -> None:
    """Also those from a key to the section of its effect."""
    for name, content in written.items():
        for target in set(re.findall(r"\]\(([^)\s]+)\)", content)):
            page, _, heading = target.partition("#")
            file = FOLDER / (page or name)
            assert file.is_file(), f"{name}: {target}"
            assert not heading or heading in anchors(file), f"{name}: {target}"


def test_every_effect_has_a_section_and_a_row(written: dict[str, str]) -> None:
    """The catalogue is whole on the page of effects and in the tables of the configuration."""
    for effect in CATALOGUE:
        assert f"\n### {effect.name}\n" in written["effects.md"]
        assert f"| [`{effect.name}`](effects.md#{effect.name}) |" in written["configuration.md"]


def test_the_index_links_every_page(written: dict[str, str]) -> None:
    """The index is the way in."""
    assert re.findall(r"\]\((\w+)\.md\)", written["index.md"]) == [*PAGES, *BY_HAND]


class Described(DescribedTable):
    """A table of a file."""

    ratio: float = Field(default=0.5, ge=0.0, le=1.0)
    """part | whole"""


class Undescribed(DescribedTable):
    """A table of a file with a key that nothing describes."""

    ratio: float


def test_a_key_shows_type_default_bounds_and_meaning() -> None:
    """All of it is read from the field."""
    *_, row = keys(Described).splitlines()
    assert row == r"| `ratio` | number | `0.5` | 0.0 ... 1.0 | part \| whole |"


def test_a_key_without_a_meaning_is_refused() -> None:
    """The message names the key and where its meaning is to be written."""
    with pytest.raises(ValueError, match=r"Undescribed\.ratio has no meaning: write a docstring"):
        keys(Undescribed)


class Reading:
    """A reading.

    Attributes:
        value: what the sensor
            reports [bar].
        name: of the sensor.

    """


def test_an_attribute_is_read_from_the_docstring() -> None:
    """Over several lines, and its unit apart from its meaning."""
    declared = meanings(Reading)
    assert declared == {"value": "what the sensor reports [bar]", "name": "of the sensor"}
    assert unit_of(declared["value"]) == ("what the sensor reports", "bar")


def test_text_is_shown_as_it_is() -> None:
    """Products are no emphasis, comparisons no HTML; code stays code."""
    assert text("a*b < $c, `d*e`") == r"a\*b \< \$c, `d*e`"


def test_a_column_without_content_is_left_out() -> None:
    """Tables stay as narrow as their content."""
    assert table(("a", "b", "c"), [(1, "", 3)]) == "| a | c |\n| --- | --- |\n| 1 | 3 |"

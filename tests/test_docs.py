"""The documents point at what is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "hil_emulator"
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if "generated" not in page.parts  # made when the pages are built
]
NAMED = [
    (file.name, path)
    for file in PAGES
    for path in re.findall(r"`([\w./]+(?:\.py|/))`", file.read_text())
]
"""Document, and a file or folder that it names."""


@pytest.mark.parametrize(("document", "path"), NAMED)
def test_a_file_that_a_document_names_is_there(document: str, path: str) -> None:
    """A reader who follows a walk finds each file, from the package or from the checkout."""
    somewhere = [ROOT, PACKAGE, *(p for p in (PACKAGE / "identify").iterdir() if p.is_dir())]
    assert any((folder / path).exists() for folder in [*somewhere, PACKAGE / "identify"])


LINKS = [
    (file, target)
    for file in PAGES
    for target in re.findall(r'(?:\]\(|src=")([^)"\s]+)', file.read_text())
]
"""Page, and where a link or picture of it leads."""


def anchors(file: Path) -> set[str]:
    """Return the names of a page's headings in addresses."""
    headings = re.findall(r"^#+ (.*)$", file.read_text(), re.M)
    return {re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in headings}


@pytest.mark.parametrize(("file", "target"), LINKS, ids=lambda x: getattr(x, "name", x))
def test_a_link_leads_somewhere(file: Path, target: str) -> None:
    """The target is a file or heading of the repository, or an https address (not opened)."""
    if ":" in target:
        assert re.fullmatch(r"https://[\w.-]+\.[a-z]+(/\S*)?", target)
        return
    name, _, heading = target.partition("#")
    place = file.parent / name if name else file
    if "generated" not in place.parts:  # made when the pages are built
        assert place.is_file()
        assert not heading or heading in anchors(place)

"""The pages are whole before anyone builds them; building itself is a step of `.ci/run`."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"
FILES = [p for p in DOCS.rglob("*.md") if "generated" not in p.parts]
PAGES = sorted({str(p.relative_to(DOCS).with_suffix("")) for p in FILES} - {"index"})
TREE = {
    str((page.parent / entry).relative_to(DOCS))
    for page in FILES
    for entry in re.findall(r"^[\w/]+$", page.read_text(), re.M)
}
"""Pages that a table of contents names."""


@pytest.mark.parametrize("page", PAGES)
def test_every_page_is_reached_from_the_first(page: str) -> None:
    """Every page is in a table of contents."""
    assert page in TREE


@pytest.mark.parametrize("page", PAGES)
def test_the_python_of_a_page_is_python(page: str) -> None:
    """What is run when the pages are built, and what is only shown, compiles."""
    text = (DOCS / f"{page}.md").read_text()
    for block in re.findall(r"^```(?:\{run\}|python)\n(.*?)^```$", text, re.M | re.S):
        code = re.sub(r"\A(:\w+: .*\n)+", "", block)
        compile(code, f"{page}.md", "exec")

"""The documents point at what is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "hil_emulator"
NAMED = [
    (file.name, path)
    for file in sorted((ROOT / "docs").glob("*.md"))
    for path in re.findall(r"`([\w./]+(?:\.py|/))`", file.read_text())
]
"""Document, and a file or folder that it names."""


@pytest.mark.parametrize(("document", "path"), NAMED)
def test_a_file_that_a_document_names_is_there(document: str, path: str) -> None:
    """A reader who follows a walk finds each file, from the package or from the checkout."""
    somewhere = [ROOT, PACKAGE, *(p for p in (PACKAGE / "identify").iterdir() if p.is_dir())]
    assert any((folder / path).exists() for folder in [*somewhere, PACKAGE / "identify"])

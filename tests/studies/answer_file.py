"""Answers in a file: a JSON object a line; of a finished study compressed, as `.jsonl.xz`."""

import json
import lzma
from pathlib import Path
from typing import Any

KEPT = Path(__file__).with_name("kept")
"""Folder of the answers of finished studies."""


def rows(file: Path) -> list[dict[str, Any]]:
    """Return the rows of a file; an empty list if there is no file."""
    if not file.exists():
        return []
    data = file.read_bytes()
    text = lzma.decompress(data) if file.suffix == ".xz" else data
    return [json.loads(line) for line in text.splitlines()]


def append(file: Path, row: dict[str, Any]) -> None:
    """Append a row to a file in plain text."""
    with file.open("a") as stream:
        stream.write(json.dumps(row) + "\n")

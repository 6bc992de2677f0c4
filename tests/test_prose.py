"""Plain words: counts of the words that the style bans, and lengths of sentences on the pages.

`prose_bounds.json` holds the largest count per folder. Bounds only fall:
`python tests/test_prose.py` lowers them to the present counts.
"""

import ast
import json
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
BOUNDS = Path(__file__).with_name("prose_bounds.json")

BANNED_WORDS = re.compile(
    r"\b(tells?|told|telling|says?|said|none|beside|befalls?|bears|whoever|nobody|asked again)\b"
)
"""Words of prose.md's list; lower case, so that Python's `None` is not counted."""

BANNED_NAMES = {"found", "own", "known", "seen", "said", "told"}
"""Names of variables and arguments that do not name a thing."""

AVERAGE, LONGEST = 20, 40
"""Words per sentence of a page: the average, and the longest sentence."""

MADE = {"generated", "_build"}
"""Folders of files that a build of the pages makes."""

PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if not MADE & set(page.parts)
]


def folder_of(file: Path) -> str:
    """Return the folder that a file counts for: two levels in `identify`, else one."""
    parts = file.relative_to(ROOT).parts
    if parts[0] not in {"hil_emulator", "tests"}:
        return "docs"
    depth = 3 if parts[:2] == ("hil_emulator", "identify") else 2
    return "/".join(parts[: min(depth, len(parts) - 1)])


def assigned(file: Path) -> list[str]:
    """Return every name that a Python file assigns, and its arguments."""
    nodes = list(ast.walk(ast.parse(file.read_text())))
    stored = [n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    return stored + [n.arg for n in nodes if isinstance(n, ast.arg)]


def counts() -> dict[str, int]:
    """Return the number of banned words and names per folder."""
    total: Counter[str] = Counter()
    sources = [f for top in ("hil_emulator", "tests", "docs") for f in (ROOT / top).rglob("*.py")]
    for file in [*sources, *PAGES]:
        text = file.read_text()
        total[folder_of(file)] += len(BANNED_WORDS.findall(text)) * (file != Path(__file__))
        if file.suffix == ".py":
            total[folder_of(file)] += sum(name in BANNED_NAMES for name in assigned(file))
    return dict(sorted(total.items()))


def sentences(page: Path) -> list[int]:
    """Return the number of words of each sentence, without code, tables and headings."""
    text = re.sub(r"^(```|:::).*?^\1$|<!--.*?-->", "", page.read_text(), flags=re.M | re.S)
    text = re.sub(r"^(#|\||\s*:|!\[).*$", "\n", text, flags=re.M)
    text = re.sub(r"`[^`]+`", "code", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    text = re.sub(r"^\s*([-*]|\d+\.) ", "\n\n", text, flags=re.M)
    parts = re.split(r"\n\s*\n|(?<=[.?!])[)*\"]*\s+(?=\S)", text)
    return [n for part in parts if (n := len(re.findall(r"\w[\w'.,°%/-]*", part)))]


def test_banned_words_become_fewer() -> None:
    """A folder has at most as many words and names without a plain meaning as before."""
    bounds = json.loads(BOUNDS.read_text())
    more = {f: n for f, n in counts().items() if n > bounds.get(f, 0)}
    assert not more, f"more banned words than in {BOUNDS.name}: {more}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_sentences_of_a_page_are_short(page: Path) -> None:
    """Twenty words on average, and none over forty."""
    lengths = sentences(page)
    assert max(lengths, default=0) <= LONGEST
    assert sum(lengths) <= AVERAGE * len(lengths)


def lower_the_bounds() -> None:
    """Write the present counts where these are lower; a new folder starts at zero."""
    bounds = json.loads(BOUNDS.read_text())
    present = {f: min(n, bounds.get(f, 0)) for f, n in counts().items()}
    BOUNDS.write_text(json.dumps(present, indent=1) + "\n")


if __name__ == "__main__":
    lower_the_bounds()

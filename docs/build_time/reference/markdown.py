"""Markdown that plain viewers and MyST show alike."""

import re
from collections.abc import Iterable, Sequence

from hil_emulator.commands.effects import amount
from hil_emulator.model.declare import Param
from hil_emulator.model.sensors import Channel

_CODE = re.compile(r"(`[^`]*`)")
_SPECIAL = re.compile(r"([*<>$\\])")


def text(words: str) -> str:
    """Return words with the characters escaped that Markdown would interpret; code is kept."""
    parts = _CODE.split(" ".join(words.split()))
    return "".join(p if p.startswith("`") else _SPECIAL.sub(r"\\\1", p) for p in parts)


def sentence(words: str) -> str:
    """Return words as a sentence: capital letter, full stop."""
    if not words:
        return ""
    return text(words[:1].upper() + words[1:].rstrip(".")) + "."


def code(words: object) -> str:
    """Return words as code; nothing for nothing."""
    return f"`{words}`" if str(words) else ""


def shown(value: float, param: Param | Channel) -> str:
    """Return a value of a parameter with its unit."""
    return text(amount(value, param))


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; columns without any content are left out."""
    cells = [[" ".join(str(c).split()).replace("|", "\\|") for c in row] for row in rows]
    used = [i for i in range(len(header)) if any(row[i] for row in cells)]
    lines = [[row[i] for i in used] for row in [list(header), ["---"] * len(header), *cells]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page(title: str, *parts: str) -> str:
    """Return a page; empty parts are left out."""
    return "\n\n".join([f"# {title}", *(part for part in parts if part)]) + "\n"

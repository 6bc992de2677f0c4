"""Fill in a template: everything in one file, every text escaped."""

import base64
import re
from dataclasses import dataclass
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

_NUMBER = re.compile(r"[+±-]?\d")


@dataclass(frozen=True)
class Table:
    """A table of the macro `table`; numbers stand to the right.

    Attributes:
        head: titles of the columns.
        rows: the cells: numbers and text.
        groups: titles over several columns each, with how many.

    """

    head: tuple[str, ...]
    rows: list[tuple[object, ...]]
    groups: tuple[tuple[str, int], ...] = ()


def render(template: str, **values: object) -> str:
    """Return a page.

    Args:
        template: its file in `templates`, such as "scenario.html".
        values: what the template asks for; it may leave nothing open.

    Raises:
        jinja2.UndefinedError: if it asks for something else.

    """
    return _environment().get_template(template).render(values)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("hil_emulator.pages"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters |= {"code": _code, "data_url": _data_url, "shown": _shown}
    environment.tests["numeric"] = _numeric
    return environment


def _data_url(png: bytes) -> str:
    """Return a picture as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _code(text: str) -> Markup:
    """Return text in which each part between backquotes is code."""
    parts = [escape(part) for part in text.split("`")]
    marked = (Markup(f"<code>{part}</code>") if i % 2 else part for i, part in enumerate(parts))
    return Markup("").join(marked)


def _shown(cell: object) -> str:
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _numeric(cell: object) -> bool:
    return _NUMBER.match(_shown(cell)) is not None

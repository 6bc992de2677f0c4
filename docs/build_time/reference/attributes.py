"""Attributes of dataclasses, as the section `Attributes:` of their docstrings describes them."""

import inspect
import re
from typing import Any

_ENTRY = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.M)
_UNIT = re.compile(r" \[([^\]]+)\]")


def meanings(cls: type[Any]) -> dict[str, str]:
    """Return the meaning of each attribute that the docstring describes."""
    _, _, section = (inspect.getdoc(cls) or "").partition("Attributes:\n")
    return {name: " ".join(words.split()).rstrip(".") for name, words in _ENTRY.findall(section)}


def unit_of(meaning: str) -> tuple[str, str]:
    """Return a meaning without its unit in brackets, and that unit."""
    match = _UNIT.search(meaning)
    return (_UNIT.sub("", meaning, 1), match[1]) if match else (meaning, "")

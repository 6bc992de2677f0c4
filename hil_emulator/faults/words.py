"""A fault in words; imports no other module of the package."""

from collections.abc import Mapping
from typing import Any


def fault_words(target: str, kind: str, arguments: Mapping[str, Any]) -> str:
    """Return target, kind and options as the user gave them."""
    return f"{target} {kind}" + "".join(f", {key} {value}" for key, value in arguments.items())

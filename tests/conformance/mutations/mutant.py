"""What a mutant is: our own node, with one sentence of the standard broken.

A mutant replaces functions, properties or constants of the device. It is a function itself: the
first argument is what it replaces, its docstring the sentence that no longer holds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from hil_emulator.device.rpdo import Rpdo

Call = Callable[..., Any]


@dataclass(frozen=True)
class Mutant:
    """One mutant.

    Attributes:
        name: unique.
        sentence: of the standard, and what the mutant does instead.
        places: owner and name of all that is replaced.
        change: called in place of it.

    """

    name: str
    sentence: str
    places: tuple[tuple[Any, str], ...]
    change: Call

    def apply(self, patch: pytest.MonkeyPatch) -> None:
        """Break the device until the patch is undone."""
        patch.setattr(Rpdo, "handler", lambda rpdo, obey, otherwise: otherwise)  # no short cut
        for owner, name in self.places:
            patch.setattr(owner, name, _replaced(owner.__dict__[name], self.change))


MUTANTS: dict[str, Mutant] = {}
"""All of them by name, in the order of the services."""


def mutant(*places: tuple[Any, str]) -> Callable[[Call], Call]:
    """Make a mutant of a function, which replaces what is at these places."""

    def declare(change: Call) -> Call:
        name = change.__name__
        assert name not in MUTANTS, name
        MUTANTS[name] = Mutant(name, str(change.__doc__), places, change)
        return change

    return declare


def _replaced(original: Any, change: Call) -> Any:
    if isinstance(original, property):
        return property(lambda self: change(original.fget, self))
    if callable(original):
        return lambda *args, **given: change(original, *args, **given)
    return change(original)

"""A mutant: the emulated node with a violation of one sentence of the standard.

A mutant replaces functions, properties or constants of the device. It is a function: its first
argument is the replaced object, its docstring the violated sentence.
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
        sentence: sentence of the standard, and the behaviour of the mutant.
        places: owner and name of all replaced objects.
        change: called in their place.

    """

    name: str
    sentence: str
    places: tuple[tuple[Any, str], ...]
    change: Call

    def apply(self, patch: pytest.MonkeyPatch) -> None:
        """Apply the mutation until the patch is undone."""
        patch.setattr(Rpdo, "handler", lambda rpdo, obey, otherwise: otherwise)  # no short cut
        for owner, name in self.places:
            patch.setattr(owner, name, _replaced(owner.__dict__[name], self.change))


MUTANTS: dict[str, Mutant] = {}
"""All mutants by name, in the order of the services."""


def mutant(*places: tuple[Any, str]) -> Callable[[Call], Call]:
    """Declare a function as a mutant that replaces the objects at these places."""

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

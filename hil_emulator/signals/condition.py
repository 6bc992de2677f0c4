"""Conditions such as "position > 60 mm and load_force < 100 N", for faults and scenarios."""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.signals.columns import columns
from hil_emulator.units import to_si

LONGEST = 500
"""Characters of a condition, which is looked at in every tick (assumed)."""

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
_TERM = re.compile(r"\s*([A-Za-z_][\w.]*)\s*(>=|<=|>|<)\s*([^<>=]+?)\s*$")


@dataclass(frozen=True)
class Condition:
    """Comparisons of signals with constants, all of which must hold.

    Attributes:
        text: as the user wrote it.
        terms: name, comparison, and value in SI of each.

    """

    text: str
    terms: tuple[tuple[str, str, float], ...]

    def holds(self, value: Callable[[str], float]) -> bool:
        """Tell whether it holds, where `value` returns a signal's present value in SI."""
        return all(_COMPARE[sign](value(name), bound) for name, sign, bound in self.terms)


def unit_of(name: str) -> str:
    """Return the SI unit of a signal.

    Raises:
        UserError: for an unknown signal; the message proposes others.

    """
    units = columns()
    if name not in units:
        raise UserError(f"no signal '{brief(name)}'{did_you_mean(name, units)}")
    return units[name]


def parse(text: str) -> Condition:
    """Read a condition: `SIGNAL > VALUE`, several joined by `and`.

    Raises:
        UserError: for a part that cannot be read, with the reason.

    """
    if len(text) > LONGEST:
        raise UserError(f'condition "{brief(text)}": longer than {LONGEST} characters')
    terms = []
    for part in text.split(" and "):
        match = _TERM.match(part)
        if match is None:
            raise UserError(
                f'condition "{text}": "{part.strip()}" is not a comparison; write it as '
                '"position > 60 mm", several joined by "and"'
            )
        name, sign, bound = match.groups()
        try:
            terms.append((name, sign, _number(bound, unit_of(name))))
        except (UserError, ValueError) as error:
            raise UserError(f'condition "{text}": {error}') from None
    return Condition(text, tuple(terms))


def _number(text: str, unit: str) -> float:
    """Return a quantity in SI; zero needs no unit."""
    return 0.0 if text == "0" else to_si(text, unit)

"""Statements of the user about a log: names, units, scale of the set point."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats.table import LogColumn
from hil_emulator.units import factor

SHARE = "%"
"""Unit of a set point that is a share of the rated current."""


@dataclass(frozen=True)
class Stated:
    """Statements of the user about a log.

    Attributes:
        names: channel by the name of its column, where they differ.
        units: unit by the name of a column, where the log has no unit or a wrong one.
        rated_current: current at 100 % or full scale of the set point [A].
        full_scale: set point at the rated current [V].

    """

    names: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    rated_current: float | None = None
    full_scale: float | None = None

    def current(self, column: LogColumn) -> LogColumn:
        """Return a set point in A, converted from a share of the rated current or a voltage.

        Raises:
            UserError: if the rated current or the full scale is not stated.

        """
        unit = column.unit or ""
        if unit != SHARE and not _is_voltage(unit):
            return column
        if self.rated_current is None:
            raise UserError(
                f"the set point is in {unit}, a share of the rated current, which nothing states; "
                'give --rated-current "10 mA"'
            )
        full = 100.0
        if unit != SHARE:
            if self.full_scale is None:
                raise UserError(
                    f"the set point is in {unit}, and nothing states at how much of it the rated "
                    'current flows; give --full-scale "10 V"'
                )
            full = self.full_scale / factor("V", unit)
        return replace(column, unit="A", values=column.values * self.rated_current / full)


NOTHING_STATED = Stated()


def _is_voltage(unit: str) -> bool:
    try:
        factor("V", unit)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        return False
    return bool(unit)

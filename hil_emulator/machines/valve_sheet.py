"""Data sheets of valves, and the library of such sheets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from hil_emulator.config import tables
from hil_emulator.config.table import QuantityReader
from hil_emulator.config.toml_file import read_toml
from hil_emulator.errors import UserError
from hil_emulator.model.declare import Param

LIBRARY = Path(__file__).with_name("valves.toml")

PRINTED = {param.name: param for param in (
    tables.NOMINAL_FLOW,
    tables.DROP_PER_EDGE,
    tables.DROP_TOTAL,
    tables.RATED_CURRENT,
    Param("phase_90", "Hz", "frequency of -90° at a small amplitude", 100.0, 1.0, 1000.0),
    Param("amplitude_3db", "Hz", "frequency of -3 dB at a small amplitude", 100.0, 1.0, 1000.0),
    Param("step_time", "s", "time of a step from 0 to 100 %", 0.01, 1e-3, 1.0, "ms"),
    Param("overlap", "1", "travel before an edge opens, of the rated current", 0.0, 0.0, 0.6, "%"),
    Param("port_b_flow", "1", "flow of the edges at port b over the nominal flow, 50 % of a spool "
          "of 2:1", 1.0, 0.1, 3.0, "%"),
    Param("hysteresis", "1", "of the rated current", 0.03, 0.0, 0.1, "%"),
    Param("threshold", "1", "or response sensitivity, of the rated current", 5e-3, 0.0, 0.05, "%"),
    Param("null_leakage", "m^3/s", "from p to t at null, pilot stage included", 1e-3 / 60.0,
          0.0, 1e-2, "l/min"),
    Param("pilot_leakage", "m^3/s", "of the pilot stage alone", 5e-4 / 60.0, 0.0, 1e-2, "l/min"),
    Param("leakage_pressure", "Pa", "at which the leakages are printed", 210e5, 1e5, 400e5, "bar",
          difference=True),
    Param("compensator", "Pa", "pressure difference that its compensator keeps over the edge from "
          "the supply", 7e5, 1e5, 50e5, "bar", difference=True),
    Param("max_pressure", "Pa", "largest supply pressure", 315e5, 1e5, 700e5, "bar"),
)}  # fmt: skip
"""Declarations of the numbers of a data sheet, by key."""

ORIGINS = {
    "printed": "data sheet",
    "memory": "from memory of the sheet, check against yours",
    "assumed": "assumed",
}
"""Origin of a number, by table of the library."""

GIVEN = "as you gave it"
"""Origin of a user's answer."""

UNSTATED = "assumed: a usual value, not stated"
"""Origin of a number of the user's valve without an answer."""


@dataclass(frozen=True)
class ValveSheet:
    """The data of a valve.

    Attributes:
        title: name of the valve.
        sheet: the data sheet, with its edition.
        values: numbers by key of `PRINTED`, SI.
        origins: origin of each number.

    """

    title: str
    sheet: str
    values: Mapping[str, float]
    origins: Mapping[str, str]

    def get(self, name: str, otherwise: float = 0.0) -> float:
        """Return a number, `otherwise` if the sheet lacks it."""
        return self.values.get(name, otherwise)

    def changed(self, name: str, value: float, origin: str) -> "ValveSheet":
        """Return the sheet with another number.

        Args:
            name: key of the number.
            value: SI.
            origin: its origin.

        """
        drops = {"pressure_drop_total", "pressure_drop_per_edge"}
        displaced = drops if name in drops else {name}
        kept = {key: v for key, v in self.values.items() if key not in displaced}
        origins = {**self.origins, name: origin}
        return ValveSheet(self.title, self.sheet, {**kept, name: value}, origins)

    @property
    def drop(self) -> str:
        """The key of the pressure drop at which the nominal flow is printed."""
        total = "pressure_drop_total"
        return total if total in self.values else "pressure_drop_per_edge"

    def flow(self, drop: float) -> float:
        """Return the flow at rated current and a pressure drop over each edge [m³/s, Pa].

        By the square-root law of an orifice through the nominal flow; the drop over the whole valve
        is that of two edges (S1 eq. 3.7).
        """
        edge = self.values[self.drop] / (2.0 if self.drop == "pressure_drop_total" else 1.0)
        return self.values["nominal_flow"] * math.sqrt(drop / edge)

    @property
    def full_opening(self) -> float:
        """Opening of an edge at the rated current less the overlap [A]."""
        return self.values["rated_current"] * (1.0 - self.get("overlap"))

    @property
    def natural_frequency(self) -> tuple[float, str]:
        """Natural frequency of the spool [Hz], and the reason.

        At this frequency the phase of a second-order system is -90° for any damping; at a damping
        ratio of 0.7 its amplitude is -3 dB.
        """
        for name, word in (("phase_90", "-90°"), ("amplitude_3db", "-3 dB")):
            if name in self.values:
                return self.values[name], f"frequency of {word}: {self.origins[name]}"
        raise UserError(f"{self.title}: give phase_90 or amplitude_3db, its bandwidth")

    @property
    def damping_ratio(self) -> tuple[float, str]:
        """Damping ratio of the spool, and the reason.

        With r the ratio of the frequencies of -3 dB and -90°, |G(r)|² = 1/2 gives
        1 - 2 z² = (r² - 1/r²)/2.
        """
        both = self.values.get("amplitude_3db"), self.values.get("phase_90")
        if both[0] is None or both[1] is None:
            return 0.7, "puts -3 dB at the natural frequency (assumed)"
        ratio = (both[0] / both[1]) ** 2
        squared = 0.5 * (1.0 - 0.5 * (ratio - 1.0 / ratio))
        return min(1.5, max(0.3, math.sqrt(max(0.0, squared)))), "from -3 dB and -90° together"


@cache
def library() -> Mapping[str, ValveSheet]:
    """Return every valve of the library by name.

    Raises:
        UserError: a number of a valve is not a quantity, or is stated twice.

    """
    return {name: _sheet(name, table) for name, table in read_toml(LIBRARY, "library").items()}


def _sheet(name: str, content: Mapping[str, object]) -> ValveSheet:
    values: dict[str, float] = {}
    origins: dict[str, str] = {}
    for table, origin in ORIGINS.items():
        numbers = content.get(table, {})
        for key, text in numbers.items() if isinstance(numbers, dict) else ():
            if key in values or key not in PRINTED:
                raise UserError(f"{LIBRARY.name}: {name}.{table}.{key}: unknown, or stated twice")
            try:
                values[key] = QuantityReader(PRINTED[key])(text)
            except ValueError as error:
                raise UserError(f"{LIBRARY.name}: {name}.{table}.{key}: {error}") from None
            origins[key] = origin
    return ValveSheet(str(content["title"]), str(content["sheet"]), values, origins)

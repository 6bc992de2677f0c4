"""The kind of bench that a configuration describes, and its parts of the actuator.

[bench]
kind = "force balance"
pressure_b = "absent"       # no such chamber; "3 bar" is a chamber without a channel
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

from pydantic import model_validator

from hil_emulator.config.table import DescribedTable, QuantityReader
from hil_emulator.model.declare import Param
from hil_emulator.model.quantities import PARAMS
from hil_emulator.units import show

ABSENT = "absent"

CHAMBER_PRESSURE = Param(
    "pressure", "Pa", "constant pressure of a chamber that no channel measures; absent: no such "
    "chamber", 3e5, 0.0, 1000e5, "bar",
)  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A kind of bench.

    Attributes:
        name: in the configuration.
        describes: description in words.
        needs: required keys, by table.
        options: keys of `[bench]` for this kind.

    """

    name: str
    describes: str
    needs: Mapping[str, frozenset[str]] = field(hash=False)
    options: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether it is the whole actuator; only that can be simulated."""
        return self.needs is EVERYTHING

    def asks(self, table: str, key: str) -> bool:
        """Whether a key has to be given."""
        return key in self.needs.get(table, ())


EVERYTHING = {
    table: frozenset(p.name for p in params if p.default is None)
    for table, params in PARAMS.items()
}  # fmt: skip
"""Required keys of a whole actuator: all without a usual value."""

KINDS = {kind.name: kind for kind in (
    Kind("actuator", "the whole actuator: valve, cylinder, oil and load", EVERYTHING),
    Kind(
        "force balance", "a force balance: pressures, position and load force, without a valve",
        {"cylinder": frozenset({"piston_area", "area_ratio"})}, ("pressure_a", "pressure_b"),
    ),
    Kind(
        "closed loop",
        "a closed loop: the whole actuator, whose current a position controller commands",
        EVERYTHING, ("proportional_gain",),
    ),
    Kind(
        "driven axis", "a driven axis: position and the force of its drive, without any pressure",
        {"load": frozenset({"mass"})},
    ),
    Kind(
        "valve flow", "a valve flow bench: current, pressures at the ports and the flow through a",
        {"supply": frozenset({"pressure"}), "valve": frozenset({"gain", "natural_frequency"})},
    ),
    Kind(
        "quasi-static sweep",
        "a quasi-static sweep: a valve so slowly driven that every row is an equilibrium",
        {"supply": frozenset({"pressure"}), "valve": frozenset({"gain"})},
    ),
    Kind(
        "valve leakage",
        "a valve leakage bench: ports blocked, flows in supply, return and leakage line",
        {"supply": frozenset({"pressure"}), "valve": frozenset({"gain"})},
    ),
)}  # fmt: skip
"""Every kind of bench by its name."""

FREE = "free"

PROPORTIONAL_GAIN = Param(
    "proportional_gain", "A/m", "gain of the position controller, current per deviation; free: "
    "identification estimates it", 0.5, 1e-4, 1e4,
)  # fmt: skip

Chamber = Annotated[float | None, QuantityReader(CHAMBER_PRESSURE, {ABSENT: math.nan})]
Gain = Annotated[float | None, QuantityReader(PROPORTIONAL_GAIN, {FREE: math.nan})]


class BenchTable(DescribedTable):
    """The kind of bench, and data that the tables of the actuator do not hold."""

    kind: Literal[tuple(KINDS)] = "actuator"  # type: ignore[valid-type]
    """which parts of an actuator stand on the bench"""
    pressure_a: Chamber = None
    pressure_b: Chamber = None
    proportional_gain: Gain = None

    @model_validator(mode="after")
    def _of_its_kind(self) -> "BenchTable":
        for key in self.model_fields_set - {"kind"}:
            if key not in KINDS[self.kind].options:
                means = [kind.name for kind in KINDS.values() if key in kind.options]
                raise ValueError(
                    f'{key} does not apply to kind = "{self.kind}"; it belongs to '
                    f"{' and '.join(means)}"
                )
        if self.kind == "closed loop" and self.proportional_gain is None:
            raise ValueError(
                'kind = "closed loop" needs proportional_gain = "0.5 A/m" (current per deviation '
                f'of the position), or "{FREE}" if it is unknown'
            )
        return self


@dataclass(frozen=True)
class BenchSettings:
    """The bench of a checked configuration.

    Attributes:
        kind: its name in `KINDS`.
        chambers: constant pressure of chambers without a channel, by channel [Pa]; NaN for a
            chamber that does not exist.
        proportional_gain: of a closed loop [A/m]; NaN if it is to be estimated.

    """

    kind: str = "actuator"
    chambers: Mapping[str, float] = field(default_factory=dict)
    proportional_gain: float = math.nan

    @property
    def whole(self) -> bool:
        """Whether it is the whole actuator; only that can be simulated."""
        return KINDS[self.kind].whole

    def __str__(self) -> str:
        """Return the description of a configuration in words."""
        parts = [KINDS[self.kind].describes]
        for name, pressure in self.chambers.items():
            side = name.replace("pressure", "chamber").replace("_", " ")
            constant = f"at a constant {show(pressure, 'Pa', 'bar')}"
            parts.append(f"{side} {'absent' if math.isnan(pressure) else constant}")
        if self.kind == "closed loop":
            gain = self.proportional_gain
            parts.append(f"gain {FREE if math.isnan(gain) else show(gain, 'A/m')}")
        return "; ".join(parts)


def described(table: BenchTable) -> BenchSettings:
    """Return the bench that a checked table describes."""
    chambers = {"pressure_a": table.pressure_a, "pressure_b": table.pressure_b}
    constant_pressures = {
        name: pressure for name, pressure in chambers.items() if pressure is not None
    }
    gain = math.nan if table.proportional_gain is None else table.proportional_gain
    return BenchSettings(table.kind, constant_pressures, gain)


def kind_of(merged: Mapping[str, Any]) -> Kind:
    """Return the kind of bench of an unchecked configuration, which may be wrong."""
    table = merged.get("bench")
    content = table if isinstance(table, dict) else {}
    kind = KINDS.get(str(content.get("kind", "actuator")), Kind("", "", {}))
    if content.get("pressure_b") == ABSENT and "pressure_b" in kind.options:
        # without an annulus there is no ratio of its area
        return replace(kind, needs={"cylinder": frozenset({"piston_area"})})
    return kind

"""Gauge pressures in configurations: differences of two pressures have no reference."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from hil_emulator.config import tables
from hil_emulator.config.bench import CHAMBER_PRESSURE
from hil_emulator.config.load import load
from hil_emulator.config.table import QuantityReader
from hil_emulator.machines.questions import PRECHARGE
from hil_emulator.machines.valve_sheet import PRINTED
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.platform.paths import shipped
from hil_emulator.units import ATMOSPHERE

ABSOLUTE = {
    "supply.pressure", "tank.pressure", "accumulator.precharge", "cavitation_floor.pressure_floor",
    "cavitation_floor.vapour_pressure",
    "null_shift.rated_pressure", "pilot_supply.rated_pressure", "init.precharge",
    "oil.bulk_modulus", "pump_leakage.widening_pressure", "sheet.max_pressure", "bench.pressure",
}  # fmt: skip
"""Pressures at a place, and two numbers that are not written as gauge pressures."""


def pressures() -> Iterator[tuple[str, Param]]:
    """Yield every number in pascals that a configuration, a data sheet or `init` takes."""
    groups = dict(PARAMS) | {effect.name: effect.params for effect in CATALOGUE}
    groups |= {"sheet": tuple(PRINTED.values()), "init": (PRECHARGE,), "bench": (CHAMBER_PRESSURE,)}
    groups["drop"] = (tables.DROP_PER_EDGE, tables.DROP_TOTAL)
    for group, params in groups.items():
        yield from ((f"{group}.{p.name}", p) for p in params if p.unit == "Pa")


@pytest.mark.parametrize(("name", "param"), list(pressures()))
def test_only_a_pressure_at_a_place_counts_from_the_atmosphere(name: str, param: Param) -> None:
    """The same number of bar and bar(g) differ by 1 atm, or are equal if it is a difference."""
    read = QuantityReader(replace(param, low=-math.inf, high=math.inf))
    above = read("50 bar(g)") - read("50 bar")
    assert above == pytest.approx(ATMOSPHERE if name in ABSOLUTE else 0.0, abs=1e-6)


@pytest.mark.parametrize("effect", ["offset", "noise", "resolution", "hum"])
def test_errors_of_a_pressure_sensor_are_differences(effect: str, tmp_path: Path) -> None:
    """An offset of 0.5 bar(g) adds half a bar to the reading."""
    layer = tmp_path / "layer.toml"
    layer.write_text(f'[sensors.pressure_a]\n{effect} = "0.5 barg"\n')
    sensor = load([shipped("configs/hyq_knee.toml"), layer]).sensors["pressure_a"]
    (value,) = (v for k, v in sensor.items() if k.startswith(f"{effect}_") and v == 0.5e5)
    assert value == 0.5e5

"""The library of valves: what their sheets print is what the model does."""

import math
from collections.abc import Mapping
from pathlib import Path

import pytest

from hil_emulator.config.load import load
from hil_emulator.machines.questions import QUESTIONS, Answers, Inquiry, answered, valve
from hil_emulator.machines.valve_sheet import LIBRARY, ORIGINS, PRINTED, ValveSheet, library
from hil_emulator.machines.writing import configuration
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Plant
from hil_emulator.platform.paths import shipped

VALVES = library()


def usual(question: Inquiry, answers: Answers) -> float | str:
    """Give the usual answer."""
    return question.usual(answers)


def plant_values(folder: Path, given: Mapping[str, str]) -> Mapping[str, float]:
    """Return the parameters of the usual machine with some answers."""
    file = folder / "machine.toml"
    file.write_text(configuration(answered(given, usual), "machine.eds", "schema.json", 20e-6))
    return load([file]).plant


def open_fully(plant: Plant, drop: float) -> None:
    """Put rated current on the spool and a pressure drop [Pa] over each of both open edges."""
    par = plant.parameters
    plant.set_pressures(par.supply_pressure - drop, par.tank_pressure + drop)
    plant.state.spool_position = par.current_saturation_limit
    plant.step(0)


@pytest.mark.parametrize("name", VALVES)
def test_the_printed_flow_passes_at_the_printed_drop(
    name: str, model: Kernel, tmp_path: Path
) -> None:
    """Both edges pass the nominal flow at rated current; twice of it at four times the drop."""
    sheet = VALVES[name]
    given = {"valve": name, "supply_pressure": "200 bar"}
    exact = {"land_leakage_clearance": 0.0, "hysteresis_width": 0.0, "valve_laminar_width": 1e3,
             "pressure_compensator_setting": math.inf}  # fmt: skip
    plant = Plant(model, {**plant_values(tmp_path, given), **exact}, 1e-6)
    edge = sheet.values[sheet.drop] / (2.0 if sheet.drop.endswith("total") else 1.0)
    for factor in (1.0, 2.0):
        open_fully(plant, edge * factor**2)
        for signal in ("flow_a", "flow_b"):
            flow = plant.signals[signal]
            assert flow == pytest.approx(factor * sheet.values["nominal_flow"], rel=1e-3)


@pytest.mark.parametrize("name", [n for n, v in VALVES.items() if v.get("compensator")])
def test_a_compensated_valve_passes_its_flow_at_every_load(
    name: str, model: Kernel, tmp_path: Path
) -> None:
    """The nominal flow enters the chamber at any pressure there, while the setting is left."""
    sheet = VALVES[name]
    values = plant_values(tmp_path, {"valve": name, "supply_pressure": "200 bar"})
    exact = {"land_leakage_clearance": 0.0, "hysteresis_width": 0.0, "valve_laminar_width": 1e3}
    plant = Plant(model, {**values, **exact}, 1e-6)
    kept = sheet.values["compensator"]
    for drop in (kept, 5.0 * kept, 20.0 * kept):
        open_fully(plant, drop)
        nominal = sheet.flow(kept)
        assert plant.signals.flow_a == pytest.approx(nominal, rel=1e-3)
        # the other edge has no compensator
        assert plant.signals.flow_b == pytest.approx(nominal * math.sqrt(drop / kept), rel=1e-3)
    open_fully(plant, 0.25 * kept)
    assert plant.signals.flow_a == pytest.approx(0.5 * nominal, rel=1e-3)


@pytest.mark.parametrize("name", [n for n, v in VALVES.items() if v.get("null_leakage")])
def test_the_printed_leakage_passes_at_null(name: str, model: Kernel, tmp_path: Path) -> None:
    """At the printed pressure, both ports at half of it, what enters s leaves at t as printed."""
    sheet = VALVES[name]
    values = plant_values(tmp_path, {"valve": name, "supply_pressure": "100 bar"})
    tank, pressure = values["tank_pressure"], sheet.values["leakage_pressure"]
    exact = {"supply_pressure": tank + pressure, "valve_laminar_width": 1e3,
             "pressure_compensator_setting": math.inf}  # fmt: skip
    plant = Plant(model, {**values, **exact, "hysteresis_width": 0.0}, 1e-6)
    plant.set_pressures(tank + pressure / 2, tank + pressure / 2)
    # the clearance is written in three digits, and what creeps grows as its square
    assert plant.signals.supply_flow == pytest.approx(sheet.values["null_leakage"], rel=1.5e-2)


@pytest.mark.parametrize(("name", "sheet"), VALVES.items())
def test_every_number_has_an_origin_and_the_valve_is_whole(name: str, sheet: ValveSheet) -> None:
    """A sheet, its edition, and of each number where it comes from."""
    assert sheet.title, name
    assert sheet.sheet
    assert sheet.origins.keys() == sheet.values.keys()
    assert set(sheet.origins.values()) <= set(ORIGINS.values())
    needed = {"nominal_flow", sheet.drop, "rated_current", "step_time", "max_pressure"}
    assert needed <= sheet.values.keys()
    assert "phase_90" in sheet.values or "amplitude_3db" in sheet.values


@pytest.mark.parametrize("z", [0.4, 0.7071, 1.0])
def test_both_printed_frequencies_give_back_a_second_order(z: float) -> None:
    """-90° is the natural frequency; -3 dB and it together are the damping ratio."""
    ratio = math.sqrt(1 - 2 * z**2 + math.sqrt((1 - 2 * z**2) ** 2 + 1))
    sheet = ValveSheet("", "", {"phase_90": 80.0, "amplitude_3db": 80.0 * ratio},
                       {"phase_90": "", "amplitude_3db": ""})  # fmt: skip
    assert sheet.natural_frequency[0] == 80.0
    assert sheet.damping_ratio[0] == pytest.approx(z, rel=1e-9)
    response = 1 / complex(1 - ratio**2, 2 * z * ratio)
    assert abs(response) == pytest.approx(math.sqrt(0.5))


def test_an_answer_displaces_the_librarys_number() -> None:
    """A stated nominal flow or pressure drop replaces that of the library."""
    given = {"valve": "parker_bd15_38", "nominal_flow": "63 l/min",
             "pressure_drop_per_edge": "35 bar"}  # fmt: skip
    sheet = valve(answered(given, usual))
    assert sheet.values["nominal_flow"] == pytest.approx(63e-3 / 60)
    assert sheet.drop == "pressure_drop_per_edge"
    assert "pressure_drop_total" not in sheet.values
    assert sheet.origins["nominal_flow"] == "as you gave it"


def test_the_library_is_what_the_file_says() -> None:
    """Ten valves at least; a key that no data sheet has is refused, and all keys have questions."""
    assert len(VALVES) >= 10
    assert LIBRARY.is_file()
    asked = {q.name for q in QUESTIONS}
    assert PRINTED.keys() - asked == {"pilot_leakage", "max_pressure", "compensator"}


def test_both_e024_are_one_valve(tmp_path: Path) -> None:
    """That of the library and that of the reference machine have one gain, spool and lands."""
    reference = load([shipped("configs/hyq_knee.toml")]).plant
    values = plant_values(tmp_path, {"valve": "moog_e024", "supply_pressure": "160 bar"})
    fields = (
        "valve_gain", "valve_natural_frequency", "current_saturation_limit", "spool_stops_limit",
        "spool_rate_limit_rate", "land_leakage_clearance",
    )  # fmt: skip
    for field in fields:
        assert values[field] == pytest.approx(reference[field], rel=0.01), field


def test_a_spool_of_two_to_one_opens_all_edges_at_the_same_travel(tmp_path: Path) -> None:
    """Edges of half the area have the same overlap, so half of the lap of their slower opening."""
    given = {"valve": "rexroth_4wree6_e32", "supply_pressure": "200 bar", "port_b_flow": "50 %"}
    values = plant_values(tmp_path, given)
    for edge in ("sb", "bt"):
        gain = 1.0 + values[f"gain_{edge}_excess"]
        assert gain == pytest.approx(0.5)
        # the travel at which gain (u - lap of the edge) - overlap crosses zero
        opens_at = values["overlap_lap"] / gain + values[f"lap_{edge}_lap"]
        assert opens_at == pytest.approx(values["overlap_lap"])

"""A servo valve with blocked ports, and flow meters in supply, return and leakage line."""

from pathlib import Path

import numpy as np
import pytest

from tests.identify.benches.asked import asked, bench, names, recorded
from tests.identify.benches.valve import LITRES, SUPPLY, TANK, blocked_ports, noisy, triangle

LEAKAGE = bench("valve_leakage")
PILOT = 0.8e-6 / 60.0 / 1e5 * (SUPPLY - TANK)
"""Flow of the pilot stage as configured: 0.8 cm^3/min per bar [m^3/s]."""


def leaking(file: Path, top: float, cycles: int, underlap: float, pilot: float = PILOT) -> Path:
    """Record three flows for 300 s; the pilot stage drains into the leakage line."""
    time, current = triangle(300.0, 3.0, top, cycles)
    _, _, null = blocked_ports(current, max(underlap, 1e-9))
    return recorded(file, {
        "time [s]": time, "valve_current [mA]": 1e3 * current,
        "supply_flow [l/min]": noisy(LITRES * (null + pilot), 0.003, file),
        "return_flow [l/min]": noisy(LITRES * null, 0.003, file),
        "leakage_line_flow [l/min]": noisy(np.full(len(time), LITRES * pilot), 0.001, file),
    })  # fmt: skip


@pytest.mark.full(sibling="test_a_new_valve_agrees")
def test_edges_that_wore_are_named(tmp_path: Path) -> None:
    """Leakage that grew around null is an underlap, and the pilot stage is as it was."""
    tops = (3e-4, 2e-4, 2.5e-4)
    files = [leaking(tmp_path / f"{i}.csv", t, 1 + i, 5e-5) for i, t in enumerate(tops)]
    gap, output = asked("gap", LEAKAGE, files[:2], files[2:], tmp_path)
    assert "bench     a valve leakage bench" in output
    assert gap["verdict"] == "disagrees"
    assert gap["where"][0]["balance"] == "flow from s to t"
    result, _ = asked("identify", LEAKAGE, files[:2], files[2:], tmp_path)
    assert names(result) == ["underlap"]
    low, high = result["effects"][0]["interval"]
    assert low < 5e-5 < high


def test_a_new_valve_agrees(tmp_path: Path) -> None:
    """Supply is return and leakage line together; without a line the return line has it all."""
    file = leaking(tmp_path / "new.csv", 3e-4, 1, 0.0)
    result, _ = asked("gap", LEAKAGE, [file], [], tmp_path)
    assert result["verdict"] == "agrees"
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    rows[:, 3] += rows[:, 4]
    heads = file.read_text().splitlines()[0].split(",")
    joined = recorded(tmp_path / "joined.csv", dict(zip(heads[:4], rows.T[:4], strict=True)))
    result, _ = asked("gap", LEAKAGE, [joined], [], tmp_path)
    assert result["verdict"] == "agrees"


@pytest.mark.slow
def test_a_worn_valve_of_25_ma_is_not_below_what_is_visible(tmp_path: Path) -> None:
    """Leakage of 0.66 l/min at null is underlap or wear of the lands: the data show both."""
    config = tmp_path / "large.toml"
    config.write_text(LEAKAGE.read_text().replace('"10 mA"', '"25 mA"'))
    files = []
    for i, top in enumerate((3e-3, 2e-3)):
        file = leaking(tmp_path / f"{i}.csv", top, 2 + i, 3e-4)
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, 1] *= 2.5
        heads = file.read_text().splitlines()[0].split(",")
        files.append(recorded(file, dict(zip(heads, rows.T, strict=True))))
    result, _ = asked("identify", config, files, [], tmp_path)
    assert names(result) == ["underlap"]
    assert not {"underlap", "land_leakage"} & set(result["unseen"])


@pytest.mark.slow
def test_a_meter_that_lags_is_named(tmp_path: Path) -> None:
    """The meter of the supply follows its flow by 1.07 s; the layer holds it as a comment."""
    config = tmp_path / "worn.toml"
    config.write_text(LEAKAGE.read_text().replace("[valve]", '[valve]\nunderlap = "50 uA"'))
    files = []
    for i, top in enumerate((3e-4, 2e-4, 2.5e-4)):
        file = leaking(tmp_path / f"{i}.csv", top, 2 + i, 5e-5)
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
        flow, late = rows[:, 2].copy(), 1.07 * 3.0
        for k in range(1, len(flow)):
            # a low-pass of a flow that is linear between rows
            step, kept = flow[k] - flow[k - 1], np.exp(-1.0 / late)
            before = rows[k - 1, 2] - flow[k - 1]
            rows[k, 2] = flow[k] - late * step + kept * (before + late * step)
        heads = file.read_text().splitlines()[0].split(",")
        files.append(recorded(file, dict(zip(heads, rows.T, strict=True))))
    result, _ = asked("identify", config, files[:2], files[2:], tmp_path)
    (effect,) = result["effects"]
    assert effect["name"] == "supply_flow.lag"
    low, high = effect["interval"]
    assert low < 1.07 < high
    assert (
        "# supply_flow, which only the bench meters: lag"
        in (tmp_path / "identified.toml").read_text()
    )


def test_a_pilot_stage_that_leaks_more_is_refitted(tmp_path: Path) -> None:
    """The configured leakage is a parameter, which the leakage line shows."""
    files = [leaking(tmp_path / f"{i}.csv", 3e-4, 1 + i, 0.0, 1.3 * PILOT) for i in range(2)]
    result, _ = asked("gap", LEAKAGE, files, [], tmp_path)
    pilot = result["parameters"]["pilot_leakage"]
    assert pilot["refitted"] == pytest.approx(1.3 * pilot["configured"], rel=0.02)

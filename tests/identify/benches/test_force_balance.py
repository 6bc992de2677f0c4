"""A friction rig whose configuration describes a seal, and nothing of valve, oil or load.

The recordings follow from Newton's law for a rod without mass: f = A p - sign(v) (F_c + k p) - b v.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.identify.benches.asked import asked, bench, names, recorded

AREA, COULOMB, VISCOUS = 4.8e-4, 30.0, 200.0
GROWTH = 1.2e-5
"""Hidden: friction per pressure [N/Pa], 12 mm^2."""


def seal(file: Path, bar: float, growth: float) -> Path:
    """Record a plunger that a machine moves to and fro at one pressure."""
    random = np.random.default_rng(int(bar))
    time = np.arange(0.0, 16.0, 0.005)
    turning = 2.0 * np.pi * (0.15 + 0.02 * bar)
    velocity = 0.012 * turning * np.cos(turning * time)
    pressure = 1e5 * bar * (1.0 + 0.02 * np.sin(3.0 * time))
    friction = np.sign(velocity) * (COULOMB + growth * pressure) + VISCOUS * velocity
    return recorded(file, {
        "time [s]": time,
        "position [mm]": 20.0 + 12.0 * np.sin(turning * time) + random.normal(0.0, 1e-3, len(time)),
        "pressure_a [bar]": 1e-5 * pressure + random.normal(0.0, 2e-3, len(time)),
        "load_force [N]": AREA * pressure - friction + random.normal(0.0, 1.0, len(time)),
    })  # fmt: skip


@pytest.fixture(scope="module")
def seals(tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], list[Path]]:
    """Return a function that records the seal at four pressures."""

    def record(growth: float) -> list[Path]:
        folder = tmp_path_factory.mktemp("seals")
        return [seal(folder / f"{bar}bar.csv", bar, growth) for bar in (1, 5, 3, 7)]

    return record


def test_growth_of_friction_with_pressure_is_named(
    seals: Callable[[float], list[Path]], tmp_path: Path
) -> None:
    """The absent chamber needs no channel; what was hidden is named and lies in its interval."""
    files = seals(GROWTH)
    result, output = asked("identify", bench("force_balance"), files[:2], files[2:], tmp_path)
    assert "bench     a force balance" in output
    assert "chamber b absent" in output
    assert names(result) == ["pressure_friction"]
    low, high = result["effects"][0]["interval"]
    assert low < GROWTH < high
    assert result["gap"]["load_force"]["validation"]["after"] == pytest.approx(1.0, rel=0.15)


def test_a_chamber_that_nothing_shows_has_to_be_stated(
    seals: Callable[[float], list[Path]], tmp_path: Path
) -> None:
    """The chamber may be absent or at a constant pressure; the message has the line for either.

    Three bar behind an annulus of 2 cm^2 take 60 N from the load, and nothing else.
    """
    files = seals(0.0)
    for i, file in enumerate(files):
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, 3] -= 60.0
        head = file.read_text().splitlines()[0].split(",")
        files[i] = recorded(file, dict(zip(head, rows.T, strict=True)))
    both = tmp_path / "both.toml"
    text = bench("force_balance").read_text()
    text = text.replace('piston_area = "5 cm^2"', 'piston_area = "4.8 cm^2"\narea_ratio = 0.41667')
    both.write_text(text.replace('pressure_b = "absent"', ""))
    refused, output = asked("gap", both, files[:2], files[2:], tmp_path)
    assert refused["verdict"] == "cannot_examine"
    assert 'set pressure_b = "absent" or "3 bar" under [bench]' in output
    both.write_text(text.replace('pressure_b = "absent"', 'pressure_b = "3 bar"'))
    result, output = asked("gap", both, files[:2], files[2:], tmp_path)
    assert "chamber b at a constant 3 bar" in output
    assert result["gap"]["load_force"]["training"]["before"] == pytest.approx(1.0, rel=0.15)

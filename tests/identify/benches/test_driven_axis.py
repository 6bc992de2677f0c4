"""A carriage on a linear motor: no pressure, no cylinder, and a force that moves it.

The recordings follow from Newton's law: F = m a + sign(v) F_c + b v.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.identify.benches.asked import asked, bench, names, recorded
from tests.identify.test_kinematics import PERIOD, moved

MASS, COULOMB = 97.0, 40.0
VISCOUS = 120.0
"""Hidden: friction per velocity [N s/m]."""


def carriage(file: Path, kind: int, viscous: float) -> Path:
    """Record two sines of position around 300 mm, and the force of the motor."""
    random = np.random.default_rng(kind)
    time = np.arange(0.0, 10.0, 0.002)
    position, velocity, acceleration = (np.zeros(len(time)) for _ in range(3))
    for size, turning in ((0.12, 0.3 + 0.07 * kind), (0.03, 0.55 + 0.11 * kind)):
        w = 2.0 * np.pi * turning
        position += size * np.sin(w * time)
        velocity += size * w * np.cos(w * time)
        acceleration -= size * w * w * np.sin(w * time)
    force = MASS * acceleration + np.sign(velocity) * COULOMB + viscous * velocity
    return recorded(file, {
        "time [s]": time,
        "position [mm]": 300.0 + 1e3 * position + random.normal(0.0, 1e-3, len(time)),
        "load_force [N]": force + random.normal(0.0, 2.0, len(time)),
    })  # fmt: skip


@pytest.mark.slow
def test_viscous_friction_of_an_axis_is_named(tmp_path: Path) -> None:
    """Only a mass was configured; the estimated mass and the named friction are the true ones.

    The force of a motor acts along the motion: no sign has to be reversed.
    """
    files = [carriage(tmp_path / f"axis{i}.csv", i, VISCOUS) for i in range(4)]
    result, output = asked("identify", bench("driven_axis"), files[:2], files[2:], tmp_path)
    assert "bench     a driven axis" in output
    assert "reversed" not in output
    assert names(result) == ["viscous_friction"]
    low, high = result["effects"][0]["interval"]
    assert low < VISCOUS < high
    mass = result["parameters"]["load_mass"]
    assert mass["low"] < MASS < mass["high"]


@pytest.mark.parametrize(
    "phase",
    [0.02, pytest.param(0.2, marks=pytest.mark.full(sibling="test_fast_motion_gives_the_mass"))],
)
def test_fast_motion_gives_the_mass(tmp_path: Path, phase: float) -> None:
    """Strokes that reverse within 20 ms, with a position in steps of 1 um, show the true mass.

    It lies in its interval, which is 0.5 % wide. The friction lies in its interval if the speed
    differs for long enough.
    """
    files = []
    for k in range(2):
        random = np.random.default_rng(k)
        x, v, a = moved(phase)
        time = np.arange(len(x)) * PERIOD
        force = MASS * a + np.sign(v) * COULOMB + VISCOUS * v + random.normal(0.0, 10.0, len(x))
        # a guide that moves a little: no stroke is rounded like the one before
        place = 0.3 + x + random.uniform(2e-6, 9e-6) * time
        files.append(recorded(tmp_path / f"axis{k}.csv", {
            "time [s]": time, "position [mm]": 1e3 * np.round(place / 1e-6) * 1e-6,
            "load_force [N]": force,
        }))  # fmt: skip
    result, _ = asked("identify", bench("driven_axis"), files, [], tmp_path)
    mass = result["parameters"]["load_mass"]
    assert mass["low"] < MASS < mass["high"]
    assert mass["high"] - mass["low"] < 0.006 * MASS
    assert names(result) == (["viscous_friction"] if phase == 0.2 else [])
    for effect in result["effects"]:
        low, high = effect["interval"]
        assert low < VISCOUS < high


def guide(file: Path, kind: int, dry: float, offset: float, asymmetry: float = 0.0) -> Path:
    """Record 40 s of a light axis to and fro, with dry friction that ripples along the stroke."""
    random = np.random.default_rng(kind)
    time = np.arange(0.0, 40.0, 0.01)
    w = 2.0 * np.pi * (0.11 + 0.04 * kind)
    position, velocity = 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time)
    force = dry * np.sign(velocity) * (1.0 + 0.03 * np.sin(500.0 * position)) + offset
    force += dry * asymmetry - 5.0 * 0.02 * w * w * np.sin(w * time)
    return recorded(file, {
        "time [s]": time,
        "position [mm]": 100.0 + 1e3 * position + random.normal(0.0, 5e-3, len(time)),
        "velocity [mm/s]": 1e3 * velocity,
        "load_force [N]": force + random.normal(0.0, 0.01 * dry, len(time)),
    })  # fmt: skip


@pytest.mark.parametrize(
    ("dry", "offset", "asymmetry"),
    [
        (300.0, -109.0, 0.0),
        pytest.param(8.0, 350.0, 0.0, marks=pytest.mark.slow),
        pytest.param(80.0, 0.0, 0.1, marks=pytest.mark.slow),
    ],
)
def test_a_constant_beside_dry_friction_is_named(
    tmp_path: Path, dry: float, offset: float, asymmetry: float
) -> None:
    """Motion both ways separates them; asymmetry of dry friction is a constant, too.

    A bench without any chamber has no word of a pressure.
    """
    config = tmp_path / "axis.toml"
    config.write_text('[bench]\nkind = "driven axis"\n[load]\nmass = "5 kg"\n')
    files = [guide(tmp_path / f"axis{i}.csv", i, dry, offset, asymmetry) for i in range(3)]
    result, shown = asked("identify", config, files[:2], files[2:], tmp_path)
    effects = {effect["name"]: effect for effect in result["effects"]}
    low, high = effects.pop("coulomb_friction")["interval"]
    assert low < dry < high < 1.2 * low
    (constant,) = effects.values()
    alike = {constant["name"], *constant["group"]}
    assert {"gravity", "load_force.offset"} <= alike
    assert ("friction_asymmetry" in alike) == (abs(offset) < dry)
    unit = dry if constant["name"] == "friction_asymmetry" else 1.0
    assert constant["value"] * unit == pytest.approx(offset + dry * asymmetry, rel=0.02)
    assert "pressure" not in shown.replace("without any pressure", "")


def test_a_carriage_as_configured_agrees(tmp_path: Path) -> None:
    """Of the gap what remains is the noise of the force sensor."""
    files = [carriage(tmp_path / f"axis{i}.csv", i, 0.0) for i in range(2)]
    result, _ = asked("gap", bench("driven_axis"), files, [], tmp_path)
    assert result["gap"]["load_force"]["training"]["before"] < 3.0

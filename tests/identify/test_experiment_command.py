"""`hil-emulator experiment`: stimulus files, and playing them on the bus."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.identify.experiment_design.library import LIBRARY
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, knee


def done(*words: object) -> str:
    """Run a command that has to succeed, and return its output."""
    result = CliRunner().invoke(main, [str(w) for w in words])
    assert result.exit_code == 0, result.output
    return result.output


def test_without_a_name_it_lists_the_library() -> None:
    """Every experiment is there with what it shows well."""
    output = done("experiment")
    assert all(entry.name in output and entry.shows in output for entry in LIBRARY)


def test_it_writes_time_and_position(tmp_path: Path) -> None:
    """Two columns in SI, as long and as large as asked for; and a picture."""
    file, picture = tmp_path / "t.csv", tmp_path / "t.png"
    done("experiment", "triangles", "--amplitude", "5 mm", "--duration", "3 s",
         "--out", file, "--picture", picture)  # fmt: skip
    time, position = np.loadtxt(file, delimiter=",", skiprows=1).T
    assert file.read_text().startswith("time [s],position [m]\n")
    assert len(time) == 3000
    assert (position.min(), position.max()) == pytest.approx((0.035, 0.045), abs=1e-5)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_missing_folder_gets_a_message(tmp_path: Path) -> None:
    """One message and exit code 2."""
    result = CliRunner().invoke(main, ["experiment", "steps", f"--out={tmp_path / 'no' / 's.csv'}"])
    assert result.exit_code == 2
    assert "does not exist; make it first" in result.output


def played(name: str, folder: Path) -> Path:
    """Play an experiment on the bus and return its recording."""
    scenario = folder / f"{name}.toml"
    done("experiment", name, "--out", folder / f"{name}.csv", "--scenario", scenario)
    output = done("scenario", scenario, "--workers", "1", "--record", folder / "recordings")
    assert f"pass     {name}" in output
    return folder / "recordings" / f"{name}.csv"


def test_an_experiment_is_played_on_the_bus_and_recorded(tmp_path: Path) -> None:
    """Through RPDOs and TPDOs the rod follows the file, and `identify` reads what comes of it."""
    (experiment,) = load_experiments([played("triangles", tmp_path)])
    position = experiment.readings["position"]
    assert experiment.period == pytest.approx(1e-3)
    assert np.ptp(position) > 0.015
    assert np.corrcoef(experiment.current[:-5], np.gradient(position)[5:])[0, 1] > 0.7
    assert {
        "pressure_a",
        "pressure_b",
        "supply_pressure",
        "load_force",
    } <= experiment.readings.keys()


@pytest.mark.full(sibling="test_an_experiment_is_played_on_the_bus_and_recorded")
def test_a_machine_as_configured_lacks_nothing_on_the_bus(tmp_path: Path) -> None:
    """Recorded through the bus, the emulator and its own configuration agree."""
    files = [played(n, tmp_path) for n in ("multisine", "steps", "triangles", "fast_multisine")]
    experiments = load_experiments(files)
    result = identify(knee(), experiments[:3], experiments[3:], cache=CACHE)
    assert result.verdict == "nothing_missing"

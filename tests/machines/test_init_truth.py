"""What `init` writes about a machine is true, and every choice that it offers works."""

import itertools
import random
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from written import init

from hil_emulator.__main__ import main
from hil_emulator.commands.check import warnings
from hil_emulator.commands.init import STEPS, default_answer
from hil_emulator.config.load import Configuration, load_rig
from hil_emulator.errors import UserError
from hil_emulator.machines.node_sheet import electronic_data_sheet
from hil_emulator.machines.questions import Answers, answered
from hil_emulator.machines.valve_sheet import library
from hil_emulator.machines.writing import configuration
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.node_factory import nodes

PUMPS = ("ideal", "fixed", "variable")
RIG = {
    "bore": "63 mm", "rod": "45 mm", "stroke": "200 mm", "valve": "own", "nominal_flow": "40 l/min",
    "supply_pressure": "210 bar", "pump": "fixed", "pump_flow": "30 l/min", "mass": "500 kg",
}  # fmt: skip
"""A machine of which the user knows some numbers; one of them is the default, too."""

STIFF = ["--valve", "own", "--nominal-flow", "2000 l/min", "--stroke", "1 mm", "--line-length=0 m"]


def draw(seed: int, valve: str, pump: str) -> dict[str, str]:
    """Return options of a machine: sizes over two decades, a load that it can lift."""
    rng = random.Random(seed)
    bore = 10 ** rng.uniform(-2.0, -0.7)
    given = {
        "valve": valve,
        "pump": pump,
        "bore": f"{1e3 * bore:.1f} mm",
        "stroke": f"{1e3 * bore * rng.uniform(1.0, 10.0):.1f} mm",
        "mass": f"{10 ** rng.uniform(0.0, 4.0):.3g} kg",
        "weight": f"{rng.uniform(-1.0, 1.0) * 2e6 * bore**2:.3g} N",
        "line_length": f"{rng.uniform(0.1, 5.0):.2f} m",
    }
    if pump != "ideal":
        given["pump_flow"] = f"{rng.uniform(2.0, 100.0):.1f} l/min"
        given["accumulator"] = rng.choice(["0 l", "0.5 l", "20 l"])
    return {
        name: text
        for name, text in given.items()
        if rng.random() < 0.8 or name in ("valve", "bore")
    }


def text_of(given: dict[str, str]) -> tuple[Answers, str]:
    """Return all answers and the configuration, with the longest integration step."""
    given = {n: t for n, t in given.items() if given.get("pump", "ideal") != "ideal"
             or n not in ("pump_flow", "accumulator")}  # fmt: skip
    answers = answered(given, default_answer)
    return answers, configuration(answers, "machine.eds", "schema.json", STEPS[0])


def loaded(folder: Path, given: dict[str, str]) -> Configuration:
    """Return the configuration that `init` would write for options."""
    answers, text = text_of(given)
    usual = shipped("eds/hydraulic_actuator.eds").read_text()
    (folder / "machine.eds").write_text(electronic_data_sheet(usual, "machine.eds", answers))
    (folder / "machine.toml").write_text(text)
    return load_rig([folder / "machine.toml"])


@pytest.mark.parametrize("valve", [*library(), "own"])
def test_no_choice_is_refused_by_its_own_defaults(valve: str, tmp_path: Path) -> None:
    """Each valve of the library, with each supply and drawn sizes, loads without a warning."""
    for seed, pump in enumerate(PUMPS):
        config = loaded(tmp_path, draw(seed + len(valve), valve, pump))
        assert list(warnings(config)) == []
        (node,) = nodes(config, [])
        assert any(b.bound_to == "command valve_current" for b in node.bindings())


def test_a_line_states_whether_the_user_gave_its_number() -> None:
    """Also where the answer is the default, and where the user's own valve has defaults."""
    _, text = text_of(RIG)
    comments = dict(re.findall(r"(?m)^(\w+) = .*?# (.*)$", text))
    for key in ("bore", "rod", "stroke", "mass", "nominal_flow", "fixed_pump"):
        assert comments[key] == "as you gave it", key
    assert re.search(r'(?m)^pressure = "210 bar" +# as you gave it$', text)
    assert re.search(r'(?m)^pressure = "1 bar" +# default$', text)
    for key in ("rated_current", "pressure_drop_total", "natural_frequency", "hysteresis"):
        assert "not stated" in comments[key]
        assert "as you gave it" not in comments[key]
    usual = text_of({})[1]
    assert "as you gave it" not in usual


def test_a_half_given_accumulator_names_the_half() -> None:
    """The gas volume is an option, the pre-charge a default."""
    given = {"pump": "fixed", "accumulator": "2 l"}
    assert "# accumulator as you gave it, else default" in text_of(given)[1]
    assert "# as you gave it" in text_of(given | {"precharge": "90 bar"})[1]


def test_a_slope_stands_for_the_weight(tmp_path: Path) -> None:
    """500 kg at 30 degrees are 2452 N along the rod; a slope and a weight contradict each other."""
    given = RIG | {"slope": "30 deg"}
    assert 'slope = "30 deg"                    # as you gave it' in text_of(given)[1]
    assert loaded(tmp_path, given).plant["gravity_force"] == pytest.approx(2451.7, abs=0.1)
    with pytest.raises(UserError, match=r"--weight: does not apply here, see --slope"):
        text_of(given | {"weight": "3 kN"})
    with pytest.raises(UserError, match=r"--slope: the cylinder lifts no more than 65.4"):
        text_of(given | {"mass": "50 t"})


@pytest.mark.slow
def test_the_pump_limits_the_speed_that_is_printed(tmp_path: Path) -> None:
    """q/A: 12 l/min into 40 mm bore are 0.159 m/s, whatever the valve would pass."""
    slow = init(tmp_path, "--pump", "fixed", "--pump-flow", "12 l/min")[1].output
    assert "no-load speed     0.159 m/s, extending, by the pump of 12 l/min" in slow
    assert re.search(r"warning +the valve would pass 1.22 m/s: at more than 0.13 of its", slow)
    enough = init(tmp_path, "--overwrite", "--pump", "fixed", "--pump-flow", "100 l/min")[1].output
    assert "no-load speed     1.22 m/s, extending\n" in enough
    assert "warning" not in enough


@pytest.mark.parametrize(
    "options",
    [
        ["--weight", "40 kN"],
        [*STIFF, "--bore", "200 mm"],
        [*STIFF, "--bore", "3 mm"],
    ],
)
def test_a_failed_init_leaves_nothing_behind(tmp_path: Path, options: list[str]) -> None:
    """Refused answers and a machine too stiff; the next try meets no file, not even hidden ones."""
    folder = tmp_path / "new"
    folder.mkdir()
    _, result = init(folder, *options)
    assert result.exit_code == 2
    assert list(folder.iterdir()) == []
    assert "Traceback" not in result.output
    assert "/tmp" not in result.output.replace(str(tmp_path), "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("valve", "pump"), random.Random(7).sample([*itertools.product(library(), PUMPS)], 3)
)
def test_a_drawn_machine_passes_every_command(tmp_path: Path, valve: str, pump: str) -> None:
    """`check`, `linear`, and ten seconds of `run` in lock-step."""
    options = [f"--{n.replace('_', '-')}={t}" for n, t in draw(1, valve, pump).items()]
    file, result = init(tmp_path, *options)
    assert result.exit_code == 0, result.output
    for command in (
        ["check", str(file)],
        ["linear", str(file)],
        ["run", str(file), "--clock", "lockstep", "--duration", "10 s", "--port", "0"],
    ):
        result = CliRunner().invoke(main, command)
        assert result.exit_code == 0, (command, result.output)
        assert "Traceback" not in result.output
        assert result.exception is None or isinstance(result.exception, SystemExit), command

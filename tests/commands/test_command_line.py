"""The command line as a user calls it."""

import csv
import json
import re
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal

REFERENCE = shipped("configs/hyq_knee.toml")

Result = subprocess.CompletedProcess[str]


def hil_emulator(*arguments: object, folder: Path | None = None) -> Result:
    """Run a command in a new process."""
    command = [sys.executable, "-m", "hil_emulator", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=600, cwd=folder, check=False
    )


def output_of(*arguments: object) -> str:
    """Return the output of a command that succeeds."""
    result = CliRunner().invoke(main, [*map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def refused(*arguments: object) -> str:
    """Return the message of a command that ends with exit code 2, without a traceback."""
    result = CliRunner().invoke(main, [*map(str, arguments)])
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 2, result.output
    return result.stderr


@pytest.fixture
def layer(tmp_path: Path) -> Callable[[str], Path]:
    """Return a function that writes a configuration file."""

    def write(text: str) -> Path:
        file = tmp_path / f"layer{len(list(tmp_path.iterdir()))}.toml"
        file.write_text(text)
        return file

    return write


def test_check_shows_binding_pdos_and_bus_load() -> None:
    """The objects with their channels, the PDO map, and the share of 1 Mbit/s."""
    text = output_of("check", REFERENCE)
    assert "channel load_force" in text
    assert "TPDO3" in text
    assert "Bus load of bus at most" in text
    assert "warning" not in text


def test_check_reports_what_is_odd_about_a_makers_file(
    tmp_path: Path, layer: Callable[[str], Path]
) -> None:
    """It names section, key and reading, objects at their defaults, and a bus that is too fast."""
    text = shipped("eds/hydraulic_actuator.eds").read_text()
    eds = tmp_path / "odd.eds"
    eds.write_text(
        text.replace("[2010]\nParameterName=pressure_a\n", "[2010]\nParameterName=p\nHighLimit=?\n")
        .replace("BaudRate_500=1", "BaudRate_500=0")
    )  # fmt: skip
    over = layer(f'[bus]\nbitrate = 500000\n[[node]]\nid = 5\neds = "{eds}"')
    output = output_of("check", REFERENCE, over)
    assert "note: [2010] HighLimit: '?' is no INTEGER16; no limit\n" in output
    assert (
        "note: TPDO1 maps objects without a source, which hold their defaults: 0x2010:00 p\n"
        in output
    )
    assert "odd.eds does not support 500 kbit/s\n" in output


def test_check_warns_of_what_will_not_run_well(layer: Callable[[str], Path]) -> None:
    """The message gives numbers for a step too wide and for a bus too slow for its PDOs."""
    over = layer('[rig]\ntick = "1 ms"\nstep = "100 us"\n[bus]\nbitrate = 250000')
    text = output_of("check", REFERENCE, over)
    assert "step of 100 us is too wide for this actuator: pressure " in text
    assert "set [rig] step to 20 us or less" in text  # of up to 24 us, the longest that fits 1 ms
    assert "more than it can carry" in text


@pytest.mark.slow
def test_a_law_that_cannot_become_machine_code_is_named(
    tmp_path: Path, layer: Callable[[str], Path]
) -> None:
    """The message names file, line and code; the error shows when the model is compiled."""
    file = tmp_path / "own.py"
    file.write_text(
        "from hil_emulator.model.declare import Param, effect\n"
        "from hil_emulator.model.stages import friction\n\n\n"
        "def table(v):\n    return open('table.csv').read()\n\n\n"
        "@effect(friction, knob=Param('level', 'N', 'force', 1.0, 0.0, 9.0), source='assumed',\n"
        "        signature='test')\n"
        "def own_drag(velocity: float, level: float) -> float:\n"
        "    'F = T(v).'\n    return level * table(velocity)\n\n\nEFFECTS = (own_drag,)\n"
    )
    over = layer(f'[model]\neffects = ["{file}"]\n[friction]\nown_drag = "2 N"')
    message = refused("check", REFERENCE, over)
    assert re.search(r"own\.py, line \d+: an effect cannot be compiled: .*'table'", message)


def test_without_a_file_the_machines_of_the_package_are_named() -> None:
    """The message lists them and explains how to write one; a name serves as a path."""
    message = refused("run")
    assert "hyq_knee       The knee cylinder of the hydraulic quadruped HyQ" in message
    assert "hil-emulator init" in message
    assert "spring_load" not in message
    assert output_of("check", "hyq_knee") == output_of("check", REFERENCE)
    assert "is no file, and no machine or layer or bench of the package" in refused(
        "run", "hyqknee"
    )


def test_the_schema_is_written_for_editors(tmp_path: Path) -> None:
    """One JSON file, and the line with which a configuration names it."""
    output = hil_emulator("schema", "--out", "s.json", folder=tmp_path).stdout
    assert '"#:schema ./s.json"' in output
    assert "valve" in json.loads((tmp_path / "s.json").read_text())["properties"]
    assert "actuator" in json.loads(output_of("schema", "machine"))["properties"]


def test_effects_lists_the_catalogue() -> None:
    """Every effect stands in the table, and its declaration in the JSON."""
    text = output_of("effects")
    assert all(e.name in text for e in CATALOGUE)
    rows = json.loads(output_of("effects", "--json"))
    assert [r["name"] for r in rows] == [e.name for e in CATALOGUE]
    wanted = {"stage", "knob", "unit", "off", "typical", "low", "high", "equation", "source"}
    assert all(wanted <= row.keys() for row in rows)


def test_demo_passes_and_draws(tmp_path: Path) -> None:
    """The demonstration ends with PASS, a verdict in numbers, and a picture."""
    result = hil_emulator("demo", folder=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "PASS: settling at most" in result.stdout
    picture = tmp_path / "hil-emulator-demo.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 50_000


@pytest.mark.slow
def test_bench_reports_the_speed_of_this_computer() -> None:
    """The JSON has every documented number, each of a plausible size."""
    speeds = json.loads(hil_emulator("bench", "--duration", "0.2 s", "--json").stdout)
    assert speeds["tick_us"]["p50"] <= speeds["tick_us"]["p99"]
    assert 0 < speeds["recording_us"]["p50"] <= speeds["recording_us"]["p99"]
    assert speeds["lateness_us"].keys() == {"p50", "p99", "p999", "max"}
    assert speeds["overruns"] >= 0
    assert speeds["rk4_step_us"] > 0
    assert speeds["fleet"]["nodes"] == 32
    assert speeds["fleet"]["pdos_per_ms"] >= 8
    assert speeds["lockstep_x"] > 0
    assert len(speeds["frames_sha256"]) == 64
    assert speeds["tcp_frames_per_s"] > 0
    assert speeds["start"]["memory_mb"] > 0
    assert speeds["client"]["execution_us"]["p50"] <= speeds["client"]["execution_us"]["p99"]


@pytest.mark.slow
def test_bench_reports_the_time_of_each_effect() -> None:
    """Every effect of the plant that is off in the reference machine, the slowest first."""
    costs = json.loads(hil_emulator("bench", "--effects", "--json").stdout)
    names = {cost["effect"] for cost in costs}
    assert {"cushion_plunger", "lap_sa", "pump_friction", "cylinder_lines"} <= names
    assert names.isdisjoint({"coulomb_friction", "lag"})
    assert costs == sorted(costs, key=lambda cost: -cost["relative"])
    assert min(cost["step_us"] for cost in costs) > 0.0


@pytest.mark.slow
def test_bench_reports_the_duration_of_an_identification() -> None:
    """Both searches end, and time and memory are of a plausible size."""
    times = json.loads(hil_emulator("bench", "--identify", "7 s", "--json").stdout)
    assert times["data_s"] == 7.0
    assert times["jobs"] >= 2
    assert min(times["alone_s"], times["shared_s"]) > 0.0
    assert min(times["alone_mb"], times["shared_mb"]) > 50.0


@pytest.mark.slow
def test_run_records_what_it_did(tmp_path: Path) -> None:
    """A run of 0.2 s leaves 200 rows with units and provenance, equal in CSV and NPZ."""
    for ending in ("csv", "npz"):
        result = hil_emulator(
            "run", REFERENCE, "--bus", "virtual:t", "--clock", "lockstep", "--duration", "0.2 s",
            "--record", tmp_path / f"run.{ending}",
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        assert "200 ticks, 0 late" in result.stdout
    lines = (tmp_path / "run.csv").read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert any(line.startswith("# digest: ") for line in comments)
    header, *rows = csv.reader(lines[len(comments) :])
    assert header[0] == "time [s]"
    assert len(rows) == 200
    with np.load(tmp_path / "run.npz") as stored:
        column = header.index("pressure_a [Pa]")
        values = [float(row[column]) for row in rows]
        np.testing.assert_allclose(stored["pressure_a"], values, rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["off", "1e8 N/m"])
def test_a_rod_that_leaves_its_stroke_is_reported(ends: str, layer: Callable[[str], Path]) -> None:
    """The summary reports a rod without stops that leaves its stroke; stops hold the rod."""
    over = layer(f'[cylinder]\nend_stops = "{ends}"\n[load]\ngravity = "-5000 N"\n'
                 '[initial]\nposition = "79 mm"')  # fmt: skip
    text = hil_emulator("run", REFERENCE, over, "--bus", "virtual:t", "--clock", "lockstep",
                        "--duration", "0.2 s").stdout  # fmt: skip
    assert ("stroke    the rod left it at 0." in text) == (ends == "off")


@pytest.mark.slow
def test_a_leg_of_two_actuators_runs_on_two_buses(
    layer: Callable[[str], Path], tmp_path: Path
) -> None:
    """Every node and bus is named, both actuators send heartbeats, and one supply fails.

    A fault of the supply acts on both, is in both recordings, and neither replays alone.
    """
    text = shipped("configs/hyq_leg.toml").read_text()
    leg = layer(
        re.sub(r"port = \d+", "port = 0", text).replace('"hyq_', f'"{REFERENCE.parent}/hyq_')
    )
    result = hil_emulator(
        "run", leg, "--clock", "lockstep", "--duration", "0.5 s",
        "--record", tmp_path / "leg.rec", "--fault", "hip.supply loss start='0.1 s'",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    for name in ("hip", "knee"):
        recording = journal.read(tmp_path / f"leg_{name}.rec")
        assert [what["fault"]["kind"] for _, what in recording.events] == ["loss"]
        assert recording.table()["model.supply_pressure"][-1] < 130e5
    assert "shared with hip" in refused("replay", tmp_path / "leg_knee.rec")
    assert "node      5 on hip" in result.stdout
    assert "node      12 on knee" in result.stdout
    assert "supply    pump: hip, knee" in result.stdout
    assert "leg       hip carries knee" in result.stdout
    assert "500 ticks" in result.stdout
    assert "40 out" in result.stdout
    assert "for one actuator" in refused("run", leg, "--control", "0")
    assert "such as hip.valve stuck" in refused("run", leg, "--fault", "valve stuck")


@pytest.mark.slow
def test_each_actuator_of_a_machine_is_recorded_and_can_break(
    layer: Callable[[str], Path], tmp_path: Path
) -> None:
    """One file each; the fault is in that of the actuator it was for; both replay bit for bit.

    So it is where each has its own supply.
    """
    text = re.sub(
        r"\[supplies.*\n.*\n|(?:supply|carries) = .*",
        "",
        shipped("configs/hyq_leg.toml").read_text(),
    )
    leg = layer(
        re.sub(r"port = \d+", "port = 0", text).replace('"hyq_', f'"{REFERENCE.parent}/hyq_')
    )
    result = hil_emulator(
        "run", leg, "--clock", "lockstep", "--duration", "0.3 s",
        "--record", tmp_path / "leg.rec", "--fault", "hip.supply droop start='0.1 s'",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    hip, knee = (journal.read(tmp_path / f"leg_{name}.rec") for name in ("hip", "knee"))
    assert len(hip.rows) == len(knee.rows) == 300
    assert [what for _, what in hip.events] != []
    assert knee.events == []
    assert hip.table()["model.supply_pressure"][-1] < 130e5
    assert knee.table()["model.supply_pressure"][-1] == 160e5
    for name in ("hip", "knee"):
        result = hil_emulator("replay", tmp_path / f"leg_{name}.rec")
        assert "the same, bit for bit" in result.stdout, result.stdout + result.stderr


def test_bad_input_ends_with_one_message(layer: Callable[[str], Path], tmp_path: Path) -> None:
    """Wrong files, keys, units, buses and options: what, where, what to do, exit code 2."""
    assert "no such file" in refused("run", tmp_path / "missing.toml")
    assert 'did you mean "stroke"' in refused(
        "check", REFERENCE, layer('[cylinder]\nstrok = "1 m"')
    )
    assert "a length; a pressure" in refused("check", REFERENCE, layer('[supply]\npressure="1 m"'))
    assert "nowhere.eds" in refused(
        "check", REFERENCE, layer('[[node]]\nid = 5\neds = "nowhere.eds"')
    )
    assert "interface:channel" in refused("run", REFERENCE, "--bus", "vcan0")
    assert "'nobus' is unknown" in refused("run", REFERENCE, "--bus", "nobus:x")
    assert '"60 s"' in refused("run", REFERENCE, "--duration", "60")
    assert "add --duration" in refused("run", REFERENCE, "--clock", "lockstep")
    assert "unknown ending" in refused("run", REFERENCE, "--record", tmp_path / "x.xls")
    assert "does not exist" in refused("run", REFERENCE, "--record", tmp_path / "no" / "x.csv")


def test_a_port_in_use_is_named(layer: Callable[[str], Path]) -> None:
    """If another program uses the port, the message names the port and the remedy."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        over = layer(f'[bus]\ninterface = "socketcand_server"\nport = {port}')
        assert str(port) in refused("run", REFERENCE, over, "--duration", "1 s")


def test_a_kernel_without_can_is_named() -> None:
    """The message for a missing interface ends with the remedy."""
    message = refused("run", REFERENCE, "--bus", "socketcan:nocan7", "--duration", "1 s")
    assert "SocketCAN" in message or "nocan7" in message


def test_a_value_may_be_negative() -> None:
    """`-0.5 mA` is read as a value and not as an option."""
    text = refused("ctl", "set", "valve_current", "-0.5 mA", "--port", "1")
    assert "no emulator answers at port 1" in text


@pytest.mark.parametrize(
    "words",
    ["demo --picture", "linear hyq_knee --picture", "scenario supply_drop_while_moving --html",
     "experiment steps --out", "export-fmu hyq_knee --out", "schema --out"],
)  # fmt: skip
def test_a_file_in_a_folder_that_is_not_there_is_refused_before_the_work(words: str) -> None:
    """The error for a picture's missing folder comes before the demonstration runs."""
    text = refused(*words.split(), "/nowhere/made")
    assert "/nowhere/made: the folder /nowhere does not exist; make it first" in text
    assert "reparing" not in text


@pytest.mark.parametrize("words", ["check", "linear", "effects", "replay", "plot"])
def test_a_folder_in_place_of_a_file_is_refused(words: str, tmp_path: Path) -> None:
    """A path that does not exist is refused too; one message names it."""
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    assert f"{folder}: " in refused(*words.split(), folder)
    assert "nowhere.rec" in refused(*words.split(), tmp_path / "nowhere.rec")


@pytest.mark.parametrize("command", ["linear hyq_knee", "demo", "plot made.rec position"])
def test_a_picture_of_no_format_is_refused_before_the_work(command: str) -> None:
    """The message lists the available endings."""
    text = refused(*command.split(), "--picture", "made.foo")
    assert "made.foo: no format of a picture has this ending; take one of " in text
    assert ".png, " in text


def test_a_missing_eds_is_reported_in_one_line() -> None:
    """The conformance suite does not start, and the message is printed without a report."""
    text = refused("conformance", "--eds", "missing.eds", "--can", "virtual:empty", "--node", 5)
    assert text == "hil-emulator: cannot read the EDS missing.eds: No such file or directory\n"

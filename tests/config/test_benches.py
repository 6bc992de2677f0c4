"""A configuration names the bench that it describes, and describes nothing else."""

import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.config.bench import KINDS
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped

WORKED = sorted((shipped("configs/hyq_knee.toml").parent / "benches").glob("*.toml"))

Layer = Callable[[str], Path]


@pytest.fixture
def layer(tmp_path: Path) -> Layer:
    """Return a function that writes a configuration file."""

    def write(text: str) -> Path:
        file = tmp_path / f"layer{len(list(tmp_path.iterdir()))}.toml"
        file.write_text(text)
        return file

    return write


def test_every_kind_of_bench_has_a_worked_configuration() -> None:
    """The whole actuator's are the others in the folder; each file is of the kind of its name."""
    kinds = {tomllib.loads(f.read_text())["bench"]["kind"]: f.stem for f in WORKED}
    assert kinds == {name: name.replace(" ", "_").replace("-", "_")
                     for name in KINDS if name != "actuator"}  # fmt: skip


@pytest.mark.parametrize("file", WORKED, ids=lambda f: f.stem)
def test_what_a_bench_does_not_describe_has_no_value(file: Path) -> None:
    """There is no default valve or cylinder: a value in no table is not a number."""
    config = load([file])
    tables = tomllib.loads(file.read_text())
    needed = KINDS[config.bench.kind].needs
    for table in ("supply", "valve", "cylinder", "oil", "load"):
        assert table in tables or table not in needed, table
        values = [v for name, v in config.plant.items() if name.startswith(f"{table}_")]
        assert table in tables or any(math.isnan(v) for v in values), table


def test_a_configuration_without_a_kind_is_a_whole_actuator(layer: Layer) -> None:
    """Every table is requested, each with an example that can be copied."""
    assert load([shipped("configs/hyq_knee.toml")]).bench.whole
    with pytest.raises(UserError) as caught:
        load([layer('[supply]\npressure = "160 bar"')])
    text = str(caught.value)
    assert "oil: missing; the whole actuator needs" in text
    assert '    [oil]\n    bulk_modulus = "1300 MPa"' in text
    assert re.search(r'\n    natural_frequency = "250 Hz" +# natural frequency of the spool', text)


def test_no_table_is_requested_for_an_unknown_kind(layer: Layer) -> None:
    """The one mistake is the name; the tables of such a bench are unknown."""
    with pytest.raises(UserError, match=r"^1 mistake.*\n.*bench\.kind: 'force balanc'"):
        load([layer('[bench]\nkind = "force balanc"')])


def test_only_the_tables_of_a_bench_are_requested(layer: Layer) -> None:
    """A force balance requests its areas; with one chamber it requests one of them."""
    with pytest.raises(UserError) as caught:
        load([layer('[bench]\nkind = "force balance"')])
    _, reported, *example = str(caught.value).splitlines()
    assert "cylinder: missing; a force balance needs" in reported
    assert [line.split()[0] for line in example] == ["[cylinder]", "bore", "rod"]
    one = '[bench]\nkind = "force balance"\npressure_b = "absent"\n[cylinder]\nbore = "25 mm"'
    assert load([layer(one)]).plant["cylinder_piston_area"] == pytest.approx(math.pi * 0.0125**2)
    with pytest.raises(UserError, match="give either bore and rod, or piston_area and area_ratio"):
        load([layer(one.replace("absent", "3 bar"))])


def test_a_setting_of_another_bench_is_refused(layer: Layer) -> None:
    """A chamber is refused on an axis without pressure; the message names its kind of bench."""
    text = '[bench]\nkind = "driven axis"\npressure_a = "3 bar"\n[load]\nmass = "95 kg"'
    with pytest.raises(UserError, match="it belongs to force balance"):
        load([layer(text)])
    with pytest.raises(UserError, match="'force balance'"):
        load([layer('[bench]\nkind = "force ballance"')])


def test_masses_of_presses_are_within_bounds(layer: Layer) -> None:
    """The ram of a forging press weighs tens of tonnes and has square metres."""
    text = (
        '[bench]\nkind = "force balance"\npressure_b = "absent"\n'
        '[cylinder]\npiston_area = "1.5 m^2"\nrod_mass = "60 t"'
    )
    assert load([layer(text)]).plant["rod_mass_mass"] == pytest.approx(60e3)


@pytest.mark.parametrize("command", ["linear", "characterise", "run", "hide"])
def test_a_simulation_requires_the_whole_actuator(command: str, tmp_path: Path) -> None:
    """One message names the bench of the file and the one that the command needs."""
    file = str(next(f for f in WORKED if f.stem == "driven_axis"))
    words = {
        "linear": ["linear", file], "characterise": ["characterise", "leakage", file],
        "run": ["run", file, "--clock", "lockstep", "--duration", "1 s"],
        "hide": ["hide", "nothing", "--config", file, "--out", str(tmp_path / "practice")],
    }  # fmt: skip
    done = CliRunner().invoke(main, words[command])
    assert done.exit_code == 2, done.output
    assert "this command simulates the whole actuator" in done.output

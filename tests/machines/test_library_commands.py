"""Every command on machines of the library: some valves drawn, the others by changing the seed."""

import random
from pathlib import Path

import pytest
from click.testing import CliRunner
from written import init

from hil_emulator.__main__ import main
from hil_emulator.machines.valve_sheet import library

SEED = 62
"""Of the draw; every valve of the library has passed."""

LAPPED = sorted(name for name, sheet in library().items() if sheet.get("overlap"))
OTHERS = sorted(library().keys() - set(LAPPED))
DRAWN = random.Random(SEED)
CHARACTERISED = DRAWN.sample(LAPPED, 1)
LINEARISED = DRAWN.sample(LAPPED, 1) + DRAWN.sample(OTHERS, 2)


def machine(folder: Path, valve: str) -> Path:
    """Return a machine with a valve, at a pressure that every valve of the library takes."""
    file, result = init(folder, "--valve", valve, "--supply-pressure", "200 bar")
    assert result.exit_code == 0, result.output
    return file


@pytest.mark.slow
@pytest.mark.parametrize("valve", LINEARISED)
def test_a_valve_of_the_library_is_checked_and_linearised(tmp_path: Path, valve: str) -> None:
    """`check` warns of nothing, and `linear` has a flow gain."""
    file = str(machine(tmp_path, valve))
    for command in ("check", "linear"):
        result = CliRunner().invoke(main, [command, file])
        assert result.exit_code == 0, result.output
        assert "warning" not in result.output


@pytest.mark.slow
@pytest.mark.parametrize("valve", CHARACTERISED)
def test_all_bench_tests_agree_with_a_valve_of_the_library(tmp_path: Path, valve: str) -> None:
    """No row differs; what a valve does not have is listed with the reason."""
    file = machine(tmp_path, valve)
    out = str(tmp_path / "bench")
    result = CliRunner().invoke(main, ["characterise", "all", str(file), "--out", out])
    assert result.exit_code == 0, result.output
    assert "DIFFERS" not in result.output
    assert "does not apply:" in result.output

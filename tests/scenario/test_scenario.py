"""Contents of scenarios and of their reports."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.scenario.loading import load
from hil_emulator.scenario.perform import perform

Write = Callable[[str], Path]

BEGINNING = f"""
title = "A short one"
config = ["{shipped("configs/hyq_knee.toml")}"]
duration = "100 ms"

[[step]]
nmt = "start"
at = "5 ms"
set = {{ valve_current = "0.5 mA" }}
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a scenario with a common beginning."""

    def written(rest: str) -> Path:
        file = tmp_path / "short.toml"
        file.write_text(BEGINNING + rest)
        return file

    return written


def check(file: Path) -> tuple[bool, str]:
    """Return whether the one expectation is met, and the observation."""
    (result,) = perform(file).checks
    return result.passed, result.observed


@pytest.mark.parametrize(
    ("expectation", "passed", "observed"),
    [
        ('signal = "position"\nwithin = ["39 mm", "50 mm"]', True, "mm ..."),
        ('signal = "position"\nwithin = ["39 mm", "40.5 mm"]', False, "mm at 0.0"),
        ('signal = "model.position"\nwithin = ["41 mm", "42 mm"]\nby = "90 ms"\nfor = "1 ms"',
         True, "at 0.0"),
        ('signal = "position"\nwithin = ["60 mm", "70 mm"]\nby = "90 ms"', False, "never"),
        ('signal = "position"\nwithin = ["0 mm", "80 mm"]\nfrom = "2 s"\nuntil = "3 s"',
         False, "no sample"),
        ('frame = "0x705"\ndata = "00"', True, "1, first at 0.000 s"),
        ('frame = "0x705"\ndata = "00"\nseen = false', False, "1, first"),
        ('frame = "0x085"\nseen = false', True, "0"),
        ('frame = "0x285"\nuntil = "4 ms"', False, "0"),
    ],
)  # fmt: skip
def test_an_expectation_is_met_or_not(
    write: Write, expectation: str, passed: bool, observed: str
) -> None:
    """Bands over a time, bands reached in time, frames seen and not seen."""
    assert check(write(f"[[expect]]\n{expectation}\n"))[0] is passed
    assert observed in check(write(f"[[expect]]\n{expectation}\n"))[1]


EXPECT = '[[expect]]\nframe = "0x085"\nseen = false\n'


@pytest.mark.parametrize(
    ("rest", "message"),
    [
        ('[[step]]\nat = "5 bar"\n' + EXPECT, r"step\.1\.at: .* a time is wanted"),
        ('[[step]]\nfault = "supply stuck"\n' + EXPECT, "supply cannot have 'stuck'.*loss, droop"),
        (
            '[[step]]\nset = { speed = "1 m/s" }\n' + EXPECT,
            "unknown key 'speed' in set; there are supply_pressure, lin",
        ),
        ('[[step]]\nwhen = "up"\n' + EXPECT, '"up" is not a comparison'),
        ('[[step]]\nfualt = "x"\n' + EXPECT, r"step\.1\.fualt: no such key, did you mean 'fault'"),
        ('[[expect]]\nsignal = "speed"\n', "no signal 'speed'; there are time"),
        ('[[expect]]\nwithin = ["1 mm", "2 mm"]\n', "name either a signal, an object or a frame"),
        ("", "expect: is missing"),
        ('[[step]]\nat = "1e300 s"\n' + EXPECT, r"step\.1\.at: .* 0 s \.\.\. 1e\+06 s"),
        ('[[step]]\nset = { supply_pressure = "inf bar" }\n' + EXPECT, "outside 1 bar ... 700"),
        ('[[step]]\nset = { valve_current = "30 A" }\n' + EXPECT, "outside -10000 mA ... 10000 mA"),
        ("[[step]]\nset = 5\n" + EXPECT, "unknown key 'set' in set"),
        ('[[step]]\nfault = ["a"]\n' + EXPECT, "fault"),
        ("[[step]]\nwhen = 3\n" + EXPECT, "is not a comparison"),
        ('[[expect]]\nsignal = ["position"]\nwithin = ["1 mm", "2 mm"]\n', "no signal"),
        ('[[expect]]\nsignal = "position"\nwithin = 5\n', "within is a list of the lowest"),
        ('[[expect]]\nframe = "0x085"\ndata = "xyz"\n', "non-hexadecimal"),
        ('[[expect]]\nframe = "0x' + "f" * 20 + '"\n', "less than or equal to"),
    ],
)
def test_a_mistake_is_named_with_its_place(write: Write, rest: str, message: str) -> None:
    """Before anything runs: the file, the table, the key, and what would be right."""
    with pytest.raises(UserError, match=f"short.toml: .*{message}"):
        load(write(rest))


def test_a_scenario_that_cannot_run_is_an_outcome(write: Write) -> None:
    """One wrong file does not stop the others."""
    outcome = perform(write("[[expect]]\nframe = 3\nnothing = 1\n"))
    assert not outcome.passed
    assert "nothing" in outcome.error


def test_the_command_reports_and_ends_with_the_verdict(write: Write, tmp_path: Path) -> None:
    """Exit code 1, the unmet expectation in table, JUnit XML and HTML."""
    file = write('[[expect]]\nsignal = "position"\nwithin = ["60 mm", "70 mm"]\n')
    result = subprocess.run(
        [sys.executable, "-m", "hil_emulator", "scenario", file, "--junit", tmp_path / "r.xml",
         "--html", tmp_path / "r.html"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert result.returncode == 1
    assert "FAIL     A short one" in result.stdout
    assert "position in 60 mm ... 70 mm" in result.stdout
    suite = ElementTree.parse(tmp_path / "r.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("1", "1", "0")
    text = (tmp_path / "r.html").read_text()
    assert "NOT MET" in text
    assert "data:image/png;base64," in text


@pytest.mark.parametrize("row", ["0.0,1e300", "0.0,nan", "inf,1.0"])
def test_a_profile_beyond_its_bounds_is_refused(write: Write, tmp_path: Path, row: str) -> None:
    """It is one sentence in the outcome; no such number reaches the plant or a frame."""
    (tmp_path / "force.csv").write_text(f"time,value\n{row}\n")
    profile = '[[step]]\nprofile = { signal = "external_force", file = "force.csv" }\n'
    assert "external_force has to stay within" in perform(write(profile + EXPECT)).error

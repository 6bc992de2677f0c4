"""Files that cannot be examined, through the command: one message or an honest verdict, no name."""

import functools
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.identify.data_checks.plausible import contradictions
from tests.identify.rig_data import INSTRUMENTS, KNEE, campaign, knee_model, recorded

Columns = dict[str, np.ndarray]
"""Values by heading."""

RANDOM = np.random.default_rng(11)


@functools.cache
def good() -> tuple[tuple[str, np.ndarray], ...]:
    """Return the columns of a sound recording."""
    e = recorded({}, "multisine", 1)
    unit = {"position": ("mm", 1e3), "load_force": ("N", 1.0)}
    columns = [("time [s]", np.arange(e.samples) * e.period)]
    columns += [("valve_current [mA]", e.current * 1e3)]
    for name in INSTRUMENTS:
        shown, factor = unit.get(name, ("bar", 1e-5))
        columns.append((f"{name} [{shown}]", e.readings[name] * factor))
    return tuple(columns)


def written(file: Path, columns: Columns) -> Path:
    """Write a table."""
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]
    file.write_text("\n".join(lines))
    return file


def asked(*arguments: object) -> tuple[int, str]:
    """Run `identify` on the reference machine and return exit code and output."""
    done = CliRunner().invoke(main, ["identify", str(KNEE), *map(str, arguments)])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert "Traceback" not in done.output
    assert "missing   " not in done.output
    return done.exit_code, done.output


def like(c: Columns, heading: str, other: str) -> Columns:
    """Return columns in which two have changed places."""
    return c | {heading: c[other], other: c[heading]}


def scaled(c: Columns, factor: float, *names: str) -> Columns:
    """Return columns with some values in a unit other than that of the heading."""
    return {h: v * factor if h.split()[0] in names else v for h, v in c.items()}


def renamed(c: Columns, names: dict[str, str]) -> Columns:
    """Return columns with other headings."""
    return {names.get(h, h): v for h, v in c.items()}


def noise(c: Columns) -> Columns:
    """Return white noise with each channel's mean and deviation, time kept."""
    made = {h: v.mean() + v.std() * RANDOM.standard_normal(len(v)) for h, v in c.items()}
    return made | {"time [s]": c["time [s]"]}


def walk(c: Columns) -> Columns:
    """Return random walks with each channel's mean and about its deviation."""
    made = {}
    for h, v in c.items():
        steps = np.cumsum(RANDOM.standard_normal(len(v)))
        made[h] = v.mean() + v.std() * (steps - steps.mean()) / steps.std()
    return made | {"time [s]": c["time [s]"]}


def faster(c: Columns, *names: str) -> Columns:
    """Return channels that another logger took with a clock one percent faster."""
    t = c["time [s]"]
    return {h: np.interp(t * 1.01, t, v) if h.split()[0] in names else v for h, v in c.items()}


P, F, X, U = "pressure_a [bar]", "load_force [N]", "position [mm]", "valve_current [mA]"

REFUSED: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "ten samples": (lambda c: {h: v[:10] for h, v in c.items()}, "10 usable samples"),
    "a header alone": (lambda c: {h: v[:0] for h, v in c.items()}, "0 usable samples"),
    "a wrong unit": (lambda c: renamed(c, {X: "position [bar]"}), "a unit of m is wanted"),
    "no unit": (lambda c: renamed(c, {X: "position"}), "has no unit"),
    "other names": (
        lambda c: {"time [s]": c["time [s]"], "posiition [mm]": c[X]}, "did you mean position"
    ),
    "no time": (lambda c: renamed(c, {"time [s]": "stamp [s]"}), 'no column "time [s]"'),
    "two columns of time": (
        lambda c: c | {"time_2 [s]": 1.001 * c["time [s]"] + 5.0}, "two clocks"
    ),
}  # fmt: skip
"""Files that end in one message, and a part of it."""

UNEXAMINED: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "all zeros": (
        lambda c: {h: v * (h == "time [s]") for h, v in c.items()}, "no experiment shows a moving"
    ),
    "a dead position": (lambda c: c | {X: 0.0 * c[X] + 40.0}, "moving position"),
    "10 Hz": (lambda c: c | {"time [s]": 100.0 * c["time [s]"]}, "sampled every 100 ms"),
    "position in m": (lambda c: scaled(c, 1e-3, "position"), "hardly moves"),
    "position in um": (lambda c: scaled(c, 1e3, "position"), "is its unit right"),
    "current in A": (lambda c: scaled(c, 1e-3, "valve_current"), "unit of valve_current"),
    "current in uA": (lambda c: scaled(c, 1e3, "valve_current"), "valve takes 10 mA"),
    "pressures in MPa": (
        lambda c: scaled(c, 0.1, "pressure_a", "pressure_b", "supply_pressure"), "the configuration"
    ),
    "force in kN": (lambda c: scaled(c, 1e-3, "load_force"), "what the pressures give"),
    "noise": (noise, "position is noise"),
    "random walks": (walk, "cannot_examine"),
    "chambers exchanged": (lambda c: like(c, P, "pressure_b [bar]"), "exchange"),
    "supply exchanged": (lambda c: like(c, P, "supply_pressure [bar]"), "exchanged"),
    "force as position": (lambda c: like(c, F, X), "cannot_examine"),
    "current as position": (lambda c: like(c, U, X), "cannot_examine"),
    "pressure as position": (lambda c: like(c, P, X), "cannot_examine"),
    "position reversed": (lambda c: c | {X: 80.0 - c[X]}, "reverse the sign of position"),
    "force reversed": (lambda c: c | {F: -c[F]}, "reverse load_force"),
    "position of another clock": (lambda c: faster(c, "position"), "two clocks"),
    "force of another clock": (lambda c: faster(c, "load_force"), "two clocks"),
    "pressures of another clock": (
        lambda c: faster(c, "pressure_a", "pressure_b", "supply_pressure"), "two clocks"
    ),
    "position 120 ms late": (lambda c: c | {X: np.roll(c[X], 120)}, "two clocks"),
}  # fmt: skip
"""Files that can be read and not examined, and a part of the reason."""


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, name: str) -> None:
    """One message that names the file and the remedy; exit code 2."""
    change, words = REFUSED[name]
    code, output = asked(written(tmp_path / "log.csv", change(dict(good()))))
    assert code == 2
    assert "log.csv" in output
    assert words in output


@pytest.mark.parametrize("name", UNEXAMINED)
def test_what_cannot_be_examined_gets_the_reason_and_no_name(tmp_path: Path, name: str) -> None:
    """Units, signs, columns, clocks: the reason names the contradiction."""
    change, words = UNEXAMINED[name]
    code, output = asked(written(tmp_path / "log.csv", change(dict(good()))))
    assert code == 3
    assert "cannot_examine" in output
    assert words in output


@pytest.mark.parametrize("content", ["", "\n\n", "hello", "a;b;c\n1;2;3", "\x00\x01\x02" * 50])
def test_what_is_no_table_is_refused(tmp_path: Path, content: str) -> None:
    """Empty files, other separators, bytes: one message."""
    file = tmp_path / "log.csv"
    file.write_text(content)
    code, output = asked(file)
    assert code == 2
    assert "log.csv" in output


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """A misspelt name and an unknown ending get a message."""
    assert "cannot be read" in asked(tmp_path / "missing.csv")[1]
    assert "unknown ending" in asked(written(tmp_path / "log.xls", dict(good())))[1]
    code, output = asked(written(tmp_path / "log.csv", dict(good())), "--channel", "position")
    assert code == 2
    assert "write CHANNEL=NAME" in output


def test_a_damaged_file_leaves_no_traceback(tmp_path: Path) -> None:
    """In a process of its own: one line, exit code 2, nothing else but that it takes its time."""
    file = tmp_path / "log.mf4"
    file.write_bytes(b"MDF     4.10    LOGG" + bytes(range(256)) * 4)
    done = subprocess.run(
        [sys.executable, "-m", "hil_emulator", "identify", str(KNEE), str(file)],
        capture_output=True, text=True, timeout=120, env=dict(os.environ), check=False,
    )  # fmt: skip
    assert done.returncode == 2
    printed = (done.stdout + done.stderr).strip().splitlines()
    lines = [line for line in printed if not line.startswith("identify; ")]
    assert len(lines) == 1, lines
    assert lines[0].startswith(f"hil-emulator: {file}")


@pytest.mark.parametrize("hidden", [{}, {"overlap_lap": 5e-4}, {"film_lag_strength": 0.6},
                                    {"harmonic_force_amplitude": 1000.0}])  # fmt: skip
def test_a_sound_recording_contradicts_nothing(hidden: dict[str, float]) -> None:
    """No effect, however large, looks like a wrong unit, a wrong column or two clocks."""
    train, other = campaign(hidden)
    assert contradictions([*train, *other], knee_model().plant_values) == []

"""How people head the columns of a log: names, units, gauge pressures, shares and volts."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from hil_emulator.api.logs import Meaning, experiments, pairs
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import fault
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.units import to_si
from tests.identify.rig_data import knee

COUNT = 100
RAMP = np.arange(COUNT) + 10.0


def read(folder: Path, *heads: str, **stated: object) -> Experiment:
    """Return a log whose columns of a ramp have the given headings, after one of time."""
    heads = heads if any(h.lower().startswith("t") for h in heads) else ("time [s]", *heads)
    rows = [[f"{k * 1e-3:g}", *([f"{k + 10:g}"] * (len(heads) - 1))] for k in range(COUNT)]
    file = folder / "log.csv"
    file.write_text("\n".join(",".join(row) for row in [heads, *rows]))
    (e,) = experiments([file], knee(), Meaning(**stated))  # type: ignore[arg-type]
    return e


@pytest.mark.parametrize(
    "head", ["Pressure A [bar]", "pressureA [bar]", "PRESSURE-A (bar)", "p_A [bar]", "pA_bar"]
)
def test_names_are_known_however_they_are_written(tmp_path: Path, head: str) -> None:
    """Without regard to case, blanks, hyphens and underscores, and by the usual symbols."""
    e = read(tmp_path, head, "Position [mm]")
    np.testing.assert_allclose(e.readings["pressure_a"], RAMP * 1e5)


def test_an_exact_name_goes_before_one_that_is_like_it(tmp_path: Path) -> None:
    """A filtered copy under a similar name does not replace the channel."""
    e = read(tmp_path, "pressure_a [bar]", "Pressure A [MPa]", "position [mm]")
    np.testing.assert_allclose(e.readings["pressure_a"], RAMP * 1e5)


def test_a_near_miss_is_suggested(tmp_path: Path) -> None:
    """A misspelt channel next to a known one is not left out without a note."""
    e = read(tmp_path, "presure_a [bar]", "position [mm]")
    assert any('--channel "pressure_a=presure_a"' in note for note in e.notes)


@pytest.mark.parametrize(
    ("unit", "zero", "one"),
    [
        ("barg", 101325.0, 1e5), ("bar(g)", 101325.0, 1e5), ("bara", 0.0, 1e5),
        ("bar(a)", 0.0, 1e5), ("psig", 101325.0, 6894.757293168361),
        ("psia", 0.0, 6894.757293168361), ("kPa(g)", 101325.0, 1e3),
    ],
)  # fmt: skip
def test_gauge_pressures_count_from_the_atmosphere(
    tmp_path: Path, unit: str, zero: float, one: float
) -> None:
    """In logs and in configurations."""
    e = read(tmp_path, f"pressure_a [{unit}]", "position [mm]")
    np.testing.assert_allclose(e.readings["pressure_a"], zero + RAMP * one)
    assert to_si(f"160 {unit}", "Pa") == pytest.approx(zero + 160.0 * one)
    with pytest.raises(ValueError, match="length"):
        to_si(f"160 {unit}", "m")


@pytest.mark.parametrize("gauge", ["barg", "bar(g)", "bar"])
def test_a_pressure_difference_has_no_gauge_offset(gauge: str) -> None:
    """5 bar(g) more than another pressure are 5 bar more; a pressure itself counts from 1 atm."""
    assert to_si(f"5 {gauge}", "Pa", difference=True) == pytest.approx(5e5)
    assert fault("pressure_a", "offset", value=f"5 {gauge}").values == {"value": 5e5}
    assert fault("supply", "droop", drop=f"5 {gauge}").values == {"drop": 5e5}
    absolute = 5e5 + 101325.0 * (gauge != "bar")
    assert fault("supply", "loss", pressure=f"5 {gauge}").values == {"pressure": absolute}


@pytest.mark.parametrize(("unit", "asked"), [("bar", True), ("bar(g)", False)])
def test_a_pressure_near_zero_gets_a_note(tmp_path: Path, unit: str, asked: bool) -> None:
    """One bar off is the usual mistake."""
    rows = [f"{k * 1e-3},{0.01 * k},{40 + k}" for k in range(COUNT)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join([f"time [s],pressure_a [{unit}],position [mm]", *rows]))
    (e,) = experiments([file], knee(), Meaning())
    assert any("gauge" in note for note in e.notes) == asked


def test_a_set_point_in_percent_or_volts(tmp_path: Path) -> None:
    """100 %, or the full scale, is the rated current; what is not stated is asked for."""
    percent = read(tmp_path, "valve_current [%]", "position [mm]", rated_current=0.02)
    np.testing.assert_allclose(percent.current, RAMP * 0.02 / 100)
    stated = {"rated_current": 0.01, "full_scale": 10.0}
    volts = read(tmp_path, "valve_current [V]", "position [mm]", **stated)
    np.testing.assert_allclose(volts.current, RAMP * 0.01 / 10)
    with pytest.raises(UserError, match="--rated-current"):
        read(tmp_path, "valve_current [%]", "position [mm]")
    with pytest.raises(UserError, match="--full-scale"):
        read(tmp_path, "valve_current [V]", "position [mm]", rated_current=0.01)


@pytest.mark.parametrize("head", ["Rod", "Rod [inch]"])
def test_a_unit_can_be_stated_for_any_channel(tmp_path: Path, head: str) -> None:
    """A statement of the user replaces that of the file."""
    names, units = pairs(["position=Rod [mm]"])
    e = read(tmp_path, head, names=names, units=units)
    np.testing.assert_allclose(e.readings["position"], RAMP * 1e-3)


def test_a_time_called_otherwise_has_the_unit_of_its_name(tmp_path: Path) -> None:
    """`t_ms` that is stated to be the time is in ms."""
    rows = [f"{k},{40 + k}" for k in range(COUNT)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["t_ms,position [mm]", *rows]))
    (e,) = experiments([file], knee(), Meaning(names={"t_ms": "time"}))
    assert e.period == pytest.approx(1e-3)


@pytest.mark.parametrize("name", ["time", "t", "tout"])
def test_a_time_of_matlab_is_in_seconds(tmp_path: Path, name: str) -> None:
    """Its name holds no unit; a note names the column."""
    file = tmp_path / "log.mat"
    scipy.io.savemat(file, {name: np.arange(COUNT) * 1e-3, "position_mm": RAMP})
    (e,) = experiments([file], knee(), Meaning())
    assert e.period == pytest.approx(1e-3)
    assert any("taken for the time in s" in note for note in e.notes)


def test_a_missing_unit_gets_the_option_that_states_it(tmp_path: Path) -> None:
    """A vector of MATLAB has no heading: the way out is an option."""
    file = tmp_path / "log.mat"
    scipy.io.savemat(file, {"time": np.arange(COUNT) * 1e-3, "position": RAMP})
    with pytest.raises(UserError, match=r'--channel "position=position \[mm\]"'):
        experiments([file], knee(), Meaning())


@pytest.mark.parametrize(
    "cell",
    ["{:.2f}", "{:,.2f}", "{:,.2f} "],
)
@pytest.mark.parametrize("marks", [",.", ".,", "',", " ,", "'."])
def test_thousands_may_be_separated(tmp_path: Path, cell: str, marks: str) -> None:
    """3.605,00 and 3,605.00 are 3605, as 3605 is."""
    swap = str.maketrans({",": marks[0], ".": marks[1]})
    rows = [f"{k};{cell.format(950.0 + k).translate(swap)}" for k in range(COUNT)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["time [ms];pressure_a [kPa]", *rows]))
    (e,) = experiments([file], knee(), Meaning())
    np.testing.assert_allclose(e.readings["pressure_a"], (950.0 + np.arange(COUNT)) * 1e3)


def test_a_column_of_text_is_refused(tmp_path: Path) -> None:
    """A column of text is not taken for a channel with missing values."""
    rows = [f"{k},{40 + k},{'high' if k % 5 else 7}" for k in range(COUNT)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["time [ms],position [mm],pressure_a [bar]", *rows]))
    with pytest.raises(UserError, match='"pressure_a" holds text in most of its rows'):
        experiments([file], knee(), Meaning())

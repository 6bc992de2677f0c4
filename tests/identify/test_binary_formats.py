"""Files of LabVIEW, Excel and MATLAB, written by independent writers: the same values exactly."""

import sys
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import nptdms
import numpy as np
import openpyxl
import pytest
import scipy.io

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.measured.formats import matlab

COUNT = 120
TIME = np.arange(COUNT) * 0.01
POSITION = 40.0 + np.sin(3.0 * TIME)
FORCE = 100.0 * np.cos(3.0 * TIME)


def read(file: Path, *headings: str) -> tuple[str, ...]:
    """Read a file, compare its values, and return the notes."""
    (e,) = load_experiments([file], headings=headings)
    assert e.period == pytest.approx(0.01)
    np.testing.assert_allclose(e.readings["position"], POSITION * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(e.readings["load_force"], FORCE, rtol=1e-12)
    return e.notes


@pytest.mark.parametrize("waveform", [True, False])
def test_tdms(tmp_path: Path, waveform: bool) -> None:
    """Times come from the waveforms' rate, or from a channel of times."""
    file = tmp_path / "log.tdms"
    rate = {"wf_increment": 0.01, "wf_start_offset": 0.0} if waveform else {}
    channels = [
        nptdms.ChannelObject("DAQ", "position", POSITION, {"unit_string": "mm", **rate}),
        nptdms.ChannelObject("DAQ", "load_force [N]", FORCE, rate),
        nptdms.ChannelObject("DAQ", "remark", ["a", "b"]),
    ]
    if not waveform:
        stamps = np.datetime64("2026-03-04T05:06:07") + (TIME * 1e6).round().astype("m8[us]")
        channels.append(nptdms.ChannelObject("DAQ", "time", stamps))
    with nptdms.TdmsWriter(file) as writer:
        writer.write_segment(channels)
    notes = read(file)
    assert any("time from the sample rate" in note for note in notes) == waveform


@pytest.mark.parametrize("dated", [True, False])
def test_xlsx(tmp_path: Path, dated: bool) -> None:
    """The first sheet with a table, units in the row below the names, times as Excel's dates."""
    book = openpyxl.Workbook()
    book.active.title = "Cover"
    sheet = book.create_sheet("Data")
    sheet.append(["Time", "Position", "load_force"])
    sheet.append(["s", "mm", "N"])
    begin = datetime(2026, 3, 4, 5, 6, 7)
    for t, x, f in zip(TIME.tolist(), POSITION.tolist(), FORCE.tolist(), strict=True):
        sheet.append([begin + timedelta(seconds=round(t, 6)) if dated else t, x, f])
    file = tmp_path / "log.xlsx"
    book.save(file)
    notes = read(file)
    assert any('sheet "Data"' in note for note in notes)
    assert "units in row 2" in notes


@pytest.mark.parametrize("form", ["5", "4"])
def test_mat(tmp_path: Path, form: str) -> None:
    """Vectors of the workspace, their units at the end of their names."""
    file = tmp_path / "log.mat"
    content = {"time_s": TIME, "position_mm": POSITION, "load_force_N": FORCE, "rate": 100.0}
    scipy.io.savemat(file, content, format=form)
    read(file)


def test_mat_structures_with_units(tmp_path: Path) -> None:
    """A structure of vectors, and one of their units."""
    file = tmp_path / "log.mat"
    scipy.io.savemat(file, {
        "log": {"time": TIME, "position": POSITION, "load_force": FORCE},
        "units": {"time": "s", "position": "mm", "load_force": "N"},
    })  # fmt: skip
    read(file)


def test_mat_matrix(tmp_path: Path) -> None:
    """The columns of a matrix are named by the user."""
    file = tmp_path / "log.mat"
    scipy.io.savemat(file, {"data": np.column_stack([TIME, POSITION, FORCE])})
    with pytest.raises(UserError, match="holds no vectors; name the columns"):
        load_experiments([file])
    read(file, "time [s]", "position [mm]", "load_force [N]")


def test_mat_of_version_7_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HDF5 as MATLAB writes it: a block of 512 bytes, vectors as columns, classes in attributes."""
    file = tmp_path / "log.mat"
    with h5py.File(file, "w", userblock_size=512) as out:
        for name, values in (("time_s", TIME), ("position_mm", POSITION), ("load_force_N", FORCE)):
            out.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = b"double"
    with file.open("r+b") as stream:
        head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Wed Mar  4 05:06:07 2026"
        stream.write(head.ljust(124) + b"\x00\x02IM")
    read(file)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UserError, match=r"needs h5py.*pip install 'hil-emulator\[logs\]'"):
        matlab.read(file)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{point}
Multi_Headings\tNo
X_Columns\t{x}
Time_Pref\tRelative
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t60\t60\t
Date\t2026/03/04\t2026/03/04\t
Time\t05:06:07\t05:06:07\t
Y_Unit_Label\tmm\tN\t
X_Dimension\tTime\tTime\t
X0\t0\t0\t
Delta_X\t0{point}01\t0{point}01\t
***End_of_Header***\t\t\t
{heads}
"""
"""The header as NI's "Specification for the LabVIEW Measurement File" lays it out."""


@pytest.mark.parametrize("point", [".", ","])
@pytest.mark.parametrize("columns", ["One", "No", "Multi"])
def test_lvm(tmp_path: Path, point: str, columns: str) -> None:
    """One column of times, no such column, or one per channel; decimal points or commas."""
    heads = {"One": "X_Value\tposition\tload_force", "No": "\tposition\tload_force",
             "Multi": "X_Value\tposition\tX_Value\tload_force"}[columns]  # fmt: skip
    rows = []
    for t, x, f in zip(TIME.tolist(), POSITION.tolist(), FORCE.tolist(), strict=True):
        cells = {"One": [t, x, f], "No": ["", x, f], "Multi": [t, x, t, f]}[columns]
        rows.append("\t".join(c if c == "" else repr(c) for c in cells).replace(".", point))
    file = tmp_path / "log.lvm"
    file.write_text(
        LVM.format(point=point, x=columns, heads=f"{heads}\tComment") + "\n".join(rows) + "\n"
    )
    assert any("LabVIEW measurement, 1 segments" in note for note in read(file))


def test_lvm_of_two_segments(tmp_path: Path) -> None:
    """Segments of the same channels follow each other in time."""
    text = ""
    for part in (slice(0, 60), slice(60, None)):
        body = LVM.format(point=".", x="One", heads="X_Value\tposition\tload_force\tComment")
        body = body if not text else body[body.index("Channels") :]
        rows = zip(TIME[part].tolist(), POSITION[part].tolist(), FORCE[part].tolist(), strict=True)
        text += body + "".join(f"{t!r}\t{x!r}\t{f!r}\n" for t, x, f in rows) + "\n"
    file = tmp_path / "log.lvm"
    file.write_text(text)
    assert any("2 segments" in note for note in read(file))


@pytest.mark.parametrize(("ending", "module", "package"), [
    (".tdms", "nptdms", "npTDMS"), (".xlsx", "openpyxl", "openpyxl"),
])  # fmt: skip
def test_a_missing_package_is_named_with_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, module: str, package: str
) -> None:
    """Without the optional package there is one message, with what to install."""
    file = tmp_path / f"log{ending}"
    file.write_bytes(b"something")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UserError, match=rf"{package}.*pip install 'hil-emulator\[logs\]'"):
        load_experiments([file])


@pytest.mark.parametrize("ending", [".tdms", ".xlsx", ".mat", ".lvm"])
@pytest.mark.parametrize("content", [
    b"", b"PK\x03\x04rubbish", b"TDSm" + b"\x0e" * 40, b"\x00" * 200,
    b"LabVIEW Measurement\t\nSeparator\tTab\n",
])  # fmt: skip
def test_a_damaged_file_is_refused(tmp_path: Path, ending: str, content: bytes) -> None:
    """Any damage gives one message that names the file."""
    file = tmp_path / f"log{ending}"
    file.write_bytes(content)
    with pytest.raises(UserError, match=r"log\."):
        load_experiments([file])

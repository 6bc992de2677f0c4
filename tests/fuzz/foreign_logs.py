"""Sound logs as other benches write them, each by the writer of its own makers or friends."""

import io

import h5py
import nptdms
import numpy as np
import openpyxl
import scipy.io

TIME = np.arange(120) * 0.01
COLUMNS = {"time": TIME, "position": 40.0 + np.sin(3.0 * TIME), "load_force": np.cos(3.0 * TIME)}
UNITS = {"time": "s", "position": "mm", "load_force": "N"}


def foreign_logs() -> dict[str, list[bytes]]:
    """Return their contents by ending."""
    return {
        "xlsx": [_excel()],
        "tdms": [_labview()],
        "lvm": [_labview_text()],
        "mat": [_matlab(), _matlab_hdf5()],
        "txt": [_german()],
    }


def _excel() -> bytes:
    book, out = openpyxl.Workbook(), io.BytesIO()
    for row in (COLUMNS, UNITS.values(), *zip(*COLUMNS.values(), strict=True)):
        book.active.append(list(row))
    book.save(out)
    return out.getvalue()


def _labview() -> bytes:
    out = io.BytesIO()
    with nptdms.TdmsWriter(out) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("DAQ", n, v, {"unit_string": UNITS[n], "wf_increment": 0.01})
                for n, v in COLUMNS.items()
                if n != "time"
            ]
        )
    return out.getvalue()


def _labview_text() -> bytes:
    lines = [
        *("LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t."),
        *("X_Columns\tOne", "***End_of_Header***", "", "Channels\t2", "Samples\t120\t120"),
        *("Y_Unit_Label\tmm\tN", "X0\t0\t0", "Delta_X\t0.01\t0.01", "***End_of_Header***"),
        "X_Value\tposition\tload_force\tComment",
    ]
    rows = zip(*COLUMNS.values(), strict=True)
    return "\r\n".join([*lines, *("\t".join(map(str, row)) for row in rows)]).encode()


def _matlab() -> bytes:
    out = io.BytesIO()
    scipy.io.savemat(out, COLUMNS | {"units": UNITS})
    return out.getvalue()


def _matlab_hdf5() -> bytes:
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512) as file:
        for name, values in COLUMNS.items():
            file[f"{name}_{UNITS[name]}"] = values[:, None]
    return b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + out.getvalue()[128:]


def _german() -> bytes:
    header = ";".join(f"{name} ({unit})" for name, unit in UNITS.items())
    rows = (
        ";".join(f"{v:.6f}".replace(".", ",") for v in r)
        for r in zip(*COLUMNS.values(), strict=True)
    )
    return "\r\n".join([header, *rows]).encode("latin-1")

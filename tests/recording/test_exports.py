"""The formats of other tools, read back by those tools."""

import csv
import json
import re
import struct
import subprocess
import sys
from pathlib import Path

import asammdf
import can
import cantools
import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from hil_emulator.commands.export import contents
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.recording.exports import check_file, export, formats_by_ending, write
from hil_emulator.recording.journal import Recording

KNEE = shipped("configs/hyq_knee.toml")


def written(journal: Path, folder: Path, ending: str) -> Path:
    """Return the journal in another format."""
    file = folder / f"run{ending}"
    export(journal, file)
    return file


def test_pandas_reads_the_same_values_from_parquet(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Every column bit for bit; units and origin are inside."""
    import pyarrow.parquet

    file = written(journal, tmp_path, ".parquet")
    frame = pd.read_parquet(file)
    assert list(frame.columns) == list(recording.units)
    assert len(recording.units) >= 30
    assert frame.to_numpy().tobytes() == recording.rows.tobytes()
    schema = pyarrow.parquet.read_schema(file)
    assert schema.field("pressure_a").metadata == {b"unit": b"Pa"}
    assert schema.metadata[b"digest"].decode() == recording.provenance["digest"]


def test_asammdf_reads_the_same_values_from_mf4(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Every channel bit for bit, on the emulator's time base, with its unit."""
    with asammdf.MDF(written(journal, tmp_path, ".mf4")) as mdf:
        for name, values in recording.table().items():
            if name != "time":
                signal = mdf.get(name)
                assert signal.samples.tobytes() == values.tobytes()
                assert signal.timestamps.tobytes() == recording.table()["time"].tobytes()
                assert signal.unit == recording.units[name]
        assert recording.provenance["digest"] in mdf.header.comment


def test_numpy_reads_the_same_values_from_npz(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Every column bit by bit, with units and provenance."""
    with np.load(written(journal, tmp_path, ".npz")) as data:
        for name, values in recording.table().items():
            assert data[name].tobytes() == values.tobytes()
        assert dict(data["provenance"].tolist()) == recording.provenance


def test_scipy_reads_the_same_values_from_mat(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Every signal is a column, bit for bit; those of the model are fields, as are all units."""
    file = written(journal, tmp_path, ".mat")
    data, flat = (loadmat(file, simplify_cells=simple) for simple in (False, True))
    ticks = len(recording.rows)
    for name, values in recording.table().items():
        place, _, last = name.rpartition(".")
        columns, units = (flat[place], flat["units"][place]) if place else (flat, flat["units"])
        assert columns[last].tobytes() == values.tobytes()
        assert units[last] == recording.units[name]
    assert data["position"].shape == (ticks, 1)
    assert data["model"]["position"][0, 0].shape == (ticks, 1)
    assert flat["provenance"]["digest"] == recording.provenance["digest"]


def test_names_in_mat_are_names_in_matlab(journal: Path, tmp_path: Path) -> None:
    """MATLAB allows letters, digits and underscores, at most 63 of them (namelengthmax)."""
    flat = loadmat(written(journal, tmp_path, ".mat"), simplify_cells=True)
    inner = [name for value in flat.values() if isinstance(value, dict) for name in value]
    outer = [name for name in flat if not name.startswith("__")]  # of the file, not in it
    wrong = [n for n in [*outer, *inner] if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", n)]
    assert {"time", "model", "units", "provenance"} <= set(outer)
    assert wrong == []


def test_csv_has_nine_digits_units_and_origin(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """A comment per line of origin, then a header with units, then a line per tick."""
    lines = written(journal, tmp_path, ".csv").read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert f"# seed: {recording.provenance['seed']}" in comments
    rows = list(csv.reader(lines[len(comments) :]))
    assert rows[0][:2] == ["time [s]", "valve_current [A]"]
    values = np.array(rows[1:], float)
    np.testing.assert_allclose(values, recording.rows, rtol=1e-8)


@pytest.mark.parametrize("ending", [".blf", ".asc", ".log"])
def test_python_can_reads_the_same_frames(
    journal: Path, recording: Recording, tmp_path: Path, ending: str
) -> None:
    """Every frame with its time and direction, in the order of the bus."""
    export(journal, tmp_path / f"run{ending}", directions=True)
    with can.LogReader(str(tmp_path / f"run{ending}")) as reader:
        frames = [
            (round(m.timestamp * 1e6), not m.is_rx, m.arbitration_id, bytes(m.data)) for m in reader
        ]
    assert frames == [(t // 1000, sent, f.can_id, f.data) for t, sent, f in recording.frames]


def test_candumps_log_is_that_of_can_utils(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """No line ends in a direction, at which Wireshark's reader of such logs stops."""
    lines = written(journal, tmp_path, ".log").read_text().splitlines()
    assert len(lines) == len(recording.frames)
    pattern = re.compile(r"\(\d+\.\d{6}\) can0 [0-9A-F]{3}#(R|([0-9A-F]{2})*)")
    assert all(map(pattern.fullmatch, lines))


def test_pcapng_is_what_its_standard_says(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Blocks by the draft of the IETF, packets by LINKTYPE_CAN_SOCKETCAN, read byte by byte."""
    data = written(journal, tmp_path, ".pcapng").read_bytes()
    blocks, at = [], 0
    while at < len(data):
        kind, size = struct.unpack_from("<II", data, at)
        assert size % 4 == 0
        assert struct.unpack_from("<I", data, at + size - 4)[0] == size
        blocks.append((kind, data[at + 8 : at + size - 4]))
        at += size
    (section, head), (interface, link), *packets = blocks
    assert (section, interface) == (0x0A0D0D0A, 1)
    assert struct.unpack_from("<IHH", head) == (0x1A2B3C4D, 1, 0)
    assert recording.provenance["digest"].encode() in head
    assert struct.unpack_from("<HHIHHB", link) == (227, 0, 0, 9, 1, 9)
    frames = []
    for kind, body in packets:
        assert kind == 6
        _, high, low, size, _ = struct.unpack_from("<IIIII", body)
        identifier, length = struct.unpack_from(">IB", body, 20)
        code, _, way = struct.unpack_from("<HHI", body, 20 + size + -size % 4)
        assert code == 2
        frames.append(((high << 32) + low, way == 2, identifier, body[28 : 28 + length]))
    assert frames == [(t, sent, f.can_id, f.data) for t, sent, f in recording.frames]


def test_cantools_decodes_what_the_sensors_reported(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """BLF decoded with its DBC gives the readings of the recording, to the PDO's resolution."""
    file = written(journal, tmp_path, ".blf")
    database = cantools.database.load_file(file.with_suffix(".dbc"))
    decoded: dict[str, list[float]] = {}
    with can.LogReader(str(file)) as reader:
        for m in reader:
            if m.arbitration_id in (0x185, 0x285, 0x385):
                for name, value in database.decode_message(m.arbitration_id, m.data).items():
                    decoded.setdefault(name, []).append(value)
    resolution = {"pressure_a": 1e3, "pressure_b": 1e3, "supply_pressure": 1e3}
    resolution |= {"position": 1e-7, "load_force": 1e-3}
    for name, step in resolution.items():
        readings = recording.table()[name][-len(decoded[name]) :]
        np.testing.assert_allclose(decoded[name], readings, rtol=0, atol=0.501 * step)


def test_the_database_of_a_log_is_the_exported_one(journal: Path, tmp_path: Path) -> None:
    """PDOs are described as by `hil-emulator export`; only the node's name is shorter."""
    (tmp_path / "bus.dbc").write_text(contents(load_machine([KNEE]))["bus.dbc"])
    written(journal, tmp_path, ".log")
    of_log, exported = (
        {
            m.frame_id: (m.length, m.cycle_time, m.comment, [repr(s) for s in m.signals])
            for m in cantools.database.load_file(tmp_path / name).messages
        }
        for name in ("run.dbc", "bus.dbc")
    )
    assert of_log == exported
    assert len(of_log) >= 4


def test_a_run_does_not_wait_for_cantools(tmp_path: Path) -> None:
    """Neither the check of a file name nor the writer process imports it."""
    code = (
        "import sys; from pathlib import Path\n"
        "from hil_emulator.recording import recorder, writer_process\n"
        "from hil_emulator.recording.exports import check_file\n"
        "check_file(Path('run.blf')); sys.exit('cantools' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)


@pytest.mark.parametrize("ending", [".blf", ".asc"])
def test_a_frame_log_names_its_origin(
    journal: Path, recording: Recording, tmp_path: Path, ending: str
) -> None:
    """The digest stands in the file as a remark."""
    data = written(journal, tmp_path, ending).read_bytes()
    if ending == ".blf":
        import zlib

        at = data.index(b"\x78\x9c")  # the first compressed container
        data = zlib.decompressobj().decompress(data[at:])
    assert recording.provenance["digest"].encode() in data


def test_candump_logs_have_their_provenance_in_a_second_file(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """That format has no room for remarks."""
    file = written(journal, tmp_path, ".log")
    provenance = json.loads(file.with_name("run.log.json").read_text())
    assert provenance == recording.provenance


def test_a_file_that_cannot_be_is_refused_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unknown endings, missing folders and missing extras are named with their remedy."""
    with pytest.raises(UserError, match=r"unknown ending; .*\.rec, \.csv"):
        check_file(tmp_path / "run.xls")
    with pytest.raises(UserError, match="does not exist; make it first"):
        check_file(tmp_path / "nowhere" / "run.csv")
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(UserError, match=r"pip install 'hil-emulator\[recording\]'"):
        check_file(tmp_path / "run.mf4")


@pytest.mark.parametrize("ending", formats_by_ending())
def test_a_format_declares_all_that_it_writes(journal: Path, tmp_path: Path, ending: str) -> None:
    """A format lists every file that it writes, so that existing files are not overwritten."""
    file = tmp_path / f"run{ending}"
    write(journal, file)
    assert {*tmp_path.iterdir()} == {file, *formats_by_ending()[ending].companions(file)}


def test_formats_share_what_comes_with_both(journal: Path, tmp_path: Path) -> None:
    """Two logs of one name have one database; either all files are written or no file."""
    files = tmp_path / "run.blf", tmp_path / "run.asc"
    export(journal, *files)
    made = {*files, tmp_path / "run.dbc"}
    assert {*tmp_path.iterdir()} == made
    for file in made:
        file.write_text("mine")
    (tmp_path / "run.asc").unlink()
    with pytest.raises(UserError, match=r"run\.blf: exists already"):
        export(journal, *files)
    assert not (tmp_path / "run.asc").exists()
    export(journal, *files, overwrite=True)
    assert all(file.read_bytes() != b"mine" for file in made)

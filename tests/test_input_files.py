"""Files that would eat the machine are refused before anything parses them."""

import base64
import json
import os
import struct
import subprocess
import sys
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet
import pytest

from hil_emulator import input_files
from hil_emulator.bus import frame_log
from hil_emulator.captures import by_database
from hil_emulator.config.load import load
from hil_emulator.config.toml_file import DEEPEST, read_toml
from hil_emulator.device.eds import load as eds
from hil_emulator.errors import UserError
from hil_emulator.identify.experiment_design import sealed
from hil_emulator.identify.measured.reading import read
from hil_emulator.panel.result_folder import result_of, traces_of
from hil_emulator.recording import journal
from hil_emulator.scenario import loading

READERS: dict[str, Callable[[Path], object]] = {
    "toml": lambda file: load([file]),
    "scenario.toml": loading.load,
    "eds": lambda file: eds.load(file, 5),
    "dcf": eds.commissioned,
    "dbc": lambda file: by_database.from_file(file, {}),
    "arxml": lambda file: by_database.from_file(file, {}),
    **dict.fromkeys(
        ("csv", "txt", "xlsx", "mat", "npz", "lvm", "tdms", "parquet", "mf4"), read
    ),
    **dict.fromkeys(("blf", "asc", "log"), lambda file: list(frame_log.captured(file))),
    "rec": journal.read,
    "json": result_of,
    "traces.npz": traces_of,
}  # fmt: skip
"""What reads a file, by its ending."""


@pytest.mark.parametrize("ending", READERS)
def test_what_may_never_end_is_not_read(tmp_path: Path, ending: str) -> None:
    """A device and a pipe are refused with the way out, by every reader."""
    device, pipe = tmp_path / f"device.{ending}", tmp_path / f"pipe.{ending}"
    device.symlink_to("/dev/zero")
    os.mkfifo(pipe)
    for file in (device, pipe):
        with pytest.raises(UserError, match="not a regular file; save what it gives"):
            READERS[ending](file)


@pytest.mark.parametrize("ending", READERS)
def test_a_file_larger_than_its_kind_needs_is_not_read(tmp_path: Path, ending: str) -> None:
    """The message names size, limit and remedy; the content is not read."""
    file = tmp_path / f"large.{ending}"
    with file.open("wb") as out:
        out.truncate(9 * input_files.GIB)
    with pytest.raises(UserError, match=r"has 9 GiB; a .* may have .* [GM]iB: \w+"):
        READERS[ending](file)


def test_a_key_of_many_parts_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    """Twenty thousand parts of a key need 1.8 GB in `tomllib`, 40 KB in the file."""
    file = tmp_path / "deep.toml"
    for spelt in ("a." * 20_000, '"a" . ' * 20_000, "[" + "x.'y'." * 10_000):
        file.write_text(f"{spelt}a = 1\n")
        tracemalloc.start()
        with pytest.raises(UserError, match=f"nested more than {DEEPEST} levels"):
            read_toml(file, "configuration")
        assert tracemalloc.get_traced_memory()[1] < 10 * input_files.MIB
        tracemalloc.stop()


def test_a_text_with_many_dots_is_no_deep_key(tmp_path: Path) -> None:
    """A sentence with ellipses, a version and a path are values, and so is a key of usual depth."""
    file = tmp_path / "flat.toml"
    file.write_text('a.b.c.d = "1.2.3.4.5.6.7.8.9.10.11.12.13.14.15.16.17.18.19.20"\nx = "... ..."')
    content = read_toml(file, "configuration")
    assert content["a"]["b"]["c"]["d"].endswith("19.20")


def npz(file: Path, shape: str, content: bytes, name: str = "position.npy") -> Path:
    """Write an archive whose array states a shape."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + content
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, array)
    return file


@pytest.mark.parametrize("shape", ["(100000000000,)", "(-1,)", "(-1, -2)", "(3,)", "(0, 10)"])
@pytest.mark.parametrize("reader", [read, traces_of])
def test_an_array_is_as_large_as_its_bytes(
    tmp_path: Path, shape: str, reader: Callable[[Path], object]
) -> None:
    """One that states more is refused before memory is reserved for it."""
    with pytest.raises(UserError, match=r"states .* values of float64, and has 16 bytes"):
        reader(npz(tmp_path / "claims.npz", shape, bytes(16)))


def restated(file: Path, size: int) -> Path:
    """Write another unpacked size of its only member into an archive's directory."""
    content = bytearray(file.read_bytes())
    entry = content.index(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = size.to_bytes(4, "little")
    file.write_bytes(content)
    return file


@pytest.mark.parametrize(("ending", "member"), [
    ("npz", "position.npy"), ("xlsx", "xl/workbook.xml"), ("traces.npz", "a/position|time.npy"),
])  # fmt: skip
def test_an_archive_that_unpacks_to_far_more_is_not_unpacked(
    tmp_path: Path, ending: str, member: str
) -> None:
    """What it states decides, against its own size."""
    file = restated(npz(tmp_path / f"bomb.{ending}", "(2,)", bytes(16), member), 2**30)
    with pytest.raises(UserError, match=r"states 1 GiB of content, .* may hold 512 MiB"):
        READERS[ending](file)


def test_a_member_unpacks_to_no_more_than_it_states(tmp_path: Path) -> None:
    """An archive that states less than it holds is cut there, and refused."""
    file = restated(npz(tmp_path / "lies.npz", "(1000000,)", bytes(8_000_000)), 1000)
    tracemalloc.start()
    with pytest.raises(UserError, match=r"Bad CRC-32|has \d+ bytes"):
        read(file)
    assert tracemalloc.get_traced_memory()[1] < 4 * input_files.MIB
    tracemalloc.stop()


def test_a_table_that_states_more_than_its_file_can_hold_is_refused(tmp_path: Path) -> None:
    """Of HDF5 and Parquet, whose empty or equal values need no bytes."""
    hdf, parquet = tmp_path / "empty.mat", tmp_path / "equal.parquet"
    with h5py.File(hdf, "w", userblock_size=512) as file:
        file.create_dataset("position_mm", (2**27, 1), "f8", chunks=(2**16, 1))
    content = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + hdf.read_bytes()[128:]
    hdf.write_bytes(content)
    table = pa.table({"position [mm]": pa.array(np.zeros(2**20, np.int8))})
    pyarrow.parquet.write_table(pa.concat_tables([table] * 80), parquet)
    for file in (hdf, parquet):
        with pytest.raises(UserError, match=r"states .* [GM]iB of content"):
            read(file)


def test_a_process_that_reads_has_limited_memory(tmp_path: Path) -> None:
    """A packed vector of MATLAB states no size that could be checked before it is unpacked."""
    (tmp_path / "small.mat").write_bytes(b"MATLAB")
    program = (
        "import sys, pathlib; from hil_emulator.identify.measured.formats import own_process as o;"
        "o._limit_memory(pathlib.Path(sys.argv[1])); bytearray(256 << 20); bytearray(4 << 30)"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "small.mat")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.stderr.strip().endswith("MemoryError")


def test_a_sheet_is_as_large_as_its_cells(tmp_path: Path) -> None:
    """A sheet that states 17 billion cells and has six is read as six."""
    file = tmp_path / "wide.xlsx"
    book = openpyxl.Workbook()
    for row in (("time [s]", "position [mm]"), (0.0, 1.0), (0.1, 2.0)):
        book.active.append(row)
    book.save(file)
    with zipfile.ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    members[sheet] = members[sheet].replace(b'ref="A1:B3"', b'ref="A1:XFD1048576"')
    assert b"XFD" in members[sheet]
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    assert len(read(file).series["position"].values) == 2


def test_a_packed_part_of_a_capture_is_bounded(tmp_path: Path) -> None:
    """Of a BLF container, whatever size it states."""
    packer = zlib.compressobj(1)
    packed = b"".join(packer.compress(bytes(input_files.MIB)) for _ in range(80)) + packer.flush()
    size = 32 + len(packed)
    container = struct.pack("<4sHHII", b"LOBJ", 16, 1, size, 10) + struct.pack("<H6xI4x", 2, 100)
    file = tmp_path / "bomb.blf"
    head = struct.pack("<4sIBBBBBBBBQQII8H8H", b"LOGG", 144, *[0] * 28).ljust(144, b"\0")
    file.write_bytes(head + container + packed + bytes(size % 4))
    with pytest.raises(UserError, match="a container unpacks to more than"):
        list(frame_log.captured(file))


def test_a_sealed_file_unpacks_to_no_more_than_it_may(tmp_path: Path) -> None:
    """A megabyte; the rest of it is not looked at."""
    packed = zlib.compress(b"[" + b" " * 30_000_000 + b"]", 9)
    (tmp_path / sealed.NAME).write_bytes(base64.b64encode(packed))
    with pytest.raises(UserError, match="is broken"):
        sealed.unseal(tmp_path)


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "[" * 65 + "]" * 65, '{"a":' * 5000, "{", "9" * 5000, "\ud800"]
)
def test_a_text_in_json_is_parsed_or_refused_as_a_value(text: str) -> None:
    """Whatever its depth: there is one kind of error."""
    with pytest.raises(ValueError, match=r"deep|Expecting|digits|delimiter"):
        input_files.parse_json(text)
    assert input_files.parse_json(json.dumps([[[1]]])) == [[[1]]]


def test_a_line_without_end_is_no_table(tmp_path: Path) -> None:
    """A text of one line is refused by its length, not split into cells."""
    file = tmp_path / "line.csv"
    file.write_text("," * 3_000_000)
    with pytest.raises(UserError, match="has a line of more than"):
        read(file)


def test_the_command_ends_with_one_message(tmp_path: Path) -> None:
    """In a process of its own: exit code 2, and one line that names the file."""
    file = tmp_path / "endless.toml"
    file.symlink_to("/dev/zero")
    ended = subprocess.run(
        [sys.executable, "-m", "hil_emulator", "check", str(file)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert str(file) in ended.stderr

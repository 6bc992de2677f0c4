"""Logs of frames as users have them: every format gives the same, whatever its ending."""

import gzip
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import can
import numpy as np
import pytest
from rigs import START, bench, reference, set_point

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.identify.measured.experiment import Experiment

TICKS = 120

Frames = Sequence[tuple[int, bool, Frame]]


@pytest.fixture(scope="module")
def frames() -> Frames:
    """Return a run with another set point in each tick."""
    random = np.random.default_rng(5)
    with bench(reference()) as rig:
        rig.ticks(2)
        rig.tick(START)
        for _ in range(TICKS):
            rig.tick(set_point(random.uniform(-2.0, 2.0)))
        return list(rig.recorder.frames)


@pytest.fixture(scope="module")
def wanted(frames: Frames, tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """Return the experiment from the log of `candump -L`."""
    return read(by_python_can(frames, tmp_path_factory.mktemp("wanted") / "run.log"))


def read(file: Path, **stated: object) -> Experiment:
    """Return the experiment of a file."""
    (e,) = experiments([file], reference(), Meaning(**stated))  # type: ignore[arg-type]
    return e


def same(e: Experiment, wanted: Experiment) -> None:
    """Compare all values."""
    assert e.period == pytest.approx(wanted.period)
    np.testing.assert_array_equal(e.current, wanted.current)
    for name, values in wanted.readings.items():
        np.testing.assert_array_equal(e.readings[name], values)


def messages(frames: Frames, channel: int | str = "can0") -> list[can.Message]:
    """Return frames as python-can has them."""
    return [
        can.Message(1.7e9 + now * 1e-9, f.can_id, f.extended, f.remote, data=f.data,
                    is_rx=not sent, channel=channel)
        for now, sent, f in frames
    ]  # fmt: skip


def by_python_can(frames: Frames, file: Path) -> Path:
    """Write a log in the format of a file's ending."""
    with can.Logger(str(file)) as log:
        for m in messages(frames, "can0" if ".log" in file.name else 0):
            log(m)
    return file


def text(file: Path, lines: Sequence[str], encoding: str = "utf-8") -> Path:
    """Write lines."""
    file.write_text("\n".join(lines) + "\n", encoding=encoding)
    return file


@pytest.mark.parametrize(
    "name", ["a.trc", "a.csv", "a.db", "a.asc", "a.blf", "a.mf4", "a.log.gz", "a.asc.gz"]
)
def test_the_formats_of_python_can(
    frames: Frames, wanted: Experiment, tmp_path: Path, name: str
) -> None:
    """Compressed or not, with raw frames in MDF."""
    same(read(by_python_can(frames, tmp_path / name)), wanted)


@pytest.mark.parametrize("name", ["run.txt", "run.dat", "run.csv"])
def test_the_content_decides(frames: Frames, wanted: Experiment, tmp_path: Path, name: str) -> None:
    """A log of frames with another ending is one all the same."""
    by_python_can(frames, tmp_path / "run.log").rename(tmp_path / name)
    same(read(tmp_path / name), wanted)


def test_a_table_called_like_a_log_of_frames_is_a_table(tmp_path: Path) -> None:
    """Data acquisition systems write `.asc` and `.dat`."""
    rows = [f"{k * 1e-3:g}\t{40 + 0.1 * k:g}" for k in range(100)]
    for ending in (".asc", ".dat", ".log"):
        e = read(text(tmp_path / f"daq{ending}", ["time [s]\tposition [mm]", *rows]))
        np.testing.assert_allclose(e.readings["position"], 0.04 + 1e-4 * np.arange(100))


def pcan(version: str, line: Callable[[int, float, can.Message], str]) -> Callable[[Frames], str]:
    """Return a writer of PCAN's trace."""
    head = [f";$FILEVERSION={version}", ";$STARTTIME=45244.5"]
    head += [";$COLUMNS=N,O,T,I,d,L,D"] if version == "2.0" else []
    return lambda frames: "\n".join(
        head + [line(i, (m.timestamp - 1.7e9) * 1e3, m) for i, m in enumerate(messages(frames), 1)]
    )


TRACES = {
    "1.1": pcan("1.1", lambda i, t, m: f"{i:6}) {t:11.1f}  Rx         {m.arbitration_id:04X}  "
                f"{m.dlc}    {m.data.hex(' ').upper()} "),
    "1.2": pcan("1.2", lambda i, t, m: f"{i:6}) {t:11.3f} 1  Rx         {m.arbitration_id:04X}  "
                f"{m.dlc}    {m.data.hex(' ').upper()} "),
    "1.3": pcan("1.3", lambda i, t, m: f"{i:6}) {t:11.3f} 1  Rx         {m.arbitration_id:04X} "
                f"-  {m.dlc}    {m.data.hex(' ').upper()} "),
    "2.0": pcan("2.0", lambda i, t, m: f"{i:7} {t:13.3f} DT     {m.arbitration_id:04X} Rx "
                f"{m.dlc}    {m.data.hex(' ').upper()} "),
}  # fmt: skip


@pytest.mark.parametrize("version", TRACES)
def test_traces_of_pcan(frames: Frames, wanted: Experiment, tmp_path: Path, version: str) -> None:
    """All versions whose times have the resolution for it."""
    file = tmp_path / "run.trc"
    file.write_text(TRACES[version](frames))
    same(read(file), wanted)


def screen(frames: Frames, times: str, extras: bool) -> list[str]:
    """Return what `candump -t a|A|d|z`, with `-x -a` or without, shows."""
    lines, before = [], 0.0
    for m in messages(frames):
        passed = m.timestamp - 1.7e9
        stamp = {
            "a": f"{m.timestamp:.6f}", "z": f"{passed:010.6f}", "d": f"{passed - before:010.6f}",
            "A": f"2023-11-14 22:13:{20 + passed:09.6f}",
        }[times]  # fmt: skip
        before = passed
        way = "  RX - -" if extras else ""
        shown = "   '........'" if extras else ""
        data = m.data.hex(" ").upper()
        lines.append(f" ({stamp})  can0{way}  {m.arbitration_id:03X}   [{m.dlc}]  {data}{shown}")
    return lines


@pytest.mark.parametrize("extras", [False, True])
@pytest.mark.parametrize("times", ["a", "A", "d", "z"])
def test_the_screen_of_candump(
    frames: Frames, wanted: Experiment, tmp_path: Path, times: str, extras: bool
) -> None:
    """Times absolute, relative or from frame to frame; direction and text next to the data."""
    same(read(text(tmp_path / "run.log", screen(frames, times, extras))), wanted)


def test_a_screen_without_times_is_refused(frames: Frames, tmp_path: Path) -> None:
    """The message names the option that brings them."""
    lines = [line.partition(")")[2] for line in screen(frames, "z", False)]
    with pytest.raises(UserError, match=r"line 1: has no time; log with candump -L"):
        read(text(tmp_path / "run.log", lines))


def savvy(frames: Frames) -> list[str]:
    """Return SavvyCAN's CSV."""
    rows = ["Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8"]
    for m in messages(frames):
        cells = [f"{b:02X}" for b in m.data] + [""] * (8 - m.dlc)
        stamp = round((m.timestamp - 1.7e9) * 1e6)
        rows.append(f"{stamp},{m.arbitration_id:08X},false,Rx,0,{m.dlc},{','.join(cells)}")
    return rows


def exported(frames: Frames) -> list[str]:
    """Return a table with all data in one cell, as analysers export it."""
    rows = ["Time [ms];Chn;ID;Dir;DLC;Data"]
    for m in messages(frames):
        stamp = f"{(m.timestamp - 1.7e9) * 1e3:.3f}".replace(".", ",")
        rows.append(f"{stamp};1;0x{m.arbitration_id:X};Rx;{m.dlc};{m.data.hex(' ')}")
    return rows


def busmaster(frames: Frames) -> list[str]:
    """Return BusMaster's log."""
    rows = ["***BUSMASTER Ver 3.2.2***", "***PROTOCOL CAN***", "***[START LOGGING SESSION]***"]
    for m in messages(frames):
        units = round((m.timestamp - 1.7e9) * 1e4)
        stamp = f"22:13:{20 + units // 10_000:02d}:{units % 10_000:04d}"
        data = m.data.hex(" ").upper()
        rows.append(f"{stamp} Rx 1 0x{m.arbitration_id:03X} s {m.dlc} {data} ")
    return rows


@pytest.mark.parametrize("form", [savvy, exported, busmaster])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_exports_of_other_tools(
    frames: Frames, wanted: Experiment, tmp_path: Path, form: Callable[[Frames], list[str]],
    encoding: str,
) -> None:  # fmt: skip
    """Text and CSV, in any usual encoding; a table of frames is called one."""
    e = read(text(tmp_path / "run.csv", form(frames), encoding))
    same(e, wanted)
    assert any("a table of frames" in n for n in e.notes) == (form is not busmaster)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_remarks_and_byte_order_marks(
    frames: Frames, wanted: Experiment, tmp_path: Path, encoding: str
) -> None:
    """Between the frames of a log there may be remarks."""
    lines = by_python_can(frames, tmp_path / "plain.log").read_text().splitlines()
    marked = ["# logged on the bench", *lines[:50], "; valve exchanged", "", *lines[50:]]
    same(read(text(tmp_path / "run.log", marked, encoding)), wanted)


@pytest.mark.parametrize("line", ["hello", "(1.0) can0 18#zz", "(1.0) can0 185#0"])
def test_a_line_that_is_no_frame_is_named(frames: Frames, tmp_path: Path, line: str) -> None:
    """By its number and its text, without a message of Python."""
    lines = by_python_can(frames, tmp_path / "plain.log").read_text().splitlines()
    with pytest.raises(UserError, match=r"run\.log: line 51: .*: '"):
        read(text(tmp_path / "run.log", [*lines[:50], line, *lines[50:]]))


def test_relative_times_of_vectors_text(frames: Frames, wanted: Experiment, tmp_path: Path) -> None:
    """Each counts from the event before it, be that a frame or not."""
    lines = ["date Tue Nov 14 10:13:20.123 PM 2023", "base hex  timestamps relative"]
    before = 0.0
    for i, m in enumerate(messages(frames)):
        passed = m.timestamp - 1.7e9
        if i % 10 == 5:
            between = before + 0.4 * (passed - before)
            lines.append(f"   {between - before:.9f} 1  Statistic: D 0 R 0")
            before = between
        lines.append(f"   {passed - before:.9f} 1  {m.arbitration_id:X}  Rx   d {m.dlc} "
                     f"{m.data.hex(' ').upper()}")  # fmt: skip
        before = passed
    same(read(text(tmp_path / "run.asc", lines)), wanted)


def test_one_channel_of_two_is_chosen(frames: Frames, wanted: Experiment, tmp_path: Path) -> None:
    """The message lists both with their traffic; by the name that it gives, one is read."""
    file = tmp_path / "two.blf"
    with can.Logger(str(file)) as log:
        for ours, theirs in zip(messages(frames, 0), messages(frames, 1), strict=True):
            theirs.data = bytes(theirs.dlc)
            log(ours)
            log(theirs)
    with pytest.raises(UserError, match=r"1 \(\d+ frames, \d+ identifiers\), 2 \(.*--bus 2"):
        read(file)
    same(read(file, bus="1"), wanted)
    with pytest.raises(UserError, match="--bus can7: there is no such channel"):
        read(file, bus="can7")


DATABASE = """VERSION ""
BU_: A B
BO_ 2566844926 P: 4 A
 SG_ pressure_a : 0|16@1+ (0.1,0) [0|0] "bar" B
 SG_ position : 16|16@1+ (0.01,0) [0|0] "mm" B
"""  # 0x18FEF1FE


def j1939(folder: Path, *identifiers: int) -> Path:
    """Write frames of some identifiers."""
    with can.Logger(str(folder / "j.log")) as log:
        for k in range(100):
            data = (600 + k).to_bytes(2, "little") + (4000 + k).to_bytes(2, "little")
            for i in identifiers:
                log(can.Message(k * 1e-3, i, True, data=data, channel="can0"))
    return folder / "j.log"


@pytest.mark.parametrize("identifier", [0x18FEF1FE, 0x18FEF105, 0x0CFEF105])
def test_a_parameter_group_of_any_source_and_priority(tmp_path: Path, identifier: int) -> None:
    """J1939: the database's address is one of many."""
    database = text(tmp_path / "bus.dbc", DATABASE.splitlines())
    e = read(j1939(tmp_path, identifier), databases=[database])
    np.testing.assert_allclose(e.readings["position"], (4000 + np.arange(100)) * 1e-5)
    assert any("same J1939 parameter group" in n for n in e.notes) == (identifier != 0x18FEF1FE)


def test_a_parameter_group_of_two_sources_is_refused(tmp_path: Path) -> None:
    """Unless one of them is that of the database."""
    database = text(tmp_path / "bus.dbc", DATABASE.splitlines())
    with pytest.raises(UserError, match=r"from several sources.*18FEF105, 18FEF106"):
        read(j1939(tmp_path, 0x18FEF105, 0x18FEF106), databases=[database])
    e = read(j1939(tmp_path, 0x18FEF105, 0x0CFEF1FE), databases=[database])
    assert len(e.readings["position"]) == 100


def test_a_packed_file_that_is_damaged_is_refused(frames: Frames, tmp_path: Path) -> None:
    """One message that names it."""
    packed = io.BytesIO()
    with gzip.open(packed, "wb") as stream:
        stream.write(by_python_can(frames, tmp_path / "run.log").read_bytes())
    file = tmp_path / "run.log.gz"
    file.write_bytes(packed.getvalue()[:500])
    with pytest.raises(UserError, match=r"run\.log\.gz: is not a readable gzip file"):
        read(file)

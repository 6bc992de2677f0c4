"""CAN captures: the same experiment as the emulator's recording, whatever describes the frames.

The reference is what the recorder kept: set points in force and readings, tick by tick.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import cantools
import numpy as np
import pytest
from rigs import bench, reference

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.commands.export import contents
from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import load_machine
from hil_emulator.device.message import Field
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.platform.paths import shipped
from tests.identify.arxml import arxml

TICKS = 400
START_ALL = Frame(0x000, b"\x01\x00")
LAYOUTS = {
    "combined": ("configs/hyq_knee.toml",),
    "separate": ("configs/hyq_knee.toml", "configs/hyq_knee_separate.toml"),
}
DIGIT = {"pressure_a": 1e3, "pressure_b": 1e3, "position": 1e-6, "load_force": 1e-2}
"""Largest value of one digit of a PDO, SI."""


@dataclass
class Run:
    """A run in lock-step: its frames with emulator time, and what the recorder kept."""

    config: Configuration
    folder: Path
    frames: list[tuple[int, bool, Frame]]
    table: dict[str, np.ndarray]

    def written(
        self, name: str, jitter: float = 0.0, drop: frozenset[int] = frozenset(),
        rate: float = 1.0, hold_up: int = 0,
    ) -> Path:  # fmt: skip
        """Write the capture as a stock logger does, with a logger's faults.

        Args:
            name: of the file; its ending decides the format.
            jitter: by how much a tick may be late [s].
            drop: frames that are missing.
            rate: of the logger's clock.
            hold_up: frames by which what was stamped may be handed on too late.

        """
        random = np.random.default_rng(7)
        late = {now: jitter * random.uniform() for now, _, _ in self.frames}
        messages, before, order = [], -1, 0
        for now, sent, frame in self.frames:
            order = order + 1 if now == before else 0
            before = now
            time = 1.7e9 + rate * (now * 1e-9 + late[now]) + 2e-6 * order
            messages.append(can.Message(time, frame.can_id, False, frame.remote, data=frame.data,
                                        is_rx=sent, channel=0))  # fmt: skip
        kept = [m for i, m in enumerate(messages) if i not in drop]
        places = np.arange(len(kept)) + random.integers(0, hold_up + 1, len(kept))
        file = self.folder / name
        with can.Logger(str(file)) as log:
            for i in np.argsort(places, kind="stable"):
                log(kept[i])
        return file


def command(config: Configuration, current: float) -> Frame:
    """Return the set point in the layout's own PDO, packed by hand."""
    if len(config.nodes) == 1:
        return Frame(0x205, round(current * 1e9).to_bytes(4, "little", signed=True))
    share = round(current / 0.010 * 16384).to_bytes(2, "little", signed=True)
    return Frame(0x205, b"\x0f\x00" + share)


@pytest.fixture(scope="module", params=list(LAYOUTS))
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """Drive a layout with another set point in each tick."""
    machine = load_machine([shipped(name) for name in LAYOUTS[request.param]])
    config = machine.actuators[0].config
    folder = tmp_path_factory.mktemp(request.param)
    for name, text in contents(machine).items():
        (folder / name).write_text(text, encoding="latin-1")
    random = np.random.default_rng(3)
    with bench(config) as rig:
        rig.ticks(2)
        rig.tick(START_ALL)
        for state in (b"\x08\x00", b"\x09\x00", b"\x0b\x00"):
            rig.tick(*([] if len(config.nodes) == 1 else [Frame(0x205, state + b"\x00\x00")]))
        for _ in range(TICKS):
            rig.tick(command(config, random.uniform(-2e-3, 2e-3)))
        yield Run(config, folder, list(rig.recorder.frames), rig.recorder.table())


def same(read: Experiment, run: Run) -> None:
    """Compare with the end of the recording: readings, and what acted after each of them."""
    table, rows = run.table, read.samples
    assert read.period == pytest.approx(1e-3)
    assert rows >= TICKS - 5
    for name, digit in DIGIT.items():
        wanted = table[name][-rows:]
        np.testing.assert_allclose(read.readings[name], wanted, rtol=0.0, atol=0.501 * digit)
    acted = table["valve_current"][-rows + 1 :]
    np.testing.assert_allclose(read.current[:-1], acted, rtol=0.0, atol=0.501 * 0.01 / 16384)


@pytest.mark.parametrize("ending", [".blf", ".asc", ".log"])
def test_the_configuration_explains_its_own_frames(run: Run, ending: str) -> None:
    """No DBC, no EDS: readings and set points as recorded, in every format."""
    (read,) = experiments([run.written(f"run{ending}")], run.config, Meaning())
    same(read, run)


def test_the_exported_dbc_explains_them(run: Run) -> None:
    """The same through cantools."""
    file = run.written("run.blf")
    (read,) = experiments([file], run.config, Meaning(databases=[run.folder / "bus.dbc"]))
    same(read, run)


def test_exported_dcf_files_explain_them(run: Run) -> None:
    """Mapping and node-ID from DCF files."""
    sheets = sorted(run.folder.glob("*.dcf"))
    (read,) = experiments([run.written("run.blf")], run.config, Meaning(sheets=sheets))
    same(read, run)


def test_eds_files_explain_them_with_their_node_ids(run: Run) -> None:
    """An EDS has no node-ID: without one it is asked for, with one it serves."""
    sheets = sorted(run.folder.glob("*.eds"))
    ids = [int(sheet.stem.rpartition("_")[2]) for sheet in sheets]
    file = run.written("run.blf")
    with pytest.raises(UserError, match="which node is it"):
        experiments([file], run.config, Meaning(sheets=sheets))
    (read,) = experiments([file], run.config, Meaning(sheets=sheets, node_ids=ids))
    same(read, run)


def test_late_frames_keep_their_samples(run: Run) -> None:
    """Times that scatter by half a period change no sample, and are reported."""
    (read,) = experiments([run.written("late.blf", jitter=0.5e-3)], run.config, Meaning())
    same(read, run)
    assert any("samples are counted in the order of their frames" in note for note in read.notes)


def test_what_is_handed_on_late_counts_when_it_was_stamped(run: Run) -> None:
    """A logger behind a busy controller writes frames in another order than they came."""
    (read,) = experiments([run.written("held_up.blf", hold_up=12)], run.config, Meaning())
    same(read, run)


def test_a_lost_frame_leaves_one_value_out(run: Run) -> None:
    """A logger that misses a frame of the position moves no other sample."""
    carrier = 0x285 if len(run.config.nodes) == 1 else 0x188
    places = [i for i, (_, _, f) in enumerate(run.frames) if f.can_id == carrier]
    file = run.written("lost.blf", drop=frozenset(places[100:101]))
    (read,) = experiments([file], run.config, Meaning())
    position = read.readings["position"]
    assert np.sum(~np.isfinite(position)) == 1
    wanted = run.table["position"][-len(position) :]
    good = np.isfinite(position)
    np.testing.assert_allclose(position[good], wanted[good], rtol=0.0, atol=0.6e-6)


def test_a_clock_that_is_not_the_devices_is_refused(run: Run) -> None:
    """Frames of 1 ms that come every 1.1 ms by the capture: two clocks, one message."""
    file = run.written("fast.blf", rate=1.1)
    with pytest.raises(UserError, match=r"two clocks: .* every 1\.1 ms .* every 1 ms"):
        experiments([file], run.config, Meaning())


def test_a_drifting_clock_is_refused(run: Run) -> None:
    """A capture whose clock gets faster within it."""
    file = run.folder / "drift.blf"
    with can.Logger(str(file)) as log:
        for now, sent, frame in run.frames:
            time = now * 1e-9
            log(can.Message(time + 0.3 * time**2, frame.can_id, False, data=frame.data,
                            is_rx=sent, channel=0))  # fmt: skip
    with pytest.raises(UserError, match="clock"):
        experiments([file], run.config, Meaning())


def test_a_capture_of_something_else_lists_its_content(run: Run) -> None:
    """Frames of unknown identifiers: what was wanted, what is there, and what to give."""
    file = run.folder / "other.log"
    with can.Logger(str(file)) as log:
        for k in range(100):
            log(can.Message(k * 1e-3, 0x3F1, False, data=bytes(8), channel="can0"))
    with pytest.raises(UserError, match=r"there are 3F1; .*--dbc or --eds"):
        experiments([file], run.config, Meaning())


@pytest.mark.parametrize("ending", [".blf", ".asc", ".log"])
@pytest.mark.parametrize("content", [b"", b"LOGG and then nothing", b"\x00\xff" * 300])
def test_a_damaged_capture_is_refused(run: Run, ending: str, content: bytes) -> None:
    """Any damage gives one message that names the file."""
    file = run.folder / f"bad{ending}"
    file.write_bytes(content)
    with pytest.raises(UserError, match=r"bad\."):
        experiments([file], run.config, Meaning())


def test_the_same_frames_from_two_channels_are_refused(run: Run) -> None:
    """Two buses with the same identifiers in one file cannot be separated."""
    file = run.folder / "two.blf"
    with can.Logger(str(file)) as log:
        for k in range(100):
            log(can.Message(k * 1e-3, 0x185, False, data=bytes(8), channel=k % 2))
    with pytest.raises(UserError, match="185 comes from channel"):
        experiments([file], run.config, Meaning())


DATABASE = """VERSION ""
BU_: A B
BO_ 800 P: 6 A
 SG_ pressure_a : 0|16@1+ (0.1,0) [0|400] "bar" B
 SG_ pressure_b : 16|16@1+ (0.1,0) [0|0] "bar" B
 SG_ position : 32|16@1+ (0.01,0) [0|0] "mm" B
VAL_ 800 pressure_a 65535 "Error" ;
"""


@pytest.mark.parametrize("ending", [".dbc", ".kcd", ".sym", ".arxml"])
def test_what_a_database_calls_no_reading_is_missing(tmp_path: Path, ending: str) -> None:
    """A value with a name in the value table, and one outside minimum and maximum, with a note."""
    database = tmp_path / f"bus{ending}"
    parsed = cantools.database.load_string(DATABASE, "dbc")
    if ending == ".arxml":  # cantools reads it only
        database.write_text(arxml(parsed.messages[0]))
    else:
        cantools.database.dump_file(parsed, str(database))
    file = tmp_path / "log.log"
    with can.Logger(str(file)) as log:
        for k in range(100):
            raw = {7: 65535, 8: 4001}.get(k, 3901 + k)
            data = struct.pack("<HHH", raw, 4001, 4000 + k)
            log(can.Message(k * 1e-3, 800, False, data=data, channel="can0"))
    (e,) = experiments([file], reference(), Meaning(databases=[database]))
    gone = np.flatnonzero(~np.isfinite(e.readings["pressure_a"]))
    assert gone.tolist() == [7, 8]
    assert any("pressure_a: 1 values are no readings but 'Error'" in n for n in e.notes)
    assert any("pressure_a: 1 of 100 values are outside the" in n for n in e.notes)
    assert not any(n.startswith("pressure_b") and "outside" in n for n in e.notes)


def test_frames_of_can_fd_are_read(run: Run) -> None:
    """The same frames as CAN FD carry the same readings and set points."""
    file = run.folder / "fd.blf"
    with can.Logger(str(file)) as log:
        for now, sent, frame in run.frames:
            fd = not frame.remote
            log(can.Message(now * 1e-9, frame.can_id, False, frame.remote, data=frame.data,
                            is_rx=sent, is_fd=fd, channel=0))  # fmt: skip
    (read,) = experiments([file], run.config, Meaning())
    same(read, run)


def test_a_current_in_a_frame_of_readings_is_a_row_of_a_table(tmp_path: Path) -> None:
    """No frame commanded it: whether it acted before or after them is not stated."""
    database = tmp_path / "bus.dbc"
    database.write_text(DATABASE.replace(
        'pressure_b : 16|16@1+ (0.1,0) [0|0] "bar"', 'valve_current : 16|16@1+ (1,0) [0|0] "uA"'
    ))  # fmt: skip
    file = tmp_path / "log.log"
    with can.Logger(str(file)) as log:
        for k in range(100):
            data = struct.pack("<HHH", 600 + k, k, 4000 + k)
            log(can.Message(k * 1e-3, 800, False, data=data, channel="can0"))
    (e,) = experiments([file], reference(), Meaning(databases=[database]))
    assert e.order_assumed
    np.testing.assert_allclose(e.current, np.arange(100) * 1e-6)
    (e,) = experiments([file], reference(), Meaning(databases=[database], set_point_first=True))
    np.testing.assert_allclose(e.current[:-1], np.arange(1, 100) * 1e-6)


def test_a_real_number_has_its_factor() -> None:
    """A pressure as REAL32 in bar is one in pascal by its factor."""
    field = Field("pressure_a PV real", 0, 32, False, True, 1e5, "Pa")
    assert field.value(struct.pack("<f", 160.0)) == pytest.approx(1.6e7)

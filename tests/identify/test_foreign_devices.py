"""Captures of devices that are not the emulator: their own databases, names, units and phases."""

import struct
from pathlib import Path

import can
import numpy as np
import pytest
from rigs import reference

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped

NAMES = {"Pa": "pressure_a", "CylPos": "position"}
"""Channels by the names of the foreign database."""

SAMPLES = 300
TIME = np.arange(SAMPLES) * 2e-3
POSITION = 40.0 + 5.0 * np.sin(20.0 * TIME)
PRESSURE = 80.0 + 10.0 * np.cos(20.0 * TIME)
SHARE = np.round(30.0 * np.sin(15.0 * TIME), 1)

DBC = """VERSION ""
NS_ :
BS_:
BU_: PLC VALVE
BO_ 2364540158 Sensors: 8 VALVE
 SG_ Pa : 7|16@0+ (0.01,0) [0|0] "bar" PLC
 SG_ Kind : 16|8@1+ (1,0) [0|0] "" PLC
 SG_ CylPos : 24|32@1- (0.0001,10) [0|0] "mm" PLC

BO_ 514 Command: 2 PLC
 SG_ valve_current : 0|16@1- (0.1,0) [0|0] "%" VALVE
"""
"""A 29-bit identifier, a big-endian signal, an offset, and a set point in percent."""


def capture(file: Path, shift: float = 0.0) -> Path:
    """Write what such a machine sends: readings, then the set point 0.3 ms later."""
    with can.Logger(str(file)) as log:
        for k in range(SAMPLES):
            time = 5.0 + TIME[k] + shift
            data = struct.pack(">H", round(PRESSURE[k] * 100)) + b"\0" + struct.pack(
                "<i", round((POSITION[k] - 10.0) * 1e4)
            )  # fmt: skip
            log(can.Message(time, 2364540158 & 0x1FFFFFFF, True, data=data + b"\0", channel=0))
            share = struct.pack("<h", round(SHARE[k] * 10))
            log(can.Message(time + 3e-4, 0x202, False, data=share, channel=0))
    return file


def described(folder: Path) -> Path:
    """Write the machine's DBC."""
    file = folder / "machine.dbc"
    file.write_text(DBC)
    return file


def test_a_foreign_dbc_with_other_names(tmp_path: Path) -> None:
    """Names are stated by --channel, percent by --rated-current; the set point acts at once."""
    meaning = Meaning(
        databases=[described(tmp_path)], names=NAMES,
        rated_current=0.010,
    )  # fmt: skip
    (read,) = experiments([capture(tmp_path / "run.blf")], reference(), meaning)
    assert read.period == pytest.approx(2e-3)
    # nothing is known of the set point before its first frame, so the first sample is left out
    rows = read.samples
    assert rows >= SAMPLES - 1
    np.testing.assert_allclose(read.readings["position"], POSITION[-rows:] * 1e-3, atol=1e-7)
    np.testing.assert_allclose(read.readings["pressure_a"], PRESSURE[-rows:] * 1e5, atol=501.0)
    np.testing.assert_allclose(read.current[:-1], SHARE[-rows:-1] * 1e-4, atol=1e-9)


def test_missing_statements_get_the_option_that_makes_them(tmp_path: Path) -> None:
    """Without the names and the rated current there are messages with the missing options."""
    file, dbc = capture(tmp_path / "run.blf"), described(tmp_path)
    with pytest.raises(UserError, match="no frame of a known reading"):
        experiments([file], reference(), Meaning(databases=[dbc]))
    with pytest.raises(UserError, match="--rated-current"):
        experiments([file], reference(), Meaning(databases=[dbc], names={"CylPos": "position"}))
    dbc.write_text(DBC.replace("valve_current", "Ventil"))
    with pytest.raises(UserError, match=r'--channel "position=NAME'):
        experiments([file], reference(), Meaning(databases=[dbc]))
    dbc.write_text("no database at all")
    with pytest.raises(UserError, match="not a usable database"):
        experiments([file], reference(), Meaning(databases=[dbc]))
    with pytest.raises(UserError, match="not a usable database"):
        experiments([file], reference(), Meaning(databases=[tmp_path / "missing.dbc"]))


def test_a_valve_driver_whose_eds_holds_no_more_than_the_profile(tmp_path: Path) -> None:
    """CiA 408: digits of 0x6300:01 are shares, 16384 of them the rated current."""
    eds_text = shipped("eds/valve_driver.eds").read_text(encoding="latin-1")
    plain = [line for line in eds_text.splitlines()
             if not line.startswith(("Signal=", "Unit=", "Factor="))]  # fmt: skip
    sheet = tmp_path / "valve.eds"
    sheet.write_text("\n".join(plain), encoding="latin-1")
    file = tmp_path / "run.asc"
    with can.Logger(str(file)) as log:
        for k in range(SAMPLES):
            digits = round(SHARE[k] / 100.0 * 16384)
            data = struct.pack("<Hh", 0x0F, digits)
            log(can.Message(TIME[k], 0x18C, False, data=struct.pack("<hhh", k, 0, 0), channel=0))
            log(can.Message(TIME[k] + 5e-4, 0x202, False, data=data, channel=0))
    dbc = tmp_path / "sensor.dbc"
    dbc.write_text(
        'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ 396 S: 6 A\n SG_ pressure_a : 0|16@1- (0.1,0) [0|0] '
        '"bar" A\n'
    )
    meaning = Meaning(databases=[dbc], sheets=[sheet], node_ids=[2], rated_current=0.040)
    (read,) = experiments([file], reference(), meaning)
    rows = read.samples
    wanted = np.round(SHARE[-rows:-1] / 100.0 * 16384) / 16384 * 0.040
    np.testing.assert_allclose(read.current[:-1], wanted, atol=1e-9)


def test_two_devices_with_phases_of_their_own(tmp_path: Path) -> None:
    """A sensor whose period drifts against the other's is interpolated, with a note."""
    dbc = tmp_path / "two.dbc"
    dbc.write_text(
        'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ 385 P: 4 A\n SG_ pressure_a : 0|32@1- (1,0) [0|0] '
        '"Pa" A\n\nBO_ 386 X: 4 A\n SG_ position : 0|32@1- (0.0000001,0) [0|0] "m" A\n'
    )
    file = tmp_path / "run.log"
    messages = []
    for k in range(1000):
        t = 1e-3 * k
        pressure = struct.pack("<i", round(8e6 + 1e6 * np.sin(9.0 * t)))
        messages.append(can.Message(t, 385, False, data=pressure, channel="can0"))
        t = 1.003e-3 * k + 4e-4
        position = struct.pack("<i", round((0.04 + 0.01 * np.sin(9.0 * t)) * 1e7))
        messages.append(can.Message(t, 386, False, data=position, channel="can0"))
    with can.Logger(str(file)) as log:
        for message in sorted(messages, key=lambda m: m.timestamp):
            log(message)
    (read,) = experiments([file], reference(), Meaning(databases=[dbc]))
    assert any("another rhythm" in note for note in read.notes)
    swing = (read.readings["pressure_a"] - 8e6) / 1e6 * 0.01 + 0.04
    inside = np.isfinite(read.readings["position"])
    assert inside.mean() > 0.98
    np.testing.assert_allclose(read.readings["position"][inside], swing[inside], atol=2e-6)


@pytest.mark.parametrize(("old", "new"), [
    ("Sensors: 8", "Sensors: 5"),
    ("24|32@1-", "40|32@1-"),
    ("7|16@0+", "55|32@0+"),
    ("Sensors: 8", "Sensors: 0"),
])  # fmt: skip
def test_a_signal_beyond_its_frame_is_named(tmp_path: Path, old: str, new: str) -> None:
    """In either byte order the message names signal, end of the signal and length of the frame."""
    file = described(tmp_path)
    file.write_text(file.read_text().replace(old, new))
    meaning = Meaning(databases=[file], names=NAMES)
    with pytest.raises(
        UserError, match=r"machine\.dbc: .* signal \w+ of message Sensors ends with"
    ):
        experiments([capture(tmp_path / "log.asc")], reference(), meaning)


def test_frames_shorter_than_described_lack_a_signal(tmp_path: Path) -> None:
    """A note names it; a missing counter does not number samples."""
    file = described(tmp_path)
    text = file.read_text().replace("Sensors: 8", "Sensors: 16")
    counter = ' SG_ sample_counter : 64|16@1+ (1,0) [0|0] "" PLC\n'
    file.write_text(text.replace(" SG_ Kind", counter + " SG_ Kind"))
    names = NAMES
    meaning = Meaning(databases=[file], names=names, rated_current=0.01)
    (experiment,) = experiments([capture(tmp_path / "log.asc")], reference(), meaning)
    assert experiment.samples == SAMPLES
    assert any("no frame of Sensors holds sample_counter" in note for note in experiment.notes)


def test_frames_that_no_multiplexer_knows_hold_nothing(tmp_path: Path) -> None:
    """The pressure of kind 3 is in no frame of kind 0: noted, and the position is read."""
    file = described(tmp_path)
    text = file.read_text().replace("SG_ Kind :", "SG_ Kind M :")
    file.write_text(
        text.replace("SG_ Pa :", "SG_ Pa m3 :").replace("SG_ CylPos :", "SG_ CylPos m3 :")
    )
    meaning = Meaning(databases=[file], names=NAMES)
    with pytest.raises(UserError, match=r"log\.asc"):
        experiments([capture(tmp_path / "log.asc")], reference(), meaning)


def test_a_night_and_a_wrong_time_in_a_capture(tmp_path: Path) -> None:
    """A pause of eight hours parts it in two; a frame of another year is left out with a note."""
    file = tmp_path / "log.asc"
    with can.Logger(str(file)) as log:
        for k in range(SAMPLES):
            data = struct.pack(">H", 8000) + b"\0" + struct.pack("<i", 300_000 + 100 * k) + b"\0"
            times = [TIME[k] + (28_800.0 if k >= 100 else 0.0), *([4e8] if k == 150 else [])]
            for time in times:
                log(can.Message(time, 2364540158 & 0x1FFFFFFF, True, data=data, channel=0))
    meaning = Meaning(databases=[described(tmp_path)], names=NAMES)
    first, second = experiments([file], reference(), meaning)
    assert (first.samples, second.samples) == (100, SAMPLES - 100)
    np.testing.assert_allclose(second.readings["position"][:3], [41e-3, 41.01e-3, 41.02e-3])
    assert any("far from all others, left out: 1" in note for note in first.notes)


def test_a_factor_beyond_numbers_gives_no_values(tmp_path: Path) -> None:
    """A signal whose values no float can hold is in no frame."""
    file = described(tmp_path)
    file.write_text(file.read_text().replace("(0.0001,10)", f"({'9' * 400},0)"))
    meaning = Meaning(databases=[file], names=NAMES)
    with pytest.raises(UserError, match=r"log\.asc"):
        experiments([capture(tmp_path / "log.asc")], reference(), meaning)

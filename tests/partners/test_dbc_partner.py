"""Partners by DBC: cantools reads what they send, and writes what they obey."""

import functools
import itertools
import math
import re
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cantools
import pytest
from crccheck.crc import Crc8SaeJ1850
from e2e import p01, p02
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_emulator.bus.bus import Bus
from hil_emulator.commands.replay import compare
from hil_emulator.config.load import Configuration, load
from hil_emulator.device.measured import Measured
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.partners.partner import Partner
from hil_emulator.partners.protection import Protection
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.simulation.partner_factory import partners

COMMAND, STATUS = 0x100, 0x101
CHANNEL_NAMES = [channel.name for channel in CHANNELS]
DRIVER = shipped("configs/partners/valve_driver.dbc")

DBC = """VERSION ""

BU_: master pump

BO_ 512 Fast: 8 pump
 SG_ Crc : 56|8@1+ (1,0) [0|255] "" master
 SG_ Alive : 0|2@1+ (1,0) [0|3] "" master
 SG_ Pressure : 15|16@0+ (0.1,0) [0|200] "bar" master

BO_ 513 Slow: 4 pump
 SG_ Position : 0|32@1- (1,0) [0|0] "um" master

BO_ 514 Chain: 8 pump
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" master
 SG_ Count : 8|4@1+ (1,0) [0|15] "" master
"""
PARTNER = """
[[partner]]
name = "pump"
dbc = "pump.dbc"
[partner.signals]
"Fast.Pressure" = "supply_pressure"
"Slow.Position" = "position"
[partner.messages]
Fast = { cycle = "10 ms", counter = "Alive", checksum = "sae_j1850", checksum_signal = "Crc" }
Slow = { on_change = true }
Chain = { cycle = "20 ms", checksum = "autosar_e2e_p02", data_ids = IDS }
"""
IDS = list(range(10, 26))


def pump(folder: Path, *changes: tuple[str, str], dbc: str = DBC) -> list[Path]:
    """Return the files of the reference machine with a partner; some text of it replaced."""
    text = PARTNER.replace("IDS", str(IDS))
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "pump.dbc").write_text(dbc)
    (folder / "pump.toml").write_text(text)
    return [shipped("configs/hyq_knee.toml"), folder / "pump.toml"]


def sent(emulator: Emulator, can_id: int) -> list[bytes]:
    """Return the data of all frames with an identifier that have left the rig."""
    return [f.data for _, out, f in emulator.recorder.frames if out and f.can_id == can_id]


@pytest.fixture
def driven() -> Iterator[tuple[Emulator, Bus, Any]]:
    """Yield the machine whose valve a partner drives, a controller's bus, and its database."""
    with Emulator(examples()) as emulator, Bus(emulator.bus) as controller:
        yield emulator, controller, cantools.database.load_file(DRIVER)


def command(database: Any, milliampere: float, count: int, data_id: int = 0x100) -> Frame:
    """Return a command as a controller sends it."""
    values = {"Checksum": 0, "Counter": count, "Current": milliampere}
    data = bytearray(database.encode_message("ValveCommand", values))
    p01.e2e_p01_protect(data, data_id)
    return Frame(COMMAND, bytes(data))


def states(emulator: Emulator, database: Any) -> list[str]:
    """Return the states that the driver has reported."""
    return [str(database.decode_message(STATUS, d)["State"]) for d in sent(emulator, STATUS)]


def test_a_controller_commands_through_a_dbc(driven: tuple[Emulator, Bus, Any]) -> None:
    """A protected command sets the current; without it for 50 ms the safe value is back."""
    emulator, controller, database = driven
    for count in range(5):
        controller.send([command(database, 3.5, count)])
        emulator.run_for("10 ms")
    assert emulator.rig.value("valve_current") == pytest.approx(3.5e-3)
    assert states(emulator, database)[-1] == "ready"
    emulator.run_for("70 ms")
    assert emulator.rig.value("valve_current") == 0.0
    assert states(emulator, database)[-1] == "command missing"


def test_a_damaged_command_is_not_obeyed(driven: tuple[Emulator, Bus, Any]) -> None:
    """With the checksum of another data ID the command before stays in force; it is reported."""
    emulator, controller, database = driven
    controller.send([command(database, 2.0, 0)])
    emulator.run_for("10 ms")
    controller.send([command(database, 9.0, 1, data_id=0x999)])
    emulator.run_for("10 ms")
    assert emulator.rig.value("valve_current") == pytest.approx(2e-3)
    assert states(emulator, database)[-1] == "command damaged"


def test_a_status_is_cyclic_multiplexed_and_protected(driven: tuple[Emulator, Bus, Any]) -> None:
    """Each 10 ms a page in turn, with a counter from 0 to 14 and the checksum of profile 1."""
    emulator, _, database = driven
    emulator.run_for("200 ms")
    data = sent(emulator, STATUS)
    assert len(data) == 20
    assert all(p01.e2e_p01_check(bytearray(d), 0x101) for d in data)
    assert not p01.e2e_p01_check(bytearray(data[0]), 0x102)
    values = [database.decode_message(STATUS, d) for d in data]
    assert [v["Page"] for v in values] == [0, 1] * 10
    counts = [v["Counter"] for v in values]
    assert counts == [(counts[0] + n) % 15 for n in range(20)]
    assert values[0]["SupplyPressure"] == pytest.approx(160.0, abs=2.0)
    assert values[1]["Temperature"] == 20


def test_checksums_and_counters_by_name(tmp_path: Path) -> None:
    """SAE J1850 over the other bytes, a counter of two bits, AUTOSAR profile 2, on change."""
    with Emulator(load(pump(tmp_path))) as emulator:
        emulator.run_for("100 ms")
        fast, chain, slow = (sent(emulator, n) for n in (0x200, 0x202, 0x201))
    assert len(fast) == 10
    assert all(d[7] == Crc8SaeJ1850.calc(d[:7]) for d in fast)
    assert [d[0] & 3 for d in fast] == [n % 4 for n in range(10)]
    database = cantools.database.load_file(tmp_path / "pump.dbc")
    assert database.decode_message("Fast", fast[0])["Pressure"] == pytest.approx(160.0, abs=2.0)
    assert len(chain) == 5
    assert all(p02.e2e_p02_check(bytearray(d), bytes(IDS)) for d in chain)
    assert len(slow) >= 1
    assert all(a != b for a, b in itertools.pairwise(slow))


def test_crc_is_that_of_the_catalogue() -> None:
    """CRC-8/SAE-J1850 of the nine digits is 0x4B (reveng catalogue of CRC algorithms)."""
    assert Crc8SaeJ1850.calc(b"123456789") == 0x4B


def test_partners_hear_no_own_frames_and_take_turns_on_a_wire(tmp_path: Path) -> None:
    """On a bus with modelled timing their frames are queued and pass like those of nodes."""
    layer = tmp_path / "timed.toml"
    layer.write_text('[bus]\nbit_rate = "500 kbit/s"\ntiming = "modelled"\n')
    with Emulator(load([*pump(tmp_path), layer])) as emulator:
        emulator.run_for("50 ms")
        assert len(sent(emulator, 0x200)) == 5
        assert emulator.rig.wire is not None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"pump.dbc"', '"missing.dbc"'), "cannot read the DBC"),
        (
            ('"Fast.Pressure"', '"Fast.Presure"'),
            "Fast has no signal 'Presure'; there are Alive, Pressure",
        ),
        (('"Fast.Pressure"', '"Fsat.Pressure"'), "does not send Fsat"),
        (('"Fast.Pressure"', '"Pressure"'), 'write it as "Message.Signal"'),
        (("Slow = {", "Solw = {"), "has no message 'Solw'; there are Fast, Slow, Chain"),
        (('checksum_signal = "Crc"', 'checksum_signal = "Alive"'), "is not one whole byte"),
        (("data_ids = [10, ", "data_ids = ["), "needs 16 data_ids"),
        (('name = "pump"', 'name = "pmup"'), "names no message that pmup sends"),
        (
            ('"supply_pressure"', "{ constant = 'high' }"),
            "has no value 'high'; there are no values",
        ),
        (('"sae_j1850"', '"crc8"'), "'sae_j1850'"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    """What is wrong ends with one message that names file, place and way out."""
    with pytest.raises(UserError, match=re.escape(message)):
        partners(load(pump(tmp_path, change)), ["supply_pressure", "position"])


def test_a_unit_that_is_none_needs_one(tmp_path: Path) -> None:
    """Where the DBC has no unit, the configuration states what one of the signal is."""
    dbc = DBC.replace('"um"', '"counts"')
    with pytest.raises(UserError, match="the unit 'counts' of the DBC"):
        partners(load(pump(tmp_path, dbc=dbc)), ["supply_pressure", "position"])
    given = (
        '"Slow.Position" = "position"',
        '"Slow.Position" = { channel = "position", unit = "1 um" }',
    )
    with Emulator(load(pump(tmp_path, given, dbc=dbc))) as emulator:
        emulator.run_for("5 ms")
        assert sent(emulator, 0x201)


def test_a_node_by_dbc_is_a_partner(tmp_path: Path) -> None:
    """Written as [[node]], it is refused with the way out."""
    layer = tmp_path / "node.toml"
    layer.write_text('[[node]]\nid = 5\neds = "x.eds"\ndbc = "pump.dbc"\n')
    with pytest.raises(UserError, match=r"write \[\[partner\]\] with name and dbc"):
        load([shipped("configs/hyq_knee.toml"), layer])


def test_a_recording_with_partners_repeats(driven: tuple[Emulator, Bus, Any]) -> None:
    """Replayed, the recorded commands give the same frames and signals, bit for bit."""
    emulator, controller, database = driven
    for count in range(40):
        controller.send([command(database, 0.1 * count, count % 15)])
        emulator.run_for("10 ms")
    assert compare(emulator.recording(), emulator.config).same


@pytest.mark.parametrize(
    ("library", "checksum"), [("e2e", "autosar_e2e_p01"), ("crccheck", "sae_j1850")]
)
def test_a_missing_library_is_named(
    monkeypatch: pytest.MonkeyPatch, library: str, checksum: str
) -> None:
    """Without the extra the message names it."""
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(UserError, match=rf"checksum {checksum} needs pip install .*\[partners\]"):
        Protection(checksum)


SOURCES_DBC = """VERSION ""

BU_: a

BO_ 512 Values: 8 a
 SG_ Ramp : 0|16@1- (0.5,0) [-100|100] "" b
 SG_ Table : 16|16@1- (1,0) [0|0] "" b
 SG_ File : 32|16@1- (1,0) [0|0] "" b
 SG_ Constant : 48|8@1+ (2,-40) [-40|100] "degC" b

BO_ 513 Command: 5 b
 SG_ Page M : 0|8@1+ (1,0) [0|1] "" a
 SG_ Current m0 : 8|32@1- (1,0) [-5|5] "mA" a
SIG_VALTYPE_ 513 Current : 1;
"""
SOURCES = """
[[partner]]
name = "a"
dbc = "pump.dbc"
[partner.signals]
"Values.Ramp" = { ramp = [-500, 20], time = "10 ms" }
"Values.Table" = { table = [["0 s", 3], ["5 ms", 8]] }
"Values.File" = { file = "file.csv", column = "level" }
"Values.Constant" = { constant = "30 degC", unit = "1 degC" }
"Command.Current" = "valve_current"
[partner.messages]
Values = { cycle = "5 ms" }
"""


@pytest.fixture
def sources(tmp_path: Path) -> Partner:
    """Return a partner with a signal of each kind of source, and a command of a REAL."""
    (tmp_path / "pump.dbc").write_text(SOURCES_DBC)
    (tmp_path / "file.csv").write_text("time,level\n0,1\n0.005,11\n")
    (tmp_path / "layer.toml").write_text(SOURCES)
    config = load([shipped("configs/hyq_knee.toml"), tmp_path / "layer.toml"])
    (partner,) = partners(config, ["supply_pressure"])
    return partner


def test_signals_follow_ramps_tables_files_and_constants(sources: Partner) -> None:
    """As objects of nodes by EDS do; beyond the limits of the signal they are saturated."""
    database = cantools.database.load_string(SOURCES_DBC, "dbc")
    shown = []
    for ms in (0, 5, 10):
        (frame,) = sources.publish(ms * 1_000_000, Measured([0.0], [0]))
        shown.append(database.decode_message(0x200, frame.data))
    assert [v["Ramp"] for v in shown] == [-100, -100, 20]
    assert [v["Table"] for v in shown] == [3, 8, 8]
    assert [v["File"] for v in shown] == [1, 11, 11]
    assert [v["Constant"] for v in shown] == [30, 30, 30]


def obeyed(partner: Partner, data: bytes) -> float:
    """Return the current after a command."""
    return partner.receive(0, [Frame(0x201, data)])["valve_current"]


def test_a_command_is_saturated_and_finite(sources: Partner) -> None:
    """5 mA at most; what is no number, of another page or too short changes nothing."""
    assert obeyed(sources, struct.pack("<Bf", 0, 2.0)) == pytest.approx(2e-3)
    for data in (struct.pack("<Bf", 0, math.nan), struct.pack("<Bf", 7, 1.0), b"\0", b""):
        assert obeyed(sources, data) == pytest.approx(2e-3)
    assert obeyed(sources, struct.pack("<Bf", 0, math.inf)) == pytest.approx(2e-3)
    assert obeyed(sources, struct.pack("<Bf", 0, 9.0)) == pytest.approx(5e-3)


@functools.cache
def examples() -> Configuration:
    """Return the reference machine with both partners that come with the package."""
    return load([shipped("configs/hyq_knee.toml"), shipped("configs/partners.toml")])


ANYTHING = st.tuples(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8), st.booleans())


@given(st.lists(ANYTHING, max_size=20))
@settings(deadline=None, max_examples=60)
def test_no_frame_ends_a_partner(frames: list[tuple[int, bytes, bool]]) -> None:
    """Whatever comes, the partners of the examples go on and command finite values."""
    for partner in partners(examples(), CHANNEL_NAMES):
        for ms, (can_id, data, extended) in enumerate(frames):
            number = can_id if extended else can_id & 0x7FF
            tuned = (0x1CEC8090, 0x1CEB8090, 0x18EA8090, 0x18EEFF80, 0x100)[ms % 5]
            arriving = [Frame(number, data, False, extended), Frame(tuned, data, False, ms % 5 < 4)]
            commands = partner.receive(ms * 1_000_000, arriving)
            assert all(math.isfinite(value) for value in commands.values())
            partner.publish(ms * 1_000_000, Measured([0.0] * len(CHANNEL_NAMES), [0]))

"""Drives (CiA 402), started and judged by the stock master's state machine of that profile."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from canopen.profiles.p402 import BaseNode402
from data_sheets import LEAST
from device_master import NODE_ID, Master
from simulated_network import SimulatedNetwork

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.device.scale import Scale

SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED = 0x40, 0x21, 0x23, 0x27
QUICK_STOP, FAULT, STATE = 0x07, 0x08, 0x6F
TARGET_REACHED, ZERO_OR_FOLLOWS = 0x400, 0x1000
U16, I8, I32, U32 = 0x6, 0x2, 0x4, 0x7
OBJECTS = {
    0x6007: (0x3, "rw", 1), 0x603F: (U16, "ro", 0), 0x6040: (U16, "rw", 0), 0x6041: (U16, "ro", 0),
    0x605A: (0x3, "rw", 2), 0x6060: (I8, "rw", 0), 0x6061: (I8, "ro", 0), 0x6064: (I32, "ro", 0),
    0x606B: (I32, "ro", 0), 0x606C: (I32, "ro", 0), 0x606D: (U16, "rw", 10),
    0x606F: (U16, "rw", 10), 0x607A: (I32, "rw", 0), 0x6083: (U32, "rw", 20_000),
    0x6084: (U32, "rw", 10_000), 0x6085: (U32, "rw", 50_000), 0x60FF: (I32, "rww", 0),
    0x6502: (U32, "ro", 0x184),
}  # fmt: skip


def write_eds(folder: Path) -> Path:
    """Write the EDS of a drive with velocity and position."""
    text = LEAST.replace("NrOfTXPDO=1", "NrOfTXPDO=0").replace(
        "[1000]\nParameterName=Device type\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\n"
        "DefaultValue=0",
        "[1000]\nParameterName=Device type\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\n"
        "DefaultValue=0x00020192",
    )
    for index, (data_type, access, default) in OBJECTS.items():
        text += (
            f"\n[{index:04X}]\nParameterName=Object {index:04X}\nObjectType=0x7\n"
            f"DataType=0x{data_type:04X}\nAccessType={access}\nDefaultValue={default}\nPDOMapping=1\n"
        )
    path = folder / "drive.eds"
    path.write_text(text)
    return path


class DriveMaster(Master):
    """A stock master of CiA 402 on a bus with a drive."""

    def __init__(self, eds: Path, commands: dict[str, float] | None = None) -> None:
        dictionary = Dictionary.from_eds(eds, NODE_ID)
        if commands:
            dictionary.assign(dictionary.entry(0x60FF), "valve_current", Scale("A", 1e-6))
        if commands is not None:
            dictionary.assign(dictionary.entry(0x606C), "velocity", Scale("m/s", 1e-3))
        node = Node(dictionary, ["velocity"], commands or {})
        self.network = SimulatedNetwork(node, Measured([0.25], [0]))
        self.remote: Any = self.network.add_node(BaseNode402(NODE_ID, str(eds)))
        self.run(2)

    def write(self, index: int, value: int) -> None:
        """Write an object by SDO."""
        self.remote.sdo[index].raw = value

    def read(self, index: int) -> int:
        """Return the value of an object without a tick passing."""
        return int(self.network.node.dictionary.entry(index).value)

    def state(self) -> int:
        """Return the state in the status word."""
        return self.read(0x6041) & STATE

    def enable(self, mode: int) -> None:
        """Bring the drive to OPERATION ENABLED in a mode, as a controller does."""
        self.nmt(1)
        self.write(0x6060, mode)
        for word in (0x06, 0x07, 0x0F):
            self.write(0x6040, word)
            self.run(1)
        assert self.state() == ENABLED


@pytest.fixture
def drive(tmp_path: Path) -> DriveMaster:
    """Return a drive that follows its demand exactly."""
    return DriveMaster(write_eds(tmp_path))


def test_a_stock_master_starts_the_drive(drive: DriveMaster) -> None:
    """`canopen` leads it through its states, changes the mode, and reads each state."""
    drive.nmt(1)
    drive.remote.setup_402_state_machine(read_pdos=False)
    assert drive.remote.state == "SWITCH ON DISABLED"
    assert drive.remote.is_op_mode_supported("PROFILED VELOCITY")
    drive.remote.op_mode = "PROFILED VELOCITY"
    assert drive.remote.op_mode == "PROFILED VELOCITY"
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCHED ON"):
        drive.remote.state = state
        assert drive.remote.state == state


@pytest.mark.parametrize(
    ("words", "state"),
    [
        ((0x06,), READY), ((0x06, 0x07), SWITCHED_ON), ((0x06, 0x07, 0x0F), ENABLED),
        ((0x06, 0x0F, 0x0F), ENABLED), ((0x07,), SWITCH_ON_DISABLED), ((0x0F,), SWITCH_ON_DISABLED),
        ((0x06, 0x07, 0x06), READY), ((0x06, 0x07, 0x0F, 0x07), SWITCHED_ON),
        ((0x06, 0x07, 0x0F, 0x06), READY), ((0x06, 0x07, 0x0F, 0x00), SWITCH_ON_DISABLED),
        ((0x06, 0x07, 0x02), SWITCH_ON_DISABLED), ((0x06, 0x00), SWITCH_ON_DISABLED),
    ],
)  # fmt: skip
def test_control_words_lead_to_their_states(
    drive: DriveMaster, words: tuple[int, ...], state: int
) -> None:
    """The transitions of CiA 402-2, from SWITCH ON DISABLED."""
    assert drive.state() == SWITCH_ON_DISABLED
    for word in words:
        drive.write(0x6040, word)
        drive.run(2)
    assert drive.state() == state


def test_profile_velocity_ramps_to_its_target(drive: DriveMaster) -> None:
    """The drive ramps up at 20 000 per s² and down at 10 000; the status word shows the target."""
    drive.enable(3)
    assert drive.read(0x6041) & ZERO_OR_FOLLOWS
    drive.write(0x60FF, 1000)
    drive.run(24)
    assert drive.read(0x606C) == pytest.approx(500, abs=21)
    assert not drive.read(0x6041) & TARGET_REACHED
    drive.run(30)
    assert drive.read(0x606C) == 1000
    assert drive.read(0x6041) & TARGET_REACHED
    assert not drive.read(0x6041) & ZERO_OR_FOLLOWS
    drive.write(0x6040, 0x10F)  # halt
    drive.run(50)
    assert drive.read(0x606C) == pytest.approx(500, abs=21)
    drive.run(60)
    assert drive.read(0x606C) == 0


def test_cyclic_velocity_is_followed_at_once(drive: DriveMaster) -> None:
    """Each target is the velocity of the next tick; the position is its integral."""
    drive.enable(9)
    drive.write(0x60FF, -3000)
    drive.run(1)
    assert drive.read(0x606C) == -3000
    begin = drive.read(0x6064)
    drive.run(100)
    assert drive.read(0x6064) - begin == pytest.approx(-300, abs=1)
    assert drive.read(0x6041) & ZERO_OR_FOLLOWS


def test_cyclic_position_is_followed(drive: DriveMaster) -> None:
    """Position targets 5 apart each ms are a velocity of 5000."""
    drive.enable(8)
    for target in range(5, 105, 5):
        drive.network.node.dictionary.entry(0x607A).value = target
        drive.run(1)
        assert drive.read(0x6064) == target
    assert drive.read(0x606B) == 5000
    assert drive.read(0x6061) == 8


def test_an_unknown_mode_is_not_shown(drive: DriveMaster) -> None:
    """0x6061 keeps the last mode that the drive has."""
    drive.enable(9)
    drive.write(0x6060, 6)
    drive.run(2)
    assert drive.read(0x6061) == 9


@pytest.mark.parametrize(("option", "end"), [(2, SWITCH_ON_DISABLED), (6, QUICK_STOP)])
def test_quick_stop_decelerates(drive: DriveMaster, option: int, end: int) -> None:
    """The drive decelerates at 50 000 per s²; then it is disabled, or stays in quick stop."""
    drive.enable(9)
    drive.write(0x605A, option)
    drive.write(0x60FF, 1000)
    drive.run(2)
    drive.write(0x6040, 0x02)
    drive.run(8)
    assert drive.state() == QUICK_STOP
    assert 0 < drive.read(0x606C) < 1000
    drive.run(20)
    assert drive.read(0x606C) == 0
    assert drive.state() == end
    drive.write(0x6040, 0x0F)
    drive.run(2)
    assert (drive.state() == ENABLED) == (end == QUICK_STOP)


def test_a_lost_connection_is_a_fault_until_it_is_reset(drive: DriveMaster) -> None:
    """0x6007 of 1: leaving OPERATIONAL stops the drive with 0x7500; a rising bit 7 resets it."""
    drive.enable(9)
    drive.write(0x60FF, 100)
    drive.nmt(128)
    drive.run(20)
    assert (drive.state(), drive.read(0x603F), drive.read(0x606C)) == (FAULT, 0x7500, 0)
    codes = [int.from_bytes(data[:2], "little") for data in drive.data(0x080 + NODE_ID)]
    assert codes == [0x7500]
    for word in (0x00, 0x80):
        drive.write(0x6040, word)
        drive.run(1)
    assert (drive.state(), drive.read(0x603F)) == (SWITCH_ON_DISABLED, 0)


def test_measured_velocity_and_command(tmp_path: Path) -> None:
    """A bound 0x606C shows its channel; a bound 0x60FF gives its demand, 0 while disabled."""
    drive = DriveMaster(write_eds(tmp_path), {"valve_current": 0.0})
    drive.enable(9)
    drive.write(0x60FF, 2500)
    drive.run(1)
    assert drive.read(0x606C) == 250  # mm/s
    assert drive.commands["valve_current"] == pytest.approx(2.5e-3)
    drive.write(0x6040, 0x06)
    drive.run(2)
    assert drive.commands["valve_current"] == 0.0


def test_states_follow_each_other_one_per_tick(drive: DriveMaster) -> None:
    """The status word names each state on the way, as a TPDO by events shows it."""
    states = [drive.read(0x6041) & STATE]
    drive.write(0x6040, 0x06)
    states.append(drive.state())
    drive.network.node.dictionary.entry(0x6040).value = 0x0F
    for _ in range(3):
        drive.run(1)
        states.append(drive.state())
    assert [state for state, _ in itertools.groupby(states)] == [
        SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED,
    ]  # fmt: skip

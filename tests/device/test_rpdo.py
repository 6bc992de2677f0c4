"""RPDOs: set points from the bus, their deadline and their errors (CiA 301 7.2.2)."""

import math
import struct
from pathlib import Path

import pytest
from device_master import CHANNELS, EMCY, NODE_ID, RPDO1, SAFE_CURRENT, SYNC, Master, booted
from edited_eds import edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

TOO_SHORT, TOO_LONG, TIMEOUT, RESET = 0x8210, 0x8220, 0x8250, 0x0000


def current(amperes: float) -> bytes:
    """Return RPDO1's data for a valve current."""
    return round(amperes * 1e9).to_bytes(4, "little", signed=True)


def codes(master: Master) -> list[int]:
    """Return the emergency codes received, oldest first."""
    return [int.from_bytes(data[:2], "little") for data in master.data(EMCY)]


def test_stock_master_moves_the_valve(master: Master) -> None:
    """A set point of a master that uses only the EDS is in force in the tick of its reception."""
    master.remote.rpdo.read()
    master.start()
    master.remote.rpdo[1]["valve_current"].phys = 0.005
    master.remote.rpdo[1].transmit()
    assert master.commands == {"valve_current": pytest.approx(0.005)}


def test_commands_are_safe_outside_operational(master: Master) -> None:
    """A set point does not act in PRE-OPERATIONAL or after OPERATIONAL was left."""
    master.send(RPDO1, current(0.005))
    assert master.commands == {"valve_current": SAFE_CURRENT}
    for command in (2, 128, 129, 130):
        master.nmt(1)
        master.send(RPDO1, current(0.005))
        assert master.commands == {"valve_current": pytest.approx(0.005)}
        master.nmt(command)
        assert master.commands == {"valve_current": pytest.approx(SAFE_CURRENT)}


def test_set_point_is_one_value(master: Master) -> None:
    """An RPDO's set point and an SDO's are the same object."""
    master.remote.sdo[0x1400][5].raw = 0
    master.start()
    master.send(RPDO1, current(0.002))
    assert master.abort_code(0x2000, 0) == 0
    assert master.remote.sdo.upload(0x2000, 0) == current(0.002)
    master.remote.sdo.download(0x2000, 0, current(0.003))
    assert master.commands == {"valve_current": pytest.approx(0.003)}


def test_set_point_written_before_the_start_waits_for_it(master: Master) -> None:
    """An SDO presets the set point in PRE-OPERATIONAL; it is in force with OPERATIONAL."""
    master.remote.sdo.download(0x2000, 0, current(0.002))
    assert master.commands == {"valve_current": SAFE_CURRENT}
    master.nmt(1)
    assert master.commands == {"valve_current": pytest.approx(0.002)}


def test_safe_value_can_be_set_by_sdo(master: Master) -> None:
    """A new safe value is in force at once, and is kept over the start of the node."""
    master.remote.sdo["valve_current_safe"].raw = 4_000_000
    assert master.commands == {"valve_current": pytest.approx(0.004)}
    master.nmt(1)
    assert master.commands == {"valve_current": pytest.approx(0.004)}
    master.send(RPDO1, current(0.001))
    master.remote.sdo["valve_current_safe"].raw = 3_000_000
    assert master.commands == {"valve_current": pytest.approx(0.001)}


@pytest.mark.parametrize(("asked", "got"), [(0.011, 0.01), (-2.0, -0.01)])
def test_set_points_saturate_at_the_limits(master: Master, asked: float, got: float) -> None:
    """A set point beyond the object's limits is saturated."""
    master.start()
    master.send(RPDO1, current(asked))
    assert master.commands == {"valve_current": pytest.approx(got)}


@pytest.mark.parametrize("kind", [0, 1, 240])
def test_synchronous_set_point_waits_for_sync(master: Master, kind: int) -> None:
    """Types 0 to 240 act with the next SYNC; the last one received is used."""
    master.remote.sdo[0x1400][2].raw = kind
    master.start()
    master.send(RPDO1, current(0.002))
    master.send(RPDO1, current(0.003))
    assert master.commands == {"valve_current": SAFE_CURRENT}
    master.send(SYNC)
    assert master.commands == {"valve_current": pytest.approx(0.003)}


def test_short_rpdo_is_ignored_and_reported_once(master: Master) -> None:
    """Too few bytes: EMCY 0x8210, no effect; a correct RPDO ends the error."""
    master.start()
    for _ in range(3):
        master.send(RPDO1, current(0.002)[:3])
    assert master.commands == {"valve_current": SAFE_CURRENT}
    assert codes(master) == [TOO_SHORT]
    assert master.remote.sdo[0x1001].raw == 0x11
    master.send(RPDO1, current(0.002))
    assert codes(master) == [TOO_SHORT, RESET]
    assert master.remote.sdo[0x1001].raw == 0


def test_long_rpdo_is_used_and_reported(master: Master) -> None:
    """Too many bytes: EMCY 0x8220, and the mapped part is used."""
    master.start()
    master.send(RPDO1, current(0.002) + b"\xff")
    assert master.commands == {"valve_current": pytest.approx(0.002)}
    assert codes(master) == [TOO_LONG]


def test_missed_deadline_falls_back_to_the_safe_value(master: Master) -> None:
    """20 ms after the last RPDO the safe value is in force and EMCY 0x8250 is sent."""
    master.start()
    master.send(RPDO1, current(0.005))
    master.run(19)
    assert master.commands == {"valve_current": pytest.approx(0.005)}
    assert codes(master) == []
    master.run(1)
    assert master.commands == {"valve_current": pytest.approx(SAFE_CURRENT)}
    assert codes(master) == [TIMEOUT]
    assert master.remote.sdo.upload(0x2000, 0) == current(SAFE_CURRENT)
    master.run(100)
    assert codes(master) == [TIMEOUT]


def test_new_rpdo_ends_the_missed_deadline(master: Master) -> None:
    """The next RPDO is in force at once and the error reset is sent."""
    master.start()
    master.send(RPDO1, current(0.005))
    master.run(30)
    master.send(RPDO1, current(0.004))
    assert master.commands == {"valve_current": pytest.approx(0.004)}
    assert codes(master) == [TIMEOUT, RESET]


def test_deadline_is_not_monitored_before_the_first_rpdo(master: Master) -> None:
    """The deadline is not monitored before the first RPDO, also after a new start."""
    master.start()
    master.run(100)
    assert codes(master) == []
    master.send(RPDO1, current(0.005))
    master.nmt(128)
    master.nmt(1)
    master.run(100)
    assert codes(master) == []


def test_rpdo_each_deadline_is_in_time(master: Master) -> None:
    """RPDOs exactly 20 ms apart never miss a deadline of 20 ms."""
    master.start()
    for _ in range(5):
        master.send(RPDO1, current(0.005))
        master.run(19)
    assert codes(master) == []


def test_deadline_can_be_switched_off(master: Master) -> None:
    """With an event timer of 0 a set point has no deadline."""
    master.remote.sdo[0x1400][5].raw = 0
    master.start()
    master.send(RPDO1, current(0.005))
    master.run(1000)
    assert master.commands == {"valve_current": pytest.approx(0.005)}
    assert codes(master) == []


def test_a_set_point_ends_with_operational(master: Master) -> None:
    """After the next start the safe value is in force until a new RPDO arrives."""
    for command in (2, 128, 129, 130):
        master.nmt(1)
        master.send(RPDO1, current(0.005))
        master.nmt(command)
        master.run(1)
        master.nmt(1)
        assert master.commands == {"valve_current": pytest.approx(SAFE_CURRENT)}


def test_reset_forgets_a_preset(master: Master) -> None:
    """A set point written in PRE-OPERATIONAL does not survive reset communication."""
    master.remote.sdo.download(0x2000, 0, current(0.002))
    master.nmt(130)
    master.nmt(1)
    assert master.commands == {"valve_current": pytest.approx(SAFE_CURRENT)}


def test_real_set_points_must_be_finite(tmp_path: Path) -> None:
    """Infinity and NaN are ignored by RPDO and refused by SDO with 0609 0030."""
    old = "ParameterName=valve_current\nObjectType=0x7\nDataType=0x0004\nAccessType=rww\n"
    limits = "LowLimit=-10000000\nHighLimit=10000000\n"
    new = old.replace("0004", "0008")
    eds = edited(tmp_path, (old + limits, new), ("Unit=A\nFactor=1e-9", "Unit=A\nFactor=1"))
    dictionary = Dictionary.from_eds(eds, NODE_ID)
    master = booted(Node(dictionary, CHANNELS, {"valve_current": SAFE_CURRENT}), eds)
    master.start()
    master.send(RPDO1, struct.pack("<f", 0.25))
    for bad in (math.nan, math.inf, -math.inf):
        master.send(RPDO1, struct.pack("<f", bad))
        assert master.commands == {"valve_current": 0.25}
        assert master.abort_code(0x2000, 0, struct.pack("<f", bad)) == 0x06090030

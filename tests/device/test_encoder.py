"""The position sensor (CiA 406): steps, preset, speed, alarms, cyclic timer."""

import struct

import pytest
from device_master import RPDO1, SYNC, TPDO1, TPDO2, Master
from instruments import CHANNELS, instrument, show


@pytest.fixture
def encoder() -> Master:
    """Return a position sensor at 40 mm, moving at 0.25 m/s."""
    return instrument("position_sensor")


def position(encoder: Master) -> int:
    """Return the position value in steps."""
    value = int(encoder.remote.sdo[0x6020][1].raw)
    assert encoder.remote.sdo[0x6004].raw == value
    return value


def test_position_and_speed_are_in_steps(encoder: Master) -> None:
    """By default a step is 1 um, and 0.1 mm/s for the speed."""
    assert position(encoder) == 40000
    assert encoder.remote.sdo[0x6030][1].raw == 2500


def test_steps_can_be_set(encoder: Master) -> None:
    """With steps of 5 um and 1 mm/s the values are a fifth and a tenth."""
    encoder.remote.sdo[0x6005][1].raw = 5000
    encoder.remote.sdo[0x6005][2].raw = 100
    encoder.run(1)
    assert position(encoder) == 8000
    assert encoder.remote.sdo[0x6030][1].raw == 250


def test_without_scaling_the_scale_counts(encoder: Master) -> None:
    """Bit 2 of the operating parameters cleared: steps of 0x6501, 0.1 um."""
    encoder.remote.sdo[0x6000].raw = 0
    encoder.run(1)
    assert position(encoder) == 400000
    assert encoder.remote.sdo[0x6500].raw == 0


def test_direction_can_be_reversed(encoder: Master) -> None:
    """Bit 3 of the operating parameters reverses the sign."""
    encoder.remote.sdo[0x6000].raw = 0x000C
    encoder.run(1)
    assert position(encoder) == -40000


def test_preset_moves_the_zero(encoder: Master) -> None:
    """The present position reads as the preset value, and motion is counted from it."""
    encoder.remote.sdo[0x6003].raw = 1000
    encoder.run(1)
    assert position(encoder) == 1000
    assert encoder.remote.sdo[0x6509].raw == 1000 - 40000
    show(encoder, position=0.041)
    assert position(encoder) == 2000


def test_stored_preset_survives_a_reset(encoder: Master) -> None:
    """The offset is stored with the parameters, although no client can write it."""
    encoder.remote.sdo[0x6003].raw = 1000
    assert encoder.abort_code(0x6509, 0, bytes(4)) == 0x06010002
    encoder.abort_code(0x1010, 1, b"save")
    encoder.nmt(129)
    encoder.run(2)
    assert position(encoder) == 1000


@pytest.mark.parametrize(("metres", "end", "alarm"), [(0.05, 0, 0), (0.085, 1, 1), (0.2, 0, 1)])
def test_alarm_beyond_the_range(encoder: Master, metres: float, end: int, alarm: int) -> None:
    """The end of the transducer and the total measuring range raise the position alarm."""
    show(encoder, overrange=end, position=metres)
    assert encoder.remote.sdo[0x6503].raw == alarm
    show(encoder, position=0.05)
    assert encoder.remote.sdo[0x6503].raw == 0


def test_warning_when_too_fast(encoder: Master) -> None:
    """A speed beyond INTEGER16 saturates and sets the warning."""
    show(encoder, velocity=4.0)
    assert encoder.remote.sdo[0x6030][1].raw == 32767
    assert encoder.remote.sdo[0x6505].raw == 1
    show(encoder, velocity=-1.0)
    assert encoder.remote.sdo[0x6505].raw == 0


def test_cyclic_timer_is_the_event_timer(encoder: Master) -> None:
    """A write of one object changes the other and the period of TPDO1."""
    encoder.remote.sdo[0x6200].raw = 5
    assert encoder.remote.sdo[0x1800][5].raw == 5
    encoder.start()
    encoder.run(20)
    assert len(encoder.data(TPDO1)) == 4
    encoder.remote.sdo[0x1800][5].raw = 7
    assert encoder.remote.sdo[0x6200].raw == 7


def test_default_pdos(encoder: Master) -> None:
    """TPDO1 carries the position each millisecond, TPDO2 at each SYNC."""
    encoder.start()
    encoder.run(5)
    encoder.send(SYNC)
    assert encoder.data(TPDO1) == [struct.pack("<i", 40000)] * 6
    assert encoder.data(TPDO2) == [struct.pack("<i", 40000)]


def test_the_device_type_selects_the_position_object(encoder: Master) -> None:
    """0x00080196 is an absolute linear encoder: its position is 0x6004, not 0x6020 (CiA 406)."""
    encoder.remote.tpdo.read()
    assert encoder.remote.sdo[0x1000].raw == 0x00080196
    assert [variable.index for n in (1, 2) for variable in encoder.remote.tpdo[n].map] == [
        0x6004
    ] * 2


def test_speed_of_a_plant_without_velocity_is_not_bound() -> None:
    """Without a velocity channel the speed has no source."""
    encoder = instrument("position_sensor", CHANNELS[:5])
    rows = {row.index: row.bound_to for row in encoder.network.node.bindings() if row.subindex == 1}
    assert (rows[0x6020], rows[0x6030]) == ("profile, from position", "")


def test_preset_by_rpdo(encoder: Master) -> None:
    """A controller may send the preset value in RPDO1."""
    encoder.remote.sdo[0x1400][1].raw = RPDO1
    encoder.start()
    encoder.send(RPDO1, struct.pack("<i", 777))
    encoder.run(1)
    assert position(encoder) == 777

"""The valve driver (CiA 408): states, set point, ramp, dead band, monitoring."""

import struct

import pytest
from device_master import EMCY, RPDO1, TPDO1, Master
from instruments import CHANNELS, FULL_SCALE, RATED_CURRENT, SAFE_CURRENT, instrument, show

INIT, DISABLED, HOLD, ACTIVE = 0x08, 0x09, 0x0B, 0x0F
FAULT_DISABLED, FAULT_HOLD = 0x01, 0x03


@pytest.fixture
def valve() -> Master:
    """Return a valve driver with a spool sensor, in PRE-OPERATIONAL."""
    return instrument("valve_driver")


def control(valve: Master, word: int, set_point: int = 0) -> None:
    """Send control word and set point by RPDO1."""
    valve.send(RPDO1, struct.pack("<Hh", word, set_point))


def state(valve: Master) -> int:
    """Return the status word."""
    return int(valve.remote.sdo[0x6041].raw)


def activate(valve: Master, set_point: int = 0) -> None:
    """Bring the valve to ACTIVE with a set point, as a controller does."""
    valve.start()
    for word in (INIT, DISABLED, HOLD, ACTIVE):
        control(valve, word, set_point)


def percent(valve: Master) -> float:
    """Return the coil current in percent of the rated one."""
    return 100.0 * valve.commands["valve_current"] / RATED_CURRENT


def write(valve: Master, index: int, value: int) -> None:
    """Write a variable, or the value of a record."""
    entry = valve.remote.sdo[index]
    (entry[1] if hasattr(entry, "keys") else entry).raw = value


def test_activation_by_four_control_words(valve: Master) -> None:
    """08, 09, 0B, 0F lead from INIT to ACTIVE, and the status word shows each state."""
    valve.start()
    assert state(valve) == INIT
    for word in (INIT, DISABLED, HOLD, ACTIVE):
        control(valve, word)
        assert state(valve) == word


def test_one_word_activates_too(valve: Master) -> None:
    """0F alone leads through DISABLED and HOLD, one state per tick."""
    valve.start()
    valve.remote.sdo[0x6040].raw = ACTIVE
    states = []
    for _ in range(3):
        states.append(valve.network.node.dictionary.entry(0x6041).value)
        valve.run(1)
    assert states == [DISABLED, HOLD, ACTIVE]


@pytest.mark.parametrize(("word", "reached"), [(HOLD, HOLD), (DISABLED, DISABLED), (INIT, INIT)])
def test_a_lower_word_leads_down(valve: Master, word: int, reached: int) -> None:
    """The valve leaves ACTIVE for the state that the control word requests."""
    activate(valve)
    for _ in range(3):
        control(valve, word)
    assert state(valve) == reached


def test_hold_bit_needs_the_disabled_bit(valve: Master) -> None:
    """Each state needs the bits of the lower states."""
    valve.start()
    for _ in range(4):
        control(valve, 0x0E)
    assert state(valve) == INIT


@pytest.mark.parametrize(
    ("set_point", "current"), [(FULL_SCALE, 100.0), (-FULL_SCALE, -100.0), (4096, 25.0)]
)
def test_set_point_is_a_share_of_the_rated_current(
    valve: Master, set_point: int, current: float
) -> None:
    """±16384 digits are ±100 % of 10 mA."""
    activate(valve, set_point)
    assert percent(valve) == pytest.approx(current)
    assert valve.remote.sdo[0x6310][1].raw == set_point


def test_set_point_acts_in_active_only(valve: Master) -> None:
    """INIT and DISABLED switch the power stage off; HOLD gives the hold set point."""
    valve.start()
    currents = {}
    for word in (INIT, DISABLED, HOLD, ACTIVE):
        control(valve, word, 8192)
        currents[word] = percent(valve)
    hold = 100.0 * SAFE_CURRENT / RATED_CURRENT
    assert currents == pytest.approx({INIT: 0, DISABLED: 0, HOLD: hold, ACTIVE: 50.0}, abs=0.01)


def test_hold_set_point_can_be_written(valve: Master) -> None:
    """A client can set the set point of HOLD."""
    write(valve, 0x6314, -1638)
    valve.start()
    for word in (INIT, DISABLED, HOLD):
        control(valve, word, 8192)
    assert percent(valve) == pytest.approx(-10.0, abs=0.01)


def test_local_mode_ignores_the_bus(valve: Master) -> None:
    """With device mode 2 the hold set point acts instead of the set point of the bus."""
    write(valve, 0x6042, 2)
    activate(valve, 8192)
    assert state(valve) == ACTIVE
    assert percent(valve) == pytest.approx(10.0, abs=0.01)


@pytest.mark.parametrize(("index", "value"), [(0x6042, 3), (0x6043, 9), (0x6330, 4)])
def test_modes_the_driver_lacks_are_refused(valve: Master, index: int, value: int) -> None:
    """An unsupported mode aborts with 0609 0031."""
    assert valve.abort_code(index, 0, bytes([value])) == 0x06090031


def test_leaving_operational_means_hold(valve: Master) -> None:
    """Outside NMT OPERATIONAL a valve returns to HOLD."""
    activate(valve, FULL_SCALE)
    valve.nmt(128)
    valve.run(1)
    assert state(valve) == HOLD
    assert percent(valve) == pytest.approx(10.0, abs=0.01)


def test_missed_deadline_gives_the_hold_set_point(valve: Master) -> None:
    """20 ms without RPDO1 raise 8250, and the set point reads as the hold set point."""
    activate(valve, FULL_SCALE)
    valve.run(25)
    assert valve.data(EMCY)[-1][:2] == b"\x50\x82"
    assert percent(valve) == pytest.approx(10.0, abs=0.01)


def test_reset_begins_in_init(valve: Master) -> None:
    """An NMT reset node switches the power stage off."""
    activate(valve, FULL_SCALE)
    valve.nmt(129)
    valve.run(2)
    assert state(valve) == INIT
    assert percent(valve) == 0.0


@pytest.mark.parametrize(
    ("index", "value", "set_point", "demand"),
    [
        (0x6320, 8192, FULL_SCALE, 8192),
        (0x6321, -4096, -FULL_SCALE, -4096),
        (0x6322, 0x0001_0002, 8192, 4096),
        (0x6322, 0x0003_0001, 8192, FULL_SCALE),
        (0x6323, 100, 8192, 8292),
        (0x6324, -100, 8192, 8092),
    ],
)
def test_conditioning_of_the_set_point(
    valve: Master, index: int, value: int, set_point: int, demand: int
) -> None:
    """Limits, scaling, offset and zero correction act, and 100 % is never exceeded."""
    write(valve, index, value)
    activate(valve, set_point)
    assert valve.remote.sdo[0x6310][1].raw == demand


def test_direction_dependent_gain_acts_on_one_side(valve: Master) -> None:
    """A factor of 3/5 applies to negative set points only."""
    write(valve, 0x6341, 0x0003_0005)
    write(valve, 0x6340, 1)
    activate(valve, -10000)
    assert valve.remote.sdo[0x6310][1].raw == -6000
    control(valve, ACTIVE, 10000)
    assert valve.remote.sdo[0x6310][1].raw == 10000


@pytest.mark.parametrize(
    ("set_point", "demand"),
    [
        (0, 0),
        (100, round(1638 + 0.9000244 * 100)),
        (50, round((1638 + 0.9000244 * 100) / 2)),
        (-100, -round(819 + 0.9500122 * 100)),
        (FULL_SCALE, FULL_SCALE),
        (-FULL_SCALE, -FULL_SCALE),
    ],
)
def test_dead_band_is_jumped_over(valve: Master, set_point: int, demand: int) -> None:
    """Small set points are moved just beyond the band; 0 and 100 % are unchanged."""
    for index, value in ((0x6343, 1638), (0x6344, 819), (0x6345, 100), (0x6342, 1)):
        write(valve, index, value)
    activate(valve, set_point)
    assert valve.remote.sdo[0x6310][1].raw == demand


def ramped(valve: Master, *set_points: int) -> list[int]:
    """Return the reference value in digits after 10 ms at each set point."""
    values = []
    for set_point in set_points:
        for _ in range(10):
            control(valve, ACTIVE, set_point)
        values.append(int(valve.network.node.dictionary.entry(0x6311, 1).value))
    return values


def test_ramp_takes_its_time(valve: Master) -> None:
    """With 100 ms from zero to 100 %, 10 ms are 10 %, in both directions."""
    write(valve, 0x6314, 0)
    write(valve, 0x6331, 100)
    write(valve, 0x6330, 1)
    activate(valve, 0)
    assert ramped(valve, FULL_SCALE, FULL_SCALE, 0, -FULL_SCALE) == [1638, 3277, 1638, 0]


def test_four_ramps_have_four_times(valve: Master) -> None:
    """Motion away from and towards zero, positive and negative, has four separate rates."""
    write(valve, 0x6314, 0)
    for index, time in ((0x6332, 100), (0x6333, 200), (0x6335, 400), (0x6336, 50)):
        write(valve, index, time)
    write(valve, 0x6330, 3)
    activate(valve, 0)
    up, down = ramped(valve, FULL_SCALE, 0)
    assert (up, down) == (1638, round(1638.4 - 409.6))
    ramped(valve, *[0] * 3)
    down, up = ramped(valve, -FULL_SCALE, 0)
    assert (down, up) == (-819, 0)


def test_control_deviation_is_a_fault(valve: Master) -> None:
    """A spool that does not follow for the delay time: FAULT_HOLD, 8301, hold set point."""
    write(valve, 0x6351, 1)
    activate(valve, 8192)
    for _ in range(60):
        control(valve, ACTIVE, 8192)
    assert state(valve) == FAULT_HOLD
    assert valve.remote.sdo[0x604E].raw == 0x8301
    assert valve.remote.sdo[0x1001].raw == 0x21
    assert [message[:2] for message in valve.data(EMCY)] == [b"\x01\x83"]
    assert percent(valve) == pytest.approx(10.0, abs=0.01)


def test_a_spool_that_follows_is_no_fault(valve: Master) -> None:
    """The actual value is the spool's position; within the thresholds there is no fault."""
    write(valve, 0x6351, 1)
    activate(valve, 8192)
    show(valve, spool_position=0.0049)
    for _ in range(100):
        control(valve, ACTIVE, 8192)
    assert state(valve) == ACTIVE
    assert valve.remote.sdo[0x6301][1].raw == round(0.49 * FULL_SCALE)
    assert valve.remote.sdo[0x6350][1].raw == 8192 - round(0.49 * FULL_SCALE)


def test_fault_is_reset_by_a_rising_bit(valve: Master) -> None:
    """A rising bit 3 leads to HOLD and ends the error, which can occur again."""
    write(valve, 0x6351, 1)
    activate(valve, 8192)
    for _ in range(60):
        control(valve, ACTIVE, 8192)
    show(valve, spool_position=0.005)
    for _ in range(3):
        control(valve, ACTIVE, 8192)
    assert state(valve) == FAULT_HOLD
    control(valve, HOLD & ~0x08, 8192)
    control(valve, HOLD, 8192)
    assert state(valve) == HOLD
    assert valve.remote.sdo[0x604E].raw == 0
    assert valve.data(EMCY)[-1][:3] == b"\0\0\0"


def test_fault_can_be_disabled(valve: Master) -> None:
    """Without bit H a fault switches the power stage off."""
    write(valve, 0x6351, 1)
    activate(valve, 8192)
    for _ in range(60):
        control(valve, ACTIVE, 8192)
    control(valve, DISABLED, 8192)
    assert state(valve) == FAULT_DISABLED
    assert percent(valve) == 0.0


def test_without_a_spool_sensor_the_actual_value_is_the_demand() -> None:
    """The actual value of an open-loop driver is its demand value."""
    valve = instrument("valve_driver", CHANNELS[:-1])
    activate(valve, 5000)
    assert valve.remote.sdo[0x6301][1].raw == 5000


def test_a_change_of_state_does_not_wait_for_the_event_timer(valve: Master) -> None:
    """TPDO1 carries each new status word in the tick of the change, with or without a timer."""
    valve.start()
    valve.run(3)
    valve.forget()
    for word in (DISABLED, HOLD, ACTIVE):
        control(valve, word)
    valve.run(10)
    words = [struct.unpack_from("<H", data)[0] for data in valve.data(TPDO1)]
    assert words == [DISABLED, HOLD, ACTIVE]


def test_default_pdos_are_those_of_real_drivers(valve: Master) -> None:
    """RPDO1 is control word and set point, TPDO1 status word and actual value each 100 ms."""
    valve.start()
    valve.run(210)
    assert valve.data(TPDO1) == [struct.pack("<Hh", INIT, 0)] * 2

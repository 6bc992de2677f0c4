"""Load cell and pressure transmitter (CiA 404): scaling, zero, tare, units, limits, filter."""

import struct

import pytest
from device_master import EMCY, RPDO1, TPDO1, Master
from instruments import instrument, show

ZERO, TARA = b"zero", b"tara"
PASCAL, MEGAPASCAL, MILLIBAR, KILONEWTON = 0x00220000, 0x06220000, 0xFD4E0000, 0x03210000


@pytest.fixture
def cell() -> Master:
    """Return a load cell that reads 500 N."""
    return instrument("load_cell")


@pytest.fixture
def transmitter() -> Master:
    """Return a pressure transmitter that reads 100, 20 and 160 bar."""
    return instrument("pressure_transmitter")


def real(master: Master, index: int, number: int = 1) -> float:
    """Return a REAL32."""
    return float(master.remote.sdo[index][number].raw)


def test_each_channel_has_its_inputs(transmitter: Master) -> None:
    """Three channels, three field values in volt and three process values in bar."""
    fields = [real(transmitter, 0x6100, n) for n in (1, 2, 3)]
    values = [real(transmitter, 0x6130, n) for n in (1, 2, 3)]
    assert fields == pytest.approx([4.0, 0.8, 6.4])
    assert values == pytest.approx([100.0, 20.0, 160.0])


def test_a_value_has_three_types(cell: Master) -> None:
    """REAL32, INTEGER16 and INTEGER32 show the same; integers count decimal digits."""
    show(cell, load_force=123.456)
    assert real(cell, 0x6130) == pytest.approx(123.456)
    assert cell.remote.sdo[0x7130][1].raw == 12346
    assert cell.remote.sdo[0x9130][1].raw == 12346
    cell.remote.sdo[0x6132][1].raw = 3
    cell.run(1)
    assert cell.remote.sdo[0x9130][1].raw == 123456


def test_a_small_integer_saturates(cell: Master) -> None:
    """A value beyond INTEGER16 is shown as the end of its range."""
    for force, shown in ((4000.0, 32767), (-4000.0, -32768)):
        show(cell, load_force=force)
        assert cell.remote.sdo[0x7130][1].raw == shown


@pytest.mark.parametrize(
    ("unit", "value", "digits"),
    [(PASCAL, 1e7, 1e9), (MEGAPASCAL, 10.0, 1000), (MILLIBAR, 1e5, 1e7)],
)
def test_unit_can_be_chosen(transmitter: Master, unit: int, value: float, digits: float) -> None:
    """In another unit the value is the same pressure; span and scaling are converted."""
    transmitter.remote.sdo[0x6131][1].raw = unit
    transmitter.run(1)
    assert real(transmitter, 0x6130) == pytest.approx(value)
    assert transmitter.remote.sdo[0x9130][1].raw == digits
    assert transmitter.remote.sdo[0x6150][1].raw == 0
    assert real(transmitter, 0x6130, 2) == pytest.approx(20.0)


@pytest.mark.parametrize("unit", [KILONEWTON, 0x00550000, 0x004E0001])
def test_a_pressure_is_no_force(transmitter: Master, unit: int) -> None:
    """A unit of another quantity, or an unknown unit, is refused with 0609 0030."""
    assert transmitter.abort_code(0x6131, 1, unit.to_bytes(4, "little")) == 0x06090030


def test_scaling_goes_through_two_points(cell: Master) -> None:
    """The second point sets the value of 1 mV/V."""
    cell.remote.sdo[0x6123][1].raw = 10000.0
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(1000.0)
    cell.remote.sdo[0x6121][1].raw = 100.0
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(100.0 + 0.1 * 9900.0)


def test_two_points_must_differ(cell: Master) -> None:
    """Two equal points are refused."""
    assert cell.abort_code(0x6122, 1, struct.pack("<f", 0.0)) == 0x06090030


def test_factor_and_offset_come_after_the_line(cell: Master) -> None:
    """Process value = factor x line + offset."""
    cell.remote.sdo[0x6126][1].raw = 2.0
    cell.remote.sdo[0x6127][1].raw = -10.0
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(990.0)


def test_autozero_makes_now_zero(cell: Master) -> None:
    """After "zero" the present force reads 0, and any other is counted from it."""
    assert cell.abort_code(0x6125, 1, ZERO) == 0
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(0.0, abs=1e-3)
    assert real(cell, 0x6124) == pytest.approx(-500.0)
    show(cell, load_force=650.0)
    assert real(cell, 0x6130) == pytest.approx(150.0)


def test_tare_leaves_the_gross_value(cell: Master) -> None:
    """After "tara" the net value reads 0, and the process value is unchanged."""
    assert cell.abort_code(0x6139, 1, TARA) == 0
    cell.run(1)
    assert (real(cell, 0x6130), real(cell, 0x6140)) == pytest.approx((500.0, 0.0))
    assert cell.remote.sdo[0x9140][1].raw == 0
    show(cell, load_force=450.0)
    assert cell.remote.sdo[0x9140][1].raw == -5000


@pytest.mark.parametrize(("index", "word"), [(0x6125, TARA), (0x6139, ZERO), (0x6125, bytes(4))])
def test_wrong_signature_does_nothing(cell: Master, index: int, word: bytes) -> None:
    """Anything else aborts with 0800 0020."""
    assert cell.abort_code(index, 1, word) == 0x08000020
    cell.run(1)
    assert (real(cell, 0x6130), real(cell, 0x6140)) == pytest.approx((500.0, 500.0))


def test_zero_of_one_input_leaves_the_others(transmitter: Master) -> None:
    """Each input has parameters of its own."""
    transmitter.abort_code(0x6125, 2, ZERO)
    transmitter.run(1)
    values = [real(transmitter, 0x6130, n) for n in (1, 2, 3)]
    assert values == pytest.approx([100.0, 0.0, 160.0], abs=1e-4)


def test_stored_zero_survives_a_reset(cell: Master) -> None:
    """A saved zero is kept over an NMT reset, an unsaved one is lost."""
    cell.abort_code(0x6125, 1, ZERO)
    cell.abort_code(0x1010, 1, b"save")
    cell.abort_code(0x6139, 1, TARA)
    cell.nmt(129)
    cell.run(2)
    assert (real(cell, 0x6124), real(cell, 0x6138)) == pytest.approx((-500.0, 0.0))
    assert real(cell, 0x6130) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("force", "end", "bits"), [(5001.0, 0, 2), (-5001.0, 0, 4), (10.0, 1, 2)])
def test_status_shows_overload(cell: Master, force: float, end: int, bits: int) -> None:
    """Beyond the span, or at the end of the transducer, the status shows the direction."""
    show(cell, overrange=end, load_force=force)
    assert cell.remote.sdo[0x6150][1].raw == bits
    show(cell, load_force=0.0)
    assert cell.remote.sdo[0x6150][1].raw == 0


def test_emergency_names_only_a_sensor_of_this_node(cell: Master) -> None:
    """A load cell does not report errors of pressures."""
    show(cell, overrange=1, pressure_a=300e5)
    assert cell.data(EMCY) == []
    show(cell, overrange=1, load_force=6000.0)
    assert [message[:2] for message in cell.data(EMCY)] == [b"\x14\xff"]


def test_an_input_that_is_off_is_not_valid(cell: Master) -> None:
    """In operating mode 0 the value is kept and the status shows it as invalid."""
    cell.remote.sdo[0x6112][1].raw = 0
    show(cell, load_force=100.0)
    assert real(cell, 0x6130) == pytest.approx(500.0)
    assert cell.remote.sdo[0x6150][1].raw == 1


def test_no_number_is_not_valid(cell: Master) -> None:
    """A reading of NaN sets the status to invalid."""
    show(cell, load_force=float("nan"))
    assert cell.remote.sdo[0x6150][1].raw == 1
    assert real(cell, 0x6130) == pytest.approx(500.0)


def values_of(cell: Master, forces: list[float]) -> list[float]:
    """Return the process value in each of some ticks."""
    values = []
    for force in forces:
        show(cell, load_force=force)
        values.append(float(cell.network.node.dictionary.entry(0x6130, 1).value))
    return values


def test_moving_average(cell: Master) -> None:
    """A step arrives in as many equal parts as samples are averaged."""
    cell.remote.sdo[0x61A1][1].raw = 4
    cell.remote.sdo[0x61A0][1].raw = 1
    values_of(cell, [0.0] * 8)
    assert values_of(cell, [400.0] * 5) == pytest.approx([100.0, 200.0, 300.0, 400.0, 400.0])


def test_repeating_average(cell: Master) -> None:
    """The value is the mean of n samples, held for the next n samples."""
    cell.remote.sdo[0x61A1][1].raw = 3
    cell.remote.sdo[0x61A0][1].raw = 2
    values = values_of(cell, [100.0, 200.0, 300.0] * 4)
    assert set(map(round, values[6:])) == {200}
    jump = values_of(cell, [900.0] * 6)
    assert len(set(map(round, jump))) <= 3
    assert jump[-1] == pytest.approx(900.0)


def event_driven(cell: Master, **parameters: float) -> None:
    """Make TPDO1 event-driven, with these interrupt parameters."""
    for name, index in (("delta", 0x6133), ("lower", 0x6134), ("upper", 0x6135)):
        if name in parameters:
            cell.remote.sdo[index][1].raw = parameters[name]
    cell.remote.sdo[0x1800][5].raw = 0
    cell.start()
    show(cell, load_force=500.0)
    cell.forget()


def sent(cell: Master, *forces: float) -> list[float]:
    """Return the forces in TPDO1 for a series of forces."""
    cell.forget()
    for force in forces:
        show(cell, load_force=force)
    return [struct.unpack_from("<i", data)[0] / 100.0 for data in cell.data(TPDO1)]


def test_without_interrupt_every_change_is_sent(cell: Master) -> None:
    """An event-driven TPDO without delta and limits is sent at every change."""
    event_driven(cell)
    assert sent(cell, 501.0, 502.0, 502.0, 503.0) == [501.0, 502.0, 503.0]


def test_interrupt_delta(cell: Master) -> None:
    """Only a change by the delta since the last message is an event; small changes add up."""
    event_driven(cell, delta=9.5)
    assert sent(cell, 505.0, 509.0, 510.0, 515.0, 519.0, 500.0) == [510.0, 500.0]


def test_interrupt_limits(cell: Master) -> None:
    """Crossing a limit in either direction is an event; staying beyond it is not."""
    event_driven(cell, lower=100.0, upper=900.0)
    assert sent(cell, 800.0, 901.0, 950.0, 850.0, 200.0, 99.0, 50.0, 101.0) == [
        901.0,
        850.0,
        99.0,
        101.0,
    ]


def test_status_is_sent_for_any_delta(cell: Master) -> None:
    """A delta applies to the value, not to the status."""
    event_driven(cell, delta=1e6)
    cell.forget()
    show(cell, overrange=1, load_force=501.0)
    assert [data[4] for data in cell.data(TPDO1)] == [2]


def test_event_timer_and_delta_work_together(cell: Master) -> None:
    """With both, messages are sent by the timer, and at once for a jump."""
    cell.remote.sdo[0x6133][1].raw = 10.0
    cell.remote.sdo[0x1800][5].raw = 50
    cell.start()
    cell.run(60)
    before = len(cell.data(TPDO1))
    show(cell, load_force=600.0)
    assert len(cell.data(TPDO1)) == before + 1


def test_autozero_and_tare_by_rpdo(cell: Master) -> None:
    """A controller may send the signatures in RPDO1; other data are ignored."""
    cell.remote.sdo[0x1400][1].raw = RPDO1
    cell.start()
    cell.send(RPDO1, bytes(4) + TARA)
    cell.run(1)
    assert (real(cell, 0x6130), real(cell, 0x6140)) == pytest.approx((500.0, 0.0))
    cell.send(RPDO1, TARA + ZERO)
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(500.0)
    cell.send(RPDO1, ZERO + bytes(4))
    cell.run(1)
    assert real(cell, 0x6130) == pytest.approx(0.0, abs=1e-3)


def test_tare_by_rpdo(cell: Master) -> None:
    """The tare itself may be mapped too."""
    mapping = cell.remote.sdo[0x1600]
    mapping[0].raw = 0
    mapping[1].raw = 0x6138_0120
    mapping[0].raw = 1
    cell.remote.sdo[0x1400][1].raw = RPDO1
    cell.start()
    cell.send(RPDO1, struct.pack("<f", 120.0))
    cell.run(1)
    assert real(cell, 0x6140) == pytest.approx(380.0)

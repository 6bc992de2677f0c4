"""Chapter 3, first part: existing PDOs, and transmission of TPDOs (CiA 301 7.2.2)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import NO_SUCH_OBJECT
from hil_emulator.conformance.device import PRE_OPERATIONAL, STOPPED, Device
from hil_emulator.conformance.pdo import (
    RPDO_RECORDS,
    TO_MAPPING,
    TPDO_RECORDS,
    TRANSMISSION_TYPE,
    Pdo,
)
from hil_emulator.conformance.situations import (
    ACYCLIC_SYNC,
    CYCLIC,
    EVENT,
    REMOTE,
    SYNC_COUNTER,
    TIMER,
    check_not_sent,
    check_sent,
)


def scan(device: Device, records: range) -> int:
    """Check that the PDOs of a range are those of the EDS; return their number."""
    for index in records:
        if index not in device.eds:
            code = device.sdo.read_code(index)
            assert code in NO_SUCH_OBJECT, f"{index:04X} is not in the EDS, abort {code:08X}"
            continue
        pdo = Pdo(device, index)
        assert device.sdo.read(index) >= TRANSMISSION_TYPE, f"{index:04X}: too few entries"
        assert pdo.can_id or not pdo.valid, f"{pdo.name} has no identifier"
        assert pdo.get(TRANSMISSION_TYPE) not in range(241, 252), f"{pdo.name}: reserved type"
        assert device.sdo.read_code(index + TO_MAPPING) == 0, f"{pdo.name} has no mapping"
    return len(device.eds.indices(records))


@case("3.1")
def test_rpdos_are_those_of_the_eds(device: Device) -> None:
    """Of all 512 possible RPDOs only those of the EDS exist, and NrOfRXPDO is their number."""
    assert scan(device, RPDO_RECORDS) == device.eds.count("NrOfRXPDO")


@case("3.2")
def test_tpdos_are_those_of_the_eds(device: Device) -> None:
    """Of all 512 possible TPDOs only those of the EDS exist, and NrOfTXPDO is their number."""
    assert scan(device, TPDO_RECORDS) == device.eds.count("NrOfTXPDO")


@case("3.3")
def test_operational_remote_frame(device: Device) -> None:
    """Each remote frame is answered by one TPDO."""
    check_sent(device, REMOTE)


@case("3.4")
def test_operational_event(device: Device) -> None:
    """An event-driven TPDO is sent no more often than its inhibit time allows."""
    check_sent(device, EVENT)


@case("3.5")
def test_operational_event_timer(device: Device) -> None:
    """The event timer triggers the TPDO periodically."""
    check_sent(device, TIMER)


@case("3.6")
def test_operational_cyclic(device: Device) -> None:
    """With type 2, six SYNC trigger three TPDOs."""
    check_sent(device, CYCLIC)


@case("3.7")
def test_operational_acyclic(device: Device) -> None:
    """With type 0 a TPDO is sent only after a SYNC."""
    check_sent(device, ACYCLIC_SYNC)


@case("3.8")
def test_operational_sync_start_value(device: Device) -> None:
    """Of SYNC 1 to 5, those from the start value 3 on trigger the TPDO."""
    check_sent(device, SYNC_COUNTER)


@case("3.9")
def test_stopped_remote_frame(device: Device) -> None:
    """In STOPPED a remote frame is not answered."""
    check_not_sent(device, REMOTE, STOPPED)


@case("3.10")
def test_stopped_event(device: Device) -> None:
    """In STOPPED no event-driven TPDO is sent."""
    check_not_sent(device, EVENT, STOPPED)


@case("3.11")
def test_stopped_event_timer(device: Device) -> None:
    """In STOPPED the event timer triggers no TPDO."""
    check_not_sent(device, TIMER, STOPPED)


@case("3.12")
def test_stopped_cyclic(device: Device) -> None:
    """In STOPPED SYNC triggers no TPDO."""
    check_not_sent(device, CYCLIC, STOPPED)


@case("3.13")
def test_stopped_acyclic(device: Device) -> None:
    """In STOPPED SYNC triggers no acyclic TPDO."""
    check_not_sent(device, ACYCLIC_SYNC, STOPPED)


@case("3.14")
def test_stopped_sync_start_value(device: Device) -> None:
    """In STOPPED a SYNC with the start value triggers no TPDO."""
    check_not_sent(device, SYNC_COUNTER, STOPPED)


@case("3.15")
def test_pre_operational_remote_frame(device: Device) -> None:
    """In PRE-OPERATIONAL a remote frame is not answered."""
    check_not_sent(device, REMOTE, PRE_OPERATIONAL)


@case("3.16")
def test_pre_operational_event(device: Device) -> None:
    """In PRE-OPERATIONAL no event-driven TPDO is sent."""
    check_not_sent(device, EVENT, PRE_OPERATIONAL)


@case("3.17")
def test_pre_operational_event_timer(device: Device) -> None:
    """In PRE-OPERATIONAL the event timer triggers no TPDO."""
    check_not_sent(device, TIMER, PRE_OPERATIONAL)


@case("3.18")
def test_pre_operational_cyclic(device: Device) -> None:
    """In PRE-OPERATIONAL SYNC triggers no TPDO."""
    check_not_sent(device, CYCLIC, PRE_OPERATIONAL)


@case("3.19")
def test_pre_operational_acyclic(device: Device) -> None:
    """In PRE-OPERATIONAL SYNC triggers no acyclic TPDO."""
    check_not_sent(device, ACYCLIC_SYNC, PRE_OPERATIONAL)


@case("3.20")
def test_pre_operational_sync_start_value(device: Device) -> None:
    """In PRE-OPERATIONAL a SYNC with the start value triggers no TPDO."""
    check_not_sent(device, SYNC_COUNTER, PRE_OPERATIONAL)

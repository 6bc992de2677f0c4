"""Chapter 9, additional cases: invalid NMT commands (CiA 301 7.2.8.3.1)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import (
    OPERATIONAL,
    PRE_OPERATIONAL,
    START,
    STOP,
    Device,
)
from hil_emulator.conformance.test_states import check_state

UNKNOWN = (0, 3, 127, 131, 255)
EVERYBODY = 0


@case("9.301")
def test_nmt_has_two_bytes(device: Device) -> None:
    """Messages of 0, 1, 3 and 8 bytes change no state."""
    start = bytes([START, device.node_id])
    for data in (b"", start[:1], start + b"\0", start.ljust(8, b"\0"), bytes([STOP])):
        device.wire.send(0x000, data)
    check_state(device, PRE_OPERATIONAL)


@case("9.302")
def test_unknown_commands_are_ignored(device: Device) -> None:
    """Commands that CiA 301 does not define change no state, tried in two states."""
    for state in (PRE_OPERATIONAL, OPERATIONAL):
        device.enter(state)
        since = len(device.wire.log)
        for command in UNKNOWN:
            device.nmt(command)
        check_state(device, state)
        assert b"\0" not in device.wire.heard(device.error_control_id, since), "a reset"


@case("9.303")
def test_29_bit_identifiers_are_others(device: Device) -> None:
    """Frames with 29-bit identifiers are not accepted as NMT or SDO requests."""
    device.wire.send(0x000, bytes([START, EVERYBODY]), extended=True)
    check_state(device, PRE_OPERATIONAL)
    since = len(device.wire.log)
    device.wire.send(0x600 + device.node_id, bytes.fromhex("4000100000000000"), extended=True)
    device.wire.run(50)
    assert device.wire.heard(0x580 + device.node_id, since) == []

"""Ways to give the device an error on purpose, so that it sends an emergency."""

import pytest

from hil_emulator.conformance.device import (
    GUARD_TIME,
    HEARTBEAT_CONSUMER,
    LIFE_TIME_FACTOR,
    OPERATIONAL,
    SYNC_COB_ID,
    Device,
)
from hil_emulator.conformance.pdo import RPDO_RECORDS, Pdo
from hil_emulator.conformance.situations import SYNC

PDO_TOO_SHORT, SYNC_LENGTH, LIFE_GUARD_OR_HEARTBEAT = 0x8210, 0x8240, 0x8130
WATCH_MS = 50
LOST = b"\x05"
"""A heartbeat of a node that will send no other."""


def other_node(device: Device) -> int:
    """Return a node-ID that is not the device's."""
    return 126 if device.node_id == 127 else 127


def watch_other_node(device: Device, time_ms: int, subindex: int = 1) -> None:
    """Let the device watch the heartbeat of another node."""
    value = other_node(device) << 16 | time_ms
    device.sdo.write(HEARTBEAT_CONSUMER, subindex, value, 4)


def provoke(device: Device) -> bytes:
    """Cause an error, in the simplest way the device offers; return its emergency.

    The ways: a watched heartbeat stops, an RPDO is too short, SYNC is too long, guarding stops.
    """
    since = len(device.wire.log)
    if device.eds.writable(HEARTBEAT_CONSUMER, 1):
        watch_other_node(device, WATCH_MS)
        device.wire.send(0x700 + other_node(device), LOST)
        code = LIFE_GUARD_OR_HEARTBEAT
    elif device.eds.indices(RPDO_RECORDS):
        pdo = Pdo(device, device.eds.indices(RPDO_RECORDS)[0])
        can_id = pdo.can_id
        device.enter(OPERATIONAL)
        device.wire.send(can_id)
        code = PDO_TOO_SHORT
    elif (SYNC_COB_ID, 0) in device.eds:
        device.enter(OPERATIONAL)
        device.wire.send(SYNC, bytes(8))
        code = SYNC_LENGTH
    elif device.eds.writable(GUARD_TIME) and device.wire.remote_frames:
        device.sdo.write(GUARD_TIME, 0, WATCH_MS, 2)
        device.sdo.write(LIFE_TIME_FACTOR, 0, 1, 1)
        device.guard()
        code = LIFE_GUARD_OR_HEARTBEAT
    else:
        pytest.skip("the device offers no way to cause an error from the bus")
    emergency = device.await_emergency(code, since)
    assert emergency is not None, f"no emergency {code:04X}"
    return emergency

"""Errors that a master can cause from the bus to make the device send an emergency."""

from abc import ABC, abstractmethod

import pytest

from hil_emulator.conformance.demands import need_object
from hil_emulator.conformance.device import (
    EMCY_COB_ID,
    GUARD_TIME,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    LIFE_TIME_FACTOR,
    OPERATIONAL,
    SYNC_COB_ID,
    Device,
)
from hil_emulator.conformance.pdo import EVENT_TIMER, RPDO_RECORDS, TRANSMISSION_TYPE, receiving
from hil_emulator.conformance.situations import SYNC

PDO_TOO_SHORT, RPDO_OVERDUE = 0x8210, 0x8250
SYNC_LENGTH, LIFE_GUARD_OR_HEARTBEAT = 0x8240, 0x8130
WATCH_MS = 50
LONG_MS = 30_000
LOST = b"\x05"
"""A heartbeat of a node that stops afterwards."""


def other_node(device: Device) -> int:
    """Return a node-ID that is not the device's."""
    return 126 if device.node_id == 127 else 127


def watch_other_node(device: Device, time_ms: int, subindex: int = 1) -> None:
    """Make the device monitor the heartbeat of another node."""
    value = other_node(device) << 16 | time_ms
    device.sdo.write(HEARTBEAT_CONSUMER, subindex, value, 4)


def beat(device: Device) -> None:
    """Send a heartbeat of the other node."""
    device.wire.send(0x700 + other_node(device), LOST)


class Way(ABC):
    """One way to cause an error."""

    code: int
    """Emergency error code."""
    repeatable = False
    """Whether `cause` can be repeated while the error is active."""

    def __init__(self, device: Device) -> None:
        self.device = device

    @property
    @abstractmethod
    def offered(self) -> bool:
        """Whether the device has the service."""

    @abstractmethod
    def cause(self) -> None:
        """Cause the error."""

    @abstractmethod
    def end(self) -> None:
        """End the error, and extend the time until it would occur again."""

    def correct(self) -> None:
        """End the error without a change of parameters, because that may clear the error, too."""
        self.end()


class LostNode(Way):
    """A monitored heartbeat stops."""

    code = LIFE_GUARD_OR_HEARTBEAT

    @property
    def offered(self) -> bool:
        """Whether the device monitors heartbeats."""
        return self.device.eds.writable(HEARTBEAT_CONSUMER, 1)

    def cause(self) -> None:
        """Send a single heartbeat."""
        watch_other_node(self.device, WATCH_MS)
        beat(self.device)

    def end(self) -> None:
        """Send a heartbeat, and extend the time until the next."""
        beat(self.device)
        watch_other_node(self.device, LONG_MS)
        beat(self.device)

    def correct(self) -> None:
        """Send a heartbeat."""
        beat(self.device)


class ShortRpdo(Way):
    """An RPDO has too few bytes."""

    code = PDO_TOO_SHORT
    repeatable = True
    _can_id = 0

    @property
    def offered(self) -> bool:
        """Whether the device has an RPDO that can be set up."""
        indices = self.device.eds.indices(RPDO_RECORDS)
        return bool(indices) and self.device.eds.writable(indices[0], TRANSMISSION_TYPE)

    def cause(self) -> None:
        """Send an RPDO without data."""
        if not self._can_id:
            pdo = receiving(self.device)
            self._size = pdo.size()
            pdo.enable()
            self._can_id = pdo.can_id
        self.device.enter(OPERATIONAL)
        self.device.wire.send(self._can_id)

    def end(self) -> None:
        """Send an RPDO of the correct length."""
        self.device.enter(OPERATIONAL)  # the error may have ended this state
        self.device.wire.send(self._can_id, bytes(self._size))


class OverdueRpdo(ShortRpdo):
    """An RPDO stops."""

    code = RPDO_OVERDUE
    repeatable = False

    @property
    def offered(self) -> bool:
        """Whether the device has an RPDO that can be set up, with an event timer."""
        indices = self.device.eds.indices(RPDO_RECORDS)
        return super().offered and self.device.eds.writable(indices[0], EVENT_TIMER)

    def cause(self) -> None:
        """Send a single RPDO."""
        pdo = receiving(self.device)
        pdo.set(EVENT_TIMER, WATCH_MS)
        self._size = pdo.size()
        pdo.enable()
        self._can_id = pdo.can_id
        self.device.enter(OPERATIONAL)
        self.device.wire.send(self._can_id, bytes(self._size))


class LongSync(Way):
    """SYNC has eight bytes."""

    code = SYNC_LENGTH
    repeatable = True

    @property
    def offered(self) -> bool:
        """Whether the device consumes SYNC."""
        return (SYNC_COB_ID, 0) in self.device.eds

    def cause(self) -> None:
        """Send a SYNC that is too long."""
        self.device.prepare_sync()
        self.device.enter(OPERATIONAL)
        self.device.wire.send(SYNC, bytes(8))

    def end(self) -> None:
        """Send a SYNC without data."""
        self.device.wire.send(SYNC)


class LostMaster(Way):
    """Guarding requests stop."""

    code = LIFE_GUARD_OR_HEARTBEAT

    @property
    def offered(self) -> bool:
        """Whether the device has life guarding and the bus carries remote frames."""
        return self.device.eds.writable(GUARD_TIME) and self.device.wire.remote_frames

    def cause(self) -> None:
        """Send a single request, with the heartbeat off: a device with a heartbeat ignores it."""
        if self.device.eds.writable(HEARTBEAT_PRODUCER):
            self.device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
        self.device.sdo.write(GUARD_TIME, 0, WATCH_MS, 2)
        self.device.sdo.write(LIFE_TIME_FACTOR, 0, 1, 1)
        self.device.guard()

    def end(self) -> None:
        """Send a request, and extend the time until the next."""
        self.device.sdo.write(GUARD_TIME, 0, LONG_MS, 2)
        self.device.guard()

    def correct(self) -> None:
        """Send a request."""
        self.device.guard()


def ways(device: Device) -> list[Way]:
    """Return the ways that the device offers; skip the case if it has no emergencies."""
    need_object(device, EMCY_COB_ID)
    kinds = (LostNode, ShortRpdo, OverdueRpdo, LongSync, LostMaster)
    usable: list[Way] = [way for way in (kind(device) for kind in kinds) if way.offered]
    if not usable:
        pytest.skip("the device offers no way to cause an error from the bus")
    return usable


def bring_about(way: Way) -> bytes:
    """Cause an error and return its emergency."""
    since = len(way.device.wire.log)
    way.cause()
    emergency = way.device.await_emergency(way.code, since)
    assert emergency is not None, f"no emergency {way.code:04X}"
    return emergency


def provoke(device: Device) -> bytes:
    """Cause an error, in the simplest way the device offers; return its emergency."""
    return bring_about(ways(device)[0])

"""A foreign device: `canopen.LocalNode`, in lock-step with the suite.

`LocalNode` is an SDO server with a heartbeat. This module adds the part of an application: it sends
boot-up after a reset and enters PRE-OPERATIONAL. `send_message`, `send_periodic` and `notify` are
the override points of `canopen.Network`, so that there is no thread and no clock.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import canopen

from hil_emulator.frame import Frame

NODE_ID = 7
TICK_S = 0.001
RESET_COMMUNICATION = b"\x82"
ALL_OBJECTS, COMMUNICATION_OBJECTS = range(0x1000, 0x10000), range(0x1000, 0x2000)

_EDS = """[FileInfo]
FileName=local.eds

[DeviceInfo]
NrOfRXPDO=0
NrOfTXPDO=0
LSS_Supported=0

[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018

[OptionalObjects]
SupportedObjects=2
1=0x1008
2=0x1017

[ManufacturerObjects]
SupportedObjects=1
1=0x2000

[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2

"""
_OBJECTS = (
    ("1000", "Device type", 0x7, "ro", "0"),
    ("1001", "Error register", 0x5, "ro", "0"),
    ("1008", "Device name", 0x9, "const", "a local node of canopen"),
    ("1017", "Heartbeat time", 0x6, "rw", "0"),
    ("1018sub0", "Count", 0x5, "ro", "1"),
    ("1018sub1", "Vendor-ID", 0x7, "ro", "0x123"),
    ("2000", "Parameter", 0x6, "rw", "5"),
)


def write_eds(path: Path) -> Path:
    """Write an EDS with the services of `LocalNode`: SDO server, NMT slave and heartbeat."""
    text = _EDS
    for place, name, data_type, access, default in _OBJECTS:
        text += (
            f"[{place}]\nParameterName={name}\nObjectType=0x7\nDataType=0x{data_type:04X}\n"
            f"AccessType={access}\nDefaultValue={default}\nPDOMapping=0\n\n"
        )
    path.write_text(text)
    return path


class _Periodic:
    """The result of `send_periodic`: a frame and the time of the next transmission."""

    def __init__(self, can_id: int, data: Iterable[int], period: float, now: float) -> None:
        self.can_id, self.data, self.period, self.next = can_id, bytes(data), period, now
        self.running = True

    def stop(self) -> None:
        """Stop sending."""
        self.running = False

    def update(self, data: Iterable[int]) -> None:
        """Send other data from now on."""
        self.data = bytes(data)


class LocalDevice(canopen.Network):
    """A `LocalNode` and the bus to it, as the suite's `Wire` needs it.

    Args:
        eds: of the device.
        self_starting: whether the device enters OPERATIONAL after boot-up.

    """

    def __init__(self, eds: Path, *, self_starting: bool = False) -> None:
        super().__init__()
        self._self_starting = self_starting
        self._now = 0.0
        self._reset = ALL_OBJECTS
        self._sent: list[Frame] = []
        self._arrived: list[Frame] = []
        self._periodic: list[_Periodic] = []
        self._device: Any = self.create_node(NODE_ID, str(eds))
        self._boot()

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Store a frame of the device."""
        self._sent.append(Frame(can_id, bytes(data), remote))

    def send_periodic(self, can_id: int, data: Any, period: float, remote: bool = False) -> Any:
        """Store a frame that the device sends periodically."""
        self._periodic.append(_Periodic(can_id, data, period, self._now))
        return self._periodic[-1]

    def disconnect(self) -> None:
        """Do nothing."""

    def send(self, frames: Iterable[Frame]) -> None:
        """Pass frames of the suite to the device."""
        self._arrived += frames

    def receive(self) -> list[Frame]:
        """Return the frames that the device has sent."""
        sent, self._sent = self._sent, []
        return sent

    def wait(self, timeout: float) -> bool:
        """Return at once: time is stepped."""
        return False

    def step(self) -> None:
        """Advance the time by 1 ms."""
        arrived, self._arrived = self._arrived, []
        for frame in arrived:
            if frame.can_id == 0 and frame.data[:1] == RESET_COMMUNICATION:
                self._reset = COMMUNICATION_OBJECTS
            if not frame.remote and not frame.extended:
                self.notify(frame.can_id, bytearray(frame.data), self._now)
        if self._device.nmt.state == "INITIALISING":
            self._boot()
        self._now += TICK_S
        for task in [task for task in self._periodic if task.running]:
            if self._now >= task.next:
                task.next += task.period
                self._sent.append(Frame(task.can_id, task.data))

    def _boot(self) -> None:
        for index in [index for index in self._device.data_store if index in self._reset]:
            del self._device.data_store[index]
        self._reset = ALL_OBJECTS
        self._device.nmt.state = "INITIALISING"
        self._device.nmt.state = "PRE-OPERATIONAL"
        if self._self_starting:
            self._device.nmt.state = "OPERATIONAL"

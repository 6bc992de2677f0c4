"""LSS slave: node-ID by identity instead of by switch (CiA 305).

The identity object 0x1018 is the LSS address. A new node-ID is pending until the next NMT reset
communication; 0xFF makes the node unconfigured: it then stays off the bus but for LSS, and boots
when a master gives it a node-ID and leaves the configuration state. The bit rate belongs to the
bus the emulator is attached to and cannot be configured.
"""

from collections.abc import Callable
from enum import IntEnum

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import UNCONFIGURED, Dictionary
from hil_emulator.device.storage import Storage
from hil_emulator.frame import Frame

LSS_REQUEST, LSS_ANSWER = 0x7E5, 0x7E4
IDENTITY = 0x1018
NODE_IDS = frozenset({*range(1, 128), UNCONFIGURED})
STORED_NODE_ID = (0x0000, 0x00)
"""Key of the stored node-ID; no object has it."""

_OK, _REFUSED, _STORE_FAILED = 0, 1, 2
_NO_BIT_CHECK = 0x80


class _Service(IntEnum):
    """LSS command specifiers (CiA 305)."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    STORE = 0x17
    SWITCH_VENDOR = 0x40
    SWITCH_SERIAL = 0x43
    SWITCHED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_UNCONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    UNCONFIGURED_IDENTIFIED = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class LssSlave:
    """Answers an LSS master.

    Args:
        dictionary: 0x1018 is the address.
        storage: where the node-ID is kept by the store service.
        on_leave: called when an unconfigured node has got its node-ID.

    Attributes:
        node_id: the present node-ID, 0xFF if unconfigured.
        pending: node-ID that takes effect with `activate`.
        answers: answers that have not been sent yet.

    """

    quiet_until_ns = NEVER  # acts only outside OPERATIONAL

    def __init__(
        self, dictionary: Dictionary, storage: Storage, on_leave: Callable[[], None]
    ) -> None:
        parts = [dictionary.get(IDENTITY, n) for n in (1, 2, 3, 4)]
        self._address = [0 if part is None else int(part.value) for part in parts]
        self._storage = storage
        self._on_leave = on_leave
        stored = storage.load().get(STORED_NODE_ID)
        self.node_id = dictionary.node_id if stored is None else stored[0]
        self.pending = self.node_id
        self._configuring = False
        # Number of address parts received in order that match this device, by service.
        self._selected = 0
        self._identified = 0
        self._scan_part = 0
        self.answers: list[bytes] = []

    def activate(self) -> int:
        """Put the pending node-ID into force and return it: NMT reset communication."""
        self.node_id = self.pending
        self._configuring = False
        return self.node_id

    def request(self, now_ns: int, data: bytes) -> None:
        """Handle a request; unknown requests are ignored, as CiA 305 requires."""
        if len(data) != 8:
            return
        service, number = data[0], int.from_bytes(data[1:5], "little")
        if service == _Service.SWITCH_GLOBAL:
            self._switch(data[1] == 1)
        elif _Service.SWITCH_VENDOR <= service <= _Service.SWITCH_SERIAL:
            self._switch_selective(service - _Service.SWITCH_VENDOR, number)
        elif _Service.IDENTIFY_VENDOR <= service <= _Service.IDENTIFY_SERIAL_HIGH:
            self._identify(service - _Service.IDENTIFY_VENDOR, number)
        elif service == _Service.IDENTIFY_UNCONFIGURED:
            if self.node_id == UNCONFIGURED:
                self._answer(_Service.UNCONFIGURED_IDENTIFIED)
        elif service == _Service.FASTSCAN:
            self._fastscan(number, data[5], data[6], data[7])
        elif self._configuring:
            self._configure(service, data[1])

    def publish(self, frames: list[Frame]) -> None:
        """Append the answers."""
        frames.extend([Frame(LSS_ANSWER, answer) for answer in self.answers])
        self.answers.clear()

    def _answer(self, service: int, data: bytes = b"") -> None:
        self.answers.append(bytes([service]) + data.ljust(7, b"\0"))

    def _switch(self, configuring: bool) -> None:
        leaving = self._configuring and not configuring
        self._configuring = configuring
        if leaving and self.node_id == UNCONFIGURED and self.pending != UNCONFIGURED:
            self._on_leave()

    def _switch_selective(self, part: int, number: int) -> None:
        """Enter configuration once vendor, product, revision and serial came in order."""
        begins = part == 0  # restarts after an incomplete sequence, too
        expected = (begins or part == self._selected) and number == self._address[part]
        self._selected = part + 1 if expected else 0
        if self._selected == len(self._address) and not self._configuring:
            self._configuring = True
            self._selected = 0
            self._answer(_Service.SWITCHED)

    def _identify(self, part: int, number: int) -> None:
        """Answer where vendor and product match and revision and serial are in range."""
        vendor, product, revision, serial = self._address
        inside = (
            number == vendor,
            number == product,
            number <= revision,
            revision <= number,
            number <= serial,
            serial <= number,
        )
        expected = part in (0, self._identified)  # a first part restarts the sequence
        self._identified = part + 1 if expected and inside[part] else 0
        if self._identified == len(inside):
            self._identified = 0
            self._answer(_Service.IDENTIFIED)

    def _fastscan(self, number: int, bit: int, part: int, following: int) -> None:
        """Answer while the scanned bits match the device's address (CiA 305, fastscan)."""
        if self.node_id != UNCONFIGURED or self._configuring:
            return
        if bit == _NO_BIT_CHECK:
            self._scan_part = 0
            self._answer(_Service.IDENTIFIED)
            return
        if part != self._scan_part or part > 3 or following > 3 or bit > 31:
            return
        if (number ^ self._address[part]) >> bit:
            return
        if bit == 0:
            self._scan_part = following
            self._configuring = following < part
        self._answer(_Service.IDENTIFIED)

    def _configure(self, service: int, value: int) -> None:
        if service == _Service.CONFIGURE_NODE_ID:
            accepted = value in NODE_IDS
            if accepted:
                self.pending = value
            self._answer(service, bytes([_OK if accepted else _REFUSED]))
        elif service == _Service.CONFIGURE_BIT_TIMING:
            self._answer(service, bytes([_REFUSED]))
        elif service == _Service.STORE:
            self._answer(service, bytes([self._store()]))
        elif _Service.INQUIRE_VENDOR <= service <= _Service.INQUIRE_SERIAL:
            part = self._address[service - _Service.INQUIRE_VENDOR]
            self._answer(service, part.to_bytes(4, "little"))
        elif service == _Service.INQUIRE_NODE_ID:
            self._answer(service, bytes([self.node_id]))

    def _store(self) -> int:
        try:
            self._storage.save({**self._storage.load(), STORED_NODE_ID: bytes([self.pending])})
        except OSError:
            return _STORE_FAILED
        return _OK

"""The PDOs of the device, as a master configures them (CiA 301 7.5.2.35 to 7.5.2.38)."""

from collections.abc import Sequence

import pytest

from hil_emulator.conformance.device import Device
from hil_emulator.conformance.expectation import encoded
from hil_emulator.conformance.parameters import APPLICATION
from hil_emulator.conformance.sdo_client import Aborted
from hil_emulator.device.entry import Entry

RPDO_RECORDS, TPDO_RECORDS = range(0x1400, 0x1600), range(0x1800, 0x1A00)
PREDEFINED = 4
"""PDOs of each direction that have identifiers in the predefined connection set (7.3.5)."""
TO_MAPPING = 0x200
"""Offset from the index of a communication record to that of the PDO's mapping record."""

MOST = 8
"""Largest number of TPDOs that a case tries, of up to 512 (assumed)."""

COB_ID, TRANSMISSION_TYPE, INHIBIT_TIME, EVENT_TIMER, SYNC_START = 1, 2, 3, 5, 6
INVALID, NO_REMOTE = 1 << 31, 1 << 30
CAN_ID = 0x7FF
REFUSED = {0x0609_0030, 0x0609_0031, 0x0604_0041, 0x0601_0002, 0x0800_0000}
"""Abort codes of a device that does not support a transmission type."""
EVENT_DRIVEN = 255


class Pdo:
    """One PDO of the device.

    Args:
        device: the device under test.
        index: of its communication record.

    Attributes:
        index: as given.
        mapping: index of its mapping record.
        receive: whether it is an RPDO.

    """

    def __init__(self, device: Device, index: int) -> None:
        self.index = index
        self.mapping = index + TO_MAPPING
        self.receive = index in RPDO_RECORDS
        self._device = device

    @property
    def name(self) -> str:
        """Such as TPDO1."""
        records = RPDO_RECORDS if self.receive else TPDO_RECORDS
        return f"{'RPDO' if self.receive else 'TPDO'}{self.index - records.start + 1}"

    @property
    def can_id(self) -> int:
        """Its identifier."""
        return self.get(COB_ID) & CAN_ID

    @property
    def _spare_id(self) -> int:
        """Its identifier in the predefined connection set, or an unused identifier (7.3.5)."""
        number = self.index - (RPDO_RECORDS if self.receive else TPDO_RECORDS).start
        if number < PREDEFINED:
            return (0x200 if self.receive else 0x180) + 0x100 * number + self._device.node_id
        return 0x681 + number % 0x5E

    @property
    def valid(self) -> bool:
        """Whether it exists."""
        return not self.get(COB_ID) & INVALID

    def get(self, subindex: int) -> int:
        """Return a communication parameter."""
        return self._device.sdo.read(self.index, subindex)

    def set(self, subindex: int, value: int) -> None:
        """Write a communication parameter; raises `Aborted`."""
        variable = self._device.eds.variables[self.index, subindex]
        self._device.sdo.download(self.index, subindex, encoded(variable, value))

    def code(self, subindex: int, value: int) -> int:
        """Return the abort code of writing a communication parameter, 0 if it is accepted."""
        try:
            self.set(subindex, value)
        except Aborted as abort:
            return abort.code
        return 0

    def offers(self, subindex: int) -> bool:
        """Return whether a communication parameter can be written."""
        return self._device.eds.writable(self.index, subindex)

    def disable(self) -> None:
        """Disable the PDO (set bit 31 of its COB-ID)."""
        if self.offers(COB_ID):
            self.set(COB_ID, self.get(COB_ID) | INVALID)

    def enable(self, *, remote: bool = False) -> None:
        """Enable the PDO, with RTR allowed if `remote`."""
        cob_id = self.get(COB_ID) & ~INVALID
        if not cob_id & CAN_ID:
            cob_id |= self._spare_id
        try:
            self.set(COB_ID, cob_id & ~NO_REMOTE if remote else cob_id)
        except Aborted as abort:
            if not (remote and cob_id & NO_REMOTE and abort.code in REFUSED):
                raise
            pytest.skip(f"{self.name} answers no remote frames: {abort}")

    def prepare(self) -> bool:
        """Disable the PDO, and map an object that SDO can read unless one is mapped already.

        Returns:
            Whether the PDO can be enabled.

        """
        if not self.offers(COB_ID):
            return False
        self.disable()
        words, eds = self.words(), self._device.eds
        mapped = [eds.variables.get((entry >> 16, entry >> 8 & 0xFF)) for entry in words]
        objects = carriable(self._device, receive=self.receive)
        right = bool(words) and all(
            v is not None and v.type.bits == entry & 0xFF and v.index in APPLICATION
            for v, entry in zip(mapped, words, strict=True)
        )
        if right and (all(v is not None and v.readable for v in mapped) or not objects):
            return True
        if objects and self.variable:
            return self.map([word(objects[0])]) == 0
        return right

    def configure(
        self, kind: int, *, inhibit_100us: int = 0, event_ms: int = 0, sync_start: int = 0
    ) -> None:
        """Set the transmission; skip the case if the device does not support it."""
        values = {
            TRANSMISSION_TYPE: kind,
            INHIBIT_TIME: inhibit_100us,
            EVENT_TIMER: event_ms,
            SYNC_START: sync_start,
        }
        for subindex, value in values.items():
            if self.offers(subindex):
                self._try(subindex, value)
            elif (self.index, subindex) in self._device.eds or value:
                pytest.skip(f"{self.name}: sub-index {subindex} cannot be set")

    def _try(self, subindex: int, value: int) -> None:
        """Write a parameter; skip the case if the device does not support the transmission."""
        try:
            self.set(subindex, value)
        except Aborted as abort:
            if abort.code not in REFUSED:
                raise
            pytest.skip(f"{self.name} does not offer {value} in sub-index {subindex}: {abort}")

    def words(self) -> list[int]:
        """Return the mapped objects: index, sub-index and bits of each."""
        sdo = self._device.sdo
        return [sdo.read(self.mapping, n) for n in range(1, sdo.read(self.mapping) + 1)]

    def size(self) -> int:
        """Return the length of its data in bytes."""
        return (sum(word & 0xFF for word in self.words()) + 7) // 8

    @property
    def variable(self) -> bool:
        """Whether its mapping can be written; the PDO must be disabled."""
        return self.offers(COB_ID) and self._device.eds.writable(self.mapping)

    def need_variable_mapping(self) -> None:
        """Skip the case if the mapping is fixed."""
        if not self.variable:
            pytest.skip(f"the mapping of {self.name} is fixed")

    def map(self, words: Sequence[int]) -> int:
        """Map objects by the procedure; return the first abort code, 0 for success.

        The PDO is disabled afterwards.
        """
        sdo = self._device.sdo
        self.disable()
        try:
            sdo.write(self.mapping, 0, 0, 1)
            for number, word in enumerate(words, start=1):
                sdo.write(self.mapping, number, word, 4)
            sdo.write(self.mapping, 0, len(words), 1)
        except Aborted as abort:
            return abort.code
        return 0

    def entry_code(self, number: int, word: int) -> int:
        """Return the abort code of writing one entry of the mapping, 0 if it is accepted."""
        return self._device.sdo.write_code(self.mapping, number, word.to_bytes(4, "little"))

    def capacity(self) -> int:
        """Return the number of entries of its mapping record."""
        keys = self._device.eds.variables
        return sum(index == self.mapping and subindex > 0 for index, subindex in keys)


def rpdos(device: Device) -> list[Pdo]:
    """Return all RPDOs; skip the case for a device without RPDOs, such as a sensor."""
    return _need(device, RPDO_RECORDS, "RPDO")


def tpdos(device: Device) -> list[Pdo]:
    """Return all TPDOs; skip the case for a device without TPDOs."""
    return _need(device, TPDO_RECORDS, "TPDO")


def pdos(device: Device) -> list[Pdo]:
    """Return all PDOs."""
    indices = [*device.eds.indices(RPDO_RECORDS), *device.eds.indices(TPDO_RECORDS)]
    return [Pdo(device, index) for index in indices]


def _need(device: Device, records: range, what: str) -> list[Pdo]:
    indices = device.eds.indices(records)
    if not indices:
        assert device.sdo.read_code(records.start), f"an {what} that the EDS does not have"
        pytest.skip(f"the device has no {what}")
    return [Pdo(device, index) for index in indices]


def silence(device: Device) -> None:
    """Disable all TPDOs."""
    for index in device.eds.indices(TPDO_RECORDS):
        Pdo(device, index).disable()


def usable(device: Device, overflow: int = 0) -> list[Pdo]:
    """Disable all TPDOs and return those that can be enabled.

    TPDOs without a default mapping are mapped. SYNC has a counter with this overflow.
    """
    device.prepare_sync(overflow)
    silence(device)
    tpdos_usable = [pdo for pdo in tpdos(device)[:MOST] if pdo.prepare()]
    if not tpdos_usable:
        pytest.skip("no TPDO can be enabled: COB-IDs are fixed, or nothing can be mapped")
    return tpdos_usable


def receiving(device: Device) -> Pdo:
    """Return an RPDO with a mapping, disabled, without deadline and not synchronous."""
    device.prepare_sync()
    for pdo in rpdos(device):
        if pdo.prepare():
            pdo.set(TRANSMISSION_TYPE, EVENT_DRIVEN)
            if pdo.offers(EVENT_TIMER):
                pdo.set(EVENT_TIMER, 0)
            return pdo
    pytest.skip("no RPDO can be enabled: COB-IDs are fixed, or nothing can be mapped")


def carriable(device: Device, *, receive: bool) -> list[Entry]:
    """Return the process data that an RPDO or TPDO may carry, objects that SDO can read first.

    Communication objects are left out, because mapping them changes the communication.
    """
    process_data = [v for v in device.eds.variables.values() if v.index in APPLICATION]
    fitting = [
        v for v in process_data if v.type.bits and (v.receivable if receive else v.transmittable)
    ]
    return sorted(fitting, key=lambda v: not v.readable)


def word(variable: Entry) -> int:
    """Return the mapping entry of a variable."""
    return variable.index << 16 | variable.subindex << 8 | variable.type.bits


def mappable(device: Device, access: set[str]) -> list[Entry]:
    """Return the mappable variables of some access types; skip the case if the list is empty."""
    variables = [
        v for v in device.eds.find(access, mappable=True) if v.type.bits and v.index in APPLICATION
    ]
    if not variables:
        pytest.skip(f"no mappable object has the access type {' or '.join(sorted(access))}")
    return variables

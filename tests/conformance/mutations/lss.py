"""LSS: switching, configuring, inquiring, identifying (CiA 305)."""

from hil_emulator.device import lss
from hil_emulator.device.dictionary import UNCONFIGURED
from hil_emulator.device.lss import LssSlave
from mutations.mutant import Call, mutant

SWITCH_GLOBAL, CONFIGURE_NODE_ID, CONFIGURE_BIT_TIMING, STORE = 0x04, 0x11, 0x13, 0x17
INQUIRE_PRODUCT, INQUIRE_REVISION, INQUIRE_NODE_ID = 0x5B, 0x5C, 0x5E
REQUEST, CONFIGURE = (LssSlave, "request"), (LssSlave, "_configure")
SERIAL = 3


@mutant(REQUEST)
def lss_deaf(request: Call, slave: LssSlave, now_ns: int, data: bytes) -> None:
    """A slave obeys its LSS master: it does not."""


@mutant((LssSlave, "_switch_selective"))
def lss_any_serial_number(switch: Call, slave: LssSlave, part: int, number: int) -> None:
    """Switch selective is for the slave with this address: any serial number will do."""
    switch(slave, part, slave._address[SERIAL] if part == SERIAL else number)


@mutant((LssSlave, "_switch_selective"))
def lss_selected_by_the_end(switch: Call, slave: LssSlave, part: int, number: int) -> None:
    """All four parts of an address select: the serial number alone does."""
    slave._selected = part
    switch(slave, part, number)


@mutant(REQUEST)
def lss_configured_while_waiting(request: Call, slave: LssSlave, now_ns: int, data: bytes) -> None:
    """A node-ID is configured in configuration state: also in waiting state."""
    if data[0] in (CONFIGURE_NODE_ID, STORE):
        slave._configure(data[0], data[1])
    else:
        request(slave, now_ns, data)


@mutant(REQUEST)
def lss_inquired_while_waiting(request: Call, slave: LssSlave, now_ns: int, data: bytes) -> None:
    """Inquiries are answered in configuration state: also in waiting state."""
    if INQUIRE_PRODUCT <= data[0] <= INQUIRE_NODE_ID:
        slave._configure(data[0], data[1])
    else:
        request(slave, now_ns, data)


@mutant(REQUEST)
def lss_never_leaves(request: Call, slave: LssSlave, now_ns: int, data: bytes) -> None:
    """Switch global with 0 ends configuration state: it does not."""
    if data[:2] != bytes([SWITCH_GLOBAL, 0]):
        request(slave, now_ns, data)


@mutant((lss, "NODE_IDS"))
def lss_any_node_id(node_ids: frozenset[int]) -> frozenset[int]:
    """Node-IDs are 1 to 127 and 255: any is taken."""
    return frozenset(range(256))


@mutant(CONFIGURE)
def lss_node_id_at_once(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """A new node-ID counts from the next reset communication on: at once."""
    configure(slave, service, value)
    if service == CONFIGURE_NODE_ID and slave.pending != UNCONFIGURED:
        slave.node_id = slave.pending


@mutant(CONFIGURE)
def lss_node_id_in_vain(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """A new node-ID counts after a reset communication: it is forgotten."""
    configure(slave, service, value)
    slave.pending = slave.node_id


@mutant(CONFIGURE)
def lss_inquiries_swapped(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """Each part of the address has its inquiry: product code and revision are swapped."""
    others = {INQUIRE_PRODUCT: INQUIRE_REVISION, INQUIRE_REVISION: INQUIRE_PRODUCT}
    configure(slave, others.get(service, service), value)


@mutant(CONFIGURE)
def lss_node_id_of_zero(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """Inquire node-ID is answered with the node-ID: with 0."""
    if service == INQUIRE_NODE_ID:
        slave._answer(service)
    else:
        configure(slave, service, value)


@mutant(CONFIGURE)
def lss_any_bit_timing(configure: Call, slave: LssSlave, service: int, value: int) -> None:
    """A bit timing that does not exist is refused: it is confirmed."""
    if service == CONFIGURE_BIT_TIMING:
        slave._answer(service)
    else:
        configure(slave, service, value)


@mutant((LssSlave, "_store"))
def lss_stored_in_vain(store: Call, slave: LssSlave) -> int:
    """A node-ID that was stored is kept over power off: it is not stored."""
    return 0


@mutant((LssSlave, "_identify"))
def lss_identified_by_any_range(identify: Call, slave: LssSlave, part: int, number: int) -> None:
    """Identify is answered in the range of serial numbers alone: in any."""
    identify(slave, part, slave._address[SERIAL] if part > SERIAL else number)


@mutant((LssSlave, "_identify"))
def lss_never_identified(identify: Call, slave: LssSlave, part: int, number: int) -> None:
    """Identify is answered where the address is in its range: it is not."""


@mutant((LssSlave, "_fastscan"))
def lss_scanned_though_configured(scan: Call, slave: LssSlave, *given: int) -> None:
    """Fastscan is for nodes without a node-ID: one that has one answers."""
    kept, slave.node_id = slave.node_id, UNCONFIGURED
    scan(slave, *given)
    slave.node_id = kept


@mutant(REQUEST)
def lss_unconfigured_though_configured(
    request: Call, slave: LssSlave, now_ns: int, data: bytes
) -> None:
    """Identify non-configured is for nodes without a node-ID: one that has one answers."""
    if data[0] == 0x4C:
        slave._answer(0x50)
    else:
        request(slave, now_ns, data)

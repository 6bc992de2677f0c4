"""Chapter 11: LSS slave (CiA 305).

The master selects the device by its identity, so that other slaves on the bus are not affected.
"""

from collections.abc import Iterator, Sequence

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import RESET_COMMUNICATION, SETTLE_MS, Device

REQUEST_ID, ANSWER_ID = 0x7E5, 0x7E4
SWITCH_GLOBAL, SWITCH_VENDOR, SWITCHED = 0x04, 0x40, 0x44
CONFIGURE_NODE_ID, CONFIGURE_BIT_TIMING = 0x11, 0x13
IDENTIFY_VENDOR, IDENTIFIED = 0x46, 0x4F
INQUIRE_VENDOR, INQUIRE_NODE_ID = 0x5A, 0x5E
IDENTIFY_NON_CONFIGURED, FASTSCAN = 0x4C, 0x51
NO_BIT_CHECK = 0x80
IDENTITY, PARTS = 0x1018, (1, 2, 3, 4)
NO_NODE_IDS = (0, 128, 254)
NO_TABLE = 0x7F
"""Number of a bit timing table that does not exist."""
PAUSE_MS, PATIENCE_MS = 2, 300


class Master:
    """An LSS master that knows the identity of its slave."""

    def __init__(self, device: Device) -> None:
        self._wire = device.wire
        self.device = device
        self.identity = [device.sdo.read(IDENTITY, part) for part in PARTS]

    def ask(self, service: int, data: bytes = b"") -> bytes | None:
        """Send a request; return the answer, or None without an answer."""
        since = len(self._wire.log)
        self._wire.send(REQUEST_ID, bytes([service]) + data.ljust(7, b"\0"))
        return self._wire.await_frame(ANSWER_ID, since=since, patience_ms=PATIENCE_MS)

    def ask_number(self, service: int, number: int) -> bytes | None:
        """Send a request with a number of 32 bits."""
        return self.ask(service, number.to_bytes(4, "little"))

    def wait(self) -> None:
        """Switch all slaves to waiting state."""
        self.ask(SWITCH_GLOBAL, b"\0")

    def select(self, identity: list[int]) -> bytes | None:
        """Switch the slave of an identity to configuration state; return its answer."""
        return self._ask_parts(SWITCH_VENDOR, identity)

    def identify(self, *limits: int) -> bytes | None:
        """Identify slaves of a vendor and product with revision and serial number in limits."""
        return self._ask_parts(IDENTIFY_VENDOR, limits)

    def _ask_parts(self, service: int, parts: Sequence[int]) -> bytes | None:
        """Send one request for each part; return the first answer."""
        since = len(self._wire.log)
        for n, part in enumerate(parts):
            self._wire.send(
                REQUEST_ID, bytes([service + n]) + part.to_bytes(4, "little") + bytes(3)
            )
            self._wire.run(PAUSE_MS)
        return self._wire.await_frame(ANSWER_ID, since=since, patience_ms=PATIENCE_MS)

    def configured(self) -> None:
        """Select the slave and check that it answers."""
        self.wait()
        answer = self.select(self.identity)
        assert answer is not None, "not selected by its identity"
        assert answer[0] == SWITCHED

    def other(self, part: int) -> list[int]:
        """Return the identity with another number in one part."""
        return [number ^ (n == part) for n, number in enumerate(self.identity)]


@pytest.fixture
def master(device: Device) -> Iterator[Master]:
    """Yield a master; afterwards no slave is in configuration state."""
    if not device.eds.count("LSS_Supported"):
        pytest.skip("the EDS excludes LSS")
    if any((IDENTITY, part) not in device.eds for part in PARTS):
        pytest.skip("the identity is not complete")
    made = Master(device)
    made.wait()
    yield made
    made.wait()


@case("11.1")
def test_inquiries_are_answered(master: Master) -> None:
    """In configuration state the slave answers with its identity and its node-ID."""
    master.configured()
    for n, part in enumerate(master.identity):
        answer = master.ask(INQUIRE_VENDOR + n)
        assert answer is not None, f"inquiry {INQUIRE_VENDOR + n:02X} is not answered"
        assert answer[:5] == bytes([INQUIRE_VENDOR + n]) + part.to_bytes(4, "little")
    answer = master.ask(INQUIRE_NODE_ID)
    assert answer is not None
    assert answer[:2] == bytes([INQUIRE_NODE_ID, master.device.node_id])


@case("11.2")
def test_waiting_slave_is_silent(master: Master) -> None:
    """In waiting state inquiries are not answered, and a node-ID is not accepted."""
    master.configured()
    master.wait()
    assert master.ask(INQUIRE_NODE_ID) is None
    assert master.ask(CONFIGURE_NODE_ID, bytes([master.device.node_id % 127 + 1])) is None
    master.device.reset(RESET_COMMUNICATION)


@case("11.3")
def test_whole_identity_selects(master: Master) -> None:
    """The slave is not selected with a wrong number in any part, nor by its last part alone.

    An incomplete selection does not disturb the next selection.
    """
    for part in reversed(range(len(PARTS))):
        assert master.select(master.other(part)) is None, f"selected by another part {part + 1}"
        assert master.ask(INQUIRE_NODE_ID) is None
    master.wait()
    serial_number = master.identity[-1]
    last = master.ask_number(SWITCH_VENDOR + len(PARTS) - 1, serial_number)
    assert last is None, "selected by its serial number alone"
    assert master.select(master.identity[:2]) is None, "selected by vendor and product alone"
    master.configured()


@case("11.4")
def test_ranges_identify(master: Master) -> None:
    """The slave answers only if revision and serial number are in range.

    The service is optional (CiA 305): a slave without it answers no such request.
    """
    vendor, product, revision, serial = master.identity
    answer = master.identify(vendor, product, revision, revision, serial, serial)
    if answer is None:
        pytest.skip("the device does not offer to be identified by a range")
    assert answer[0] == IDENTIFIED
    above = 0xFFFF_FFFF
    if serial < above:
        outside = master.identify(vendor, product, revision, revision, serial + 1, above)
        assert outside is None, "identified by a range it is not in"
    assert master.identify(vendor ^ 1, product, 0, above, 0, above) is None


@case("11.5")
def test_wrong_node_ids_are_refused(master: Master) -> None:
    """Node-IDs other than 1 to 127 and 255 are answered with an error."""
    master.configured()
    answers = [master.ask(CONFIGURE_NODE_ID, bytes([node_id])) for node_id in NO_NODE_IDS]
    master.ask(CONFIGURE_NODE_ID, bytes([master.device.node_id]))
    for node_id, answer in zip(NO_NODE_IDS, answers, strict=True):
        assert answer is not None
        assert answer[0] == CONFIGURE_NODE_ID
        assert answer[1], f"node-ID {node_id} was taken"


@case("11.6")
def test_node_id_counts_after_reset_communication(master: Master) -> None:
    """A new node-ID is used from reset communication on; the case then restores the old one."""
    device = master.device
    new = device.node_id % 127 + 1
    try:
        master.configured()
        answer = master.ask(CONFIGURE_NODE_ID, bytes([new]))
        assert answer is not None
        assert answer[:2] == bytes([CONFIGURE_NODE_ID, 0])
        inquired = master.ask(INQUIRE_NODE_ID)
        assert inquired is not None
        assert inquired[1] == device.node_id, "the new node-ID counted before the reset"
        master.wait()
        device.barrier()
        since = len(device.wire.log)
        device.nmt(RESET_COMMUNICATION)
        booted = device.wire.await_frame(0x700 + new, since=since)
        assert booted == b"\0", "no boot-up with the new node-ID"
    finally:
        master.wait()
        master.select(master.identity)
        master.ask(CONFIGURE_NODE_ID, bytes([device.node_id]))
        master.wait()
        device.nmt(RESET_COMMUNICATION, new)
        device.wire.run(SETTLE_MS)
        device.reset(RESET_COMMUNICATION)


@case("11.7")
def test_wrong_bit_timing_is_refused(master: Master) -> None:
    """A bit timing of a table that does not exist is answered with an error or not at all."""
    master.configured()
    answer = master.ask(CONFIGURE_BIT_TIMING, bytes([NO_TABLE, 0]))
    if answer is None:
        pytest.skip("the bit timing cannot be configured")
    assert answer[0] == CONFIGURE_BIT_TIMING
    assert answer[1]


@case("11.8")
def test_configured_slave_is_not_scanned(master: Master) -> None:
    """A node with a node-ID answers neither fastscan nor identify non-configured."""
    assert master.ask(IDENTIFY_NON_CONFIGURED) is None
    assert master.ask(FASTSCAN, bytes([0, 0, 0, 0, NO_BIT_CHECK])) is None


@case("11.9")
def test_reset_ends_configuration_state(master: Master) -> None:
    """After reset communication the slave is in waiting state and answers no inquiry."""
    master.configured()
    master.device.reset(RESET_COMMUNICATION)
    assert master.ask(INQUIRE_NODE_ID) is None


@case("11.10")
def test_refused_node_id_is_not_used(master: Master) -> None:
    """A refused node-ID is not used after reset communication."""
    device = master.device
    master.configured()
    for node_id in NO_NODE_IDS:
        master.ask(CONFIGURE_NODE_ID, bytes([node_id]))
    master.wait()
    assert device.boots(RESET_COMMUNICATION), "no boot-up with the node-ID it had"


@case("11.11")
def test_lss_answers_have_reserved_bytes_of_zero(master: Master) -> None:
    """Unused bytes of an LSS answer are 0; switch global has no answer."""
    master.wait()
    assert master.ask(SWITCH_GLOBAL, b"\0") is None, "switch global was answered"
    switched = master.select(master.identity)
    assert switched == bytes([SWITCHED]).ljust(8, b"\0")
    answer = master.ask(INQUIRE_VENDOR)
    assert answer is not None
    assert answer[5:] == bytes(3), f"answer {answer.hex()}"

"""The LSS slave, configured by the stock LSS master (CiA 305)."""

import canopen
import pytest
from device_master import CHANNELS, EDS, NODE_ID, Master, booted

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.device.storage import MemoryStorage, Storage

VENDOR, PRODUCT, REVISION, SERIAL = ADDRESS = (0x0, 0x1, 0x10000, 0x1)
NEW_ID = 0x21
WAITING, CONFIGURATION = 0, 1


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Disable waiting in the stock master: in simulated time an answer is immediate or missing."""
    monkeypatch.setattr("canopen.lss.time.sleep", lambda seconds: None)
    monkeypatch.setattr(canopen.lss.LssMaster, "RESPONSE_TIMEOUT", 0)


def switched_on(storage: Storage) -> Master:
    """Return a master of a device that has just got power."""
    dictionary = Dictionary.from_eds(EDS, NODE_ID)
    dictionary.set_default(dictionary.entry(0x1018, 4), SERIAL)
    return booted(Node(dictionary, CHANNELS, {"valve_current": 0.0}, storage))


@pytest.fixture
def master() -> Master:
    """Return a master of a device with a serial number."""
    return switched_on(MemoryStorage())


def unconfigured() -> Master:
    """Return a master of a device without node-ID, just switched on."""
    storage = MemoryStorage()
    lss = switched_on(storage).network.lss
    lss.send_switch_state_global(CONFIGURATION)
    lss.configure_node_id(0xFF)
    lss.store_configuration()
    return switched_on(storage)


def boot_ups(master: Master) -> list[int]:
    """Return the node-IDs of all boot-up messages."""
    return [f.can_id - 0x700 for f in master.frames if f.can_id >> 7 == 0xE and f.data == b"\0"]


def test_address_is_the_identity_object(master: Master) -> None:
    """Inquiry returns 0x1018 and the node-ID."""
    lss = master.network.lss
    lss.send_switch_state_global(CONFIGURATION)
    assert tuple(lss.inquire_lss_address(cs) for cs in (0x5A, 0x5B, 0x5C, 0x5D)) == ADDRESS
    assert lss.inquire_node_id() == NODE_ID


def test_selective_switch_needs_the_whole_address(master: Master) -> None:
    """Only the node with the address enters configuration."""
    lss = master.network.lss
    with pytest.raises(canopen.lss.LssError):
        lss.send_switch_state_selective(VENDOR, PRODUCT, REVISION, SERIAL + 1)
    with pytest.raises(canopen.lss.LssError):
        lss.inquire_node_id()
    assert lss.send_switch_state_selective(*ADDRESS)
    assert lss.inquire_node_id() == NODE_ID


@pytest.mark.parametrize("sent", [1, 2, 3])
def test_incomplete_requests_are_discarded(master: Master, sent: int) -> None:
    """A master that restarts after some parts of an address is answered normally."""
    lss = master.network.lss
    for part in range(sent):
        master.network.send_message(0x7E5, bytes([0x40 + part]) + _padded(ADDRESS[part]))
        master.network.send_message(0x7E5, bytes([0x46 + part]) + _padded(ADDRESS[min(part, 2)]))
    master.forget()
    lss.send_identify_remote_slave(VENDOR, PRODUCT, REVISION, REVISION, SERIAL, SERIAL)
    assert master.data(0x7E4) == [b"\x4f" + bytes(7)]
    assert lss.send_switch_state_selective(*ADDRESS)


def _padded(number: int) -> bytes:
    return number.to_bytes(4, "little") + bytes(3)


def test_new_node_id_waits_for_the_reset(master: Master) -> None:
    """After reset communication the node has its new node-ID and the COB-IDs of it."""
    lss = master.network.lss
    lss.send_switch_state_global(CONFIGURATION)
    lss.configure_node_id(NEW_ID)
    lss.send_switch_state_global(WAITING)
    assert master.remote.sdo[0x1200][1].raw == 0x600 + NODE_ID
    master.forget()
    master.nmt(130)
    assert boot_ups(master) == [NEW_ID]
    moved = master.network.add_node(NEW_ID, str(EDS))
    assert moved.sdo[0x1200][1].raw == 0x600 + NEW_ID
    assert moved.sdo[0x1014].raw == 0x080 + NEW_ID
    master.nmt(1, NEW_ID)
    master.forget()
    master.run(2)
    assert {frame.can_id for frame in master.frames} == {b + NEW_ID for b in (0x180, 0x280, 0x380)}


@pytest.mark.parametrize("node_id", [0, 128, 254])
def test_bad_node_ids_are_refused(master: Master, node_id: int) -> None:
    """A node-ID is 1 to 127, or 255 for an unconfigured node."""
    master.network.lss.send_switch_state_global(CONFIGURATION)
    with pytest.raises(canopen.lss.LssError, match="1"):
        master.network.lss.configure_node_id(node_id)


def test_bit_rate_is_not_the_devices_to_change(master: Master) -> None:
    """Configuring the bit timing is answered with "not supported"."""
    master.network.lss.send_switch_state_global(CONFIGURATION)
    with pytest.raises(canopen.lss.LssError, match="1"):
        master.network.lss.configure_bit_timing(4)


def test_stored_node_id_survives_power_off() -> None:
    """What LSS stores is the node-ID of the next start."""
    storage = MemoryStorage()
    lss = switched_on(storage).network.lss
    lss.send_switch_state_global(CONFIGURATION)
    lss.configure_node_id(NEW_ID)
    lss.store_configuration()
    assert boot_ups(switched_on(storage)) == [NEW_ID]


def test_unconfigured_node_is_silent() -> None:
    """Without node-ID there is neither boot-up nor heartbeat nor an answer to NMT or SDO."""
    master = unconfigured()
    master.nmt(1, 0)
    master.request("4000100000000000")
    master.run(300)
    assert master.frames == []


def test_fastscan_finds_an_unconfigured_node() -> None:
    """The stock master's fastscan finds the address bit by bit and can then configure the node."""
    master = unconfigured()
    lss = master.network.lss
    assert lss.fast_scan() == (True, list(ADDRESS))
    lss.configure_node_id(NEW_ID)
    assert boot_ups(master) == []
    lss.send_switch_state_global(WAITING)
    assert boot_ups(master) == [NEW_ID]
    assert master.network.add_node(NEW_ID, str(EDS)).sdo[0x1000].raw == 0x198


def test_configured_node_ignores_fastscan(master: Master) -> None:
    """Fastscan searches only nodes without a node-ID."""
    assert master.network.lss.fast_scan() == (False, None)


@pytest.mark.parametrize(("serial_high", "answers"), [(SERIAL, 1), (SERIAL - 1, 0)])
def test_identify_answers_within_the_range(master: Master, serial_high: int, answers: int) -> None:
    """A node answers if revision and serial number are in the requested range."""
    master.forget()
    master.network.lss.send_identify_remote_slave(VENDOR, PRODUCT, 0, REVISION, 0, serial_high)
    assert master.data(0x7E4) == [b"\x4f" + bytes(7)] * answers


def test_unconfigured_nodes_can_be_asked_for() -> None:
    """Only a node without node-ID answers "identify non-configured"."""
    for master, answers in ((unconfigured(), 1), (switched_on(MemoryStorage()), 0)):
        master.network.lss.send_identify_non_configured_remote_slave()
        assert len(master.data(0x7E4)) == answers


def test_lss_is_off_in_operational(master: Master) -> None:
    """A node in OPERATIONAL ignores LSS."""
    master.nmt(1)
    master.network.lss.send_switch_state_global(CONFIGURATION)
    with pytest.raises(canopen.lss.LssError):
        master.network.lss.inquire_node_id()

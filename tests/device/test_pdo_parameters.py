"""Changing PDOs by SDO: a stock client that follows the rules, and raw writes that violate them."""

import struct
from pathlib import Path

import pytest
from device_master import CHANNELS, NODE_ID, RPDO1, SAFE_CURRENT, SYNC, TPDO1, TPDO2, Master, booted
from edited_eds import edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError

NO_SUCH_OBJECT, NOT_MAPPABLE, TOO_LONG = 0x06020000, 0x06040041, 0x06040042
INVALID_VALUE, WRONG_STATE = 0x06090030, 0x08000022
OFF = 1 << 31
EXTENDED = 1 << 29

FREE_ID = 0x190


def u32(value: int) -> bytes:
    """Return an UNSIGNED32 as an SDO carries it."""
    return struct.pack("<I", value)


def switch_off(master: Master, communication: int) -> None:
    """Delete a PDO: set bit 31 of its COB-ID."""
    record = master.remote.sdo[communication]
    record[1].raw |= OFF


def test_stock_client_remaps_a_tpdo(master: Master) -> None:
    """A TPDO remapped by a stock client is sent with the new mapping and identifier."""
    tpdo = master.remote.tpdo[2]
    master.remote.tpdo.read()
    tpdo.clear()
    tpdo.add_variable("sample_time")
    tpdo.add_variable("pressure_b")
    tpdo.cob_id, tpdo.enabled, tpdo.trans_type = FREE_ID, True, 1
    tpdo.save()
    master.start()
    master.send(SYNC)
    assert [len(data) for data in master.data(FREE_ID)] == [6]
    assert tpdo["pressure_b"].phys == 2.0e6
    assert master.data(TPDO2) == []


def test_mapping_is_locked_while_the_pdo_exists(master: Master) -> None:
    """With bit 31 clear neither the entries nor their number can be written."""
    assert master.abort_code(0x1A00, 1, u32(0x20400010)) == WRONG_STATE
    assert master.abort_code(0x1A00, 0, b"\0") == WRONG_STATE


def test_entries_are_locked_while_the_number_is_not_zero(master: Master) -> None:
    """Entries of a deleted PDO can be written only after its number is set to 0."""
    switch_off(master, 0x1800)
    assert master.abort_code(0x1A00, 1, u32(0x20400010)) == WRONG_STATE
    assert master.abort_code(0x1A00, 0, b"\0") == 0
    assert master.abort_code(0x1A00, 1, u32(0x20400010)) == 0
    assert master.abort_code(0x1A00, 0, b"\1") == 0


@pytest.mark.parametrize(
    ("mapping", "word", "code"),
    [
        (0x1A00, 0x3FFF0010, NO_SUCH_OBJECT),
        (0x1A00, 0x20400110, NOT_MAPPABLE),  # no such sub-index
        (0x1A00, 0x20400020, NOT_MAPPABLE),  # UNSIGNED16 has 16 bits
        (0x1A00, 0x20000020, NOT_MAPPABLE),  # rww: process output
        (0x1A00, 0x10170010, NOT_MAPPABLE),  # PDOMapping=0
        (0x1A00, 0x00050008, NOT_MAPPABLE),  # dummies are for RPDOs
        (0x1A00, 0x10010008, 0),
        (0x1600, 0x20100010, NOT_MAPPABLE),  # ro: process input
        (0x1600, 0x00080020, NO_SUCH_OBJECT),
        (0x1600, 0x00050008, 0),
    ],
)
def test_entries_must_be_mappable(master: Master, mapping: int, word: int, code: int) -> None:
    """Each mapping entry is checked for existence, direction and length when written."""
    switch_off(master, mapping - 0x200)
    assert master.abort_code(mapping, 0, b"\0") == 0
    assert master.abort_code(mapping, 1, u32(word)) == code


def test_more_than_eight_bytes_do_not_fit(master: Master) -> None:
    """Three objects of 32 bits are refused when their number is set."""
    switch_off(master, 0x1800)
    master.abort_code(0x1A00, 0, b"\0")
    for subindex in (1, 2, 3):
        assert master.abort_code(0x1A00, subindex, u32(0x20200020)) == 0
    assert master.abort_code(0x1A00, 0, b"\3") == TOO_LONG
    assert master.abort_code(0x1A00, 0, b"\2") == 0


def test_number_must_not_count_empty_entries(master: Master) -> None:
    """An entry that was never written cannot be mapped, nor can there be a ninth."""
    switch_off(master, 0x1400)
    assert master.abort_code(0x1600, 0, b"\2") == NOT_MAPPABLE
    assert master.abort_code(0x1600, 0, b"\x09") == TOO_LONG


def test_can_id_is_locked_while_the_pdo_exists(master: Master) -> None:
    """A new identifier needs the old PDO deleted first; deleting may come with it."""
    assert master.abort_code(0x1800, 1, u32(FREE_ID)) == INVALID_VALUE
    assert master.abort_code(0x1800, 1, u32(OFF | FREE_ID)) == 0
    assert master.abort_code(0x1800, 1, u32(FREE_ID)) == 0


@pytest.mark.parametrize(
    "can_id", [0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x701, 0x7FF]
)
@pytest.mark.parametrize("communication", [0x1400, 0x1800])
def test_restricted_identifiers_are_refused(
    master: Master, communication: int, can_id: int
) -> None:
    """No PDO may take an identifier that CiA 301 reserves."""
    switch_off(master, communication)
    assert master.abort_code(communication, 1, u32(can_id)) == INVALID_VALUE


@pytest.mark.parametrize("communication", [0x1400, 0x1800])
def test_a_device_may_have_no_29_bit_identifiers(master: Master, communication: int) -> None:
    """A device with `extended_ids = false` refuses 29-bit identifiers: 0609 0030."""
    switch_off(master, communication)
    assert master.abort_code(communication, 1, u32(EXTENDED | 0x12345)) == 0
    switch_off(master, communication)
    master.network.node.dictionary.extended_ids = False
    assert master.abort_code(communication, 1, u32(EXTENDED | 0x12345)) == INVALID_VALUE


def test_services_other_than_pdos_have_11_bits(master: Master) -> None:
    """SYNC and EMCY refuse a 29-bit identifier: 0609 0030."""
    for index in (0x1005, 0x1014):
        assert master.abort_code(index, 0, u32(EXTENDED | 0x12345)) == INVALID_VALUE


def test_a_29_bit_tpdo_uses_extended_frames(master: Master) -> None:
    """Its frames are extended, and only an extended remote frame requests it."""
    switch_off(master, 0x1800)
    assert master.abort_code(0x1800, 2, b"\xfd") == 0
    assert master.abort_code(0x1800, 1, u32(EXTENDED | 0x18F00185)) == 0
    master.start()
    master.send(0x18F00185 & 0x7FF, remote=True)
    assert master.data(0x18F00185) == []
    master.send(0x18F00185, remote=True, extended=True)
    (frame,) = [f for f in master.frames if f.can_id == 0x18F00185]
    assert frame.extended


@pytest.mark.parametrize("can_id", [0x18EF0500, 0x205])
def test_a_29_bit_rpdo_ignores_other_frames(master: Master, can_id: int) -> None:
    """An 11-bit frame with the same number has another identifier."""
    switch_off(master, 0x1400)
    assert master.abort_code(0x1400, 1, u32(EXTENDED | can_id)) == 0
    master.start()
    master.send(can_id & 0x7FF, u32(7))
    assert master.remote.sdo[0x2000].raw == round(SAFE_CURRENT * 1e9)
    master.send(can_id, u32(7), extended=True)
    assert master.remote.sdo[0x2000].raw == 7


@pytest.mark.parametrize(
    ("communication", "kind", "code"),
    [
        (0x1800, 240, 0),
        (0x1800, 241, INVALID_VALUE),
        (0x1800, 251, INVALID_VALUE),
        (0x1800, 252, 0),
        (0x1400, 240, 0),
        (0x1400, 241, INVALID_VALUE),
        (0x1400, 252, INVALID_VALUE),
        (0x1400, 254, 0),
    ],
)
def test_transmission_types(master: Master, communication: int, kind: int, code: int) -> None:
    """Reserved types are refused, and types 252 and 253 for an RPDO."""
    assert master.abort_code(communication, 2, bytes([kind])) == code


def test_inhibit_time_is_locked_while_the_pdo_exists(master: Master) -> None:
    """The inhibit time needs the PDO deleted first."""
    assert master.abort_code(0x1800, 3, b"\x0a\0") == INVALID_VALUE
    switch_off(master, 0x1800)
    assert master.abort_code(0x1800, 3, b"\x0a\0") == 0


def test_deleted_pdos_neither_send_nor_receive(master: Master) -> None:
    """Bit 31 disables and enables a PDO, also in OPERATIONAL."""
    master.start()
    switch_off(master, 0x1800)
    switch_off(master, 0x1400)
    master.forget()
    master.send(RPDO1, u32(5_000_000))
    master.run(5)
    assert master.data(TPDO1) == []
    assert master.commands["valve_current"] == pytest.approx(0.001)
    master.remote.sdo[0x1800][1].raw = TPDO1
    master.forget()
    master.run(5)
    assert len(master.data(TPDO1)) == 5


def test_event_timer_can_be_changed_in_operational(master: Master) -> None:
    """A new event timer starts at its write."""
    master.start()
    master.remote.sdo[0x1801][5].raw = 10
    master.forget()
    master.run(30)
    assert len(master.data(TPDO2)) == 3


def test_rpdo_skips_dummies(master: Master) -> None:
    """Dummy entries of any integer type let an RPDO share a frame with other devices."""
    switch_off(master, 0x1400)
    master.abort_code(0x1600, 0, b"\0")
    for subindex, word in enumerate((0x00050008, 0x00030010, 0x20000020), start=1):
        assert master.abort_code(0x1600, subindex, u32(word)) == 0
    assert master.abort_code(0x1600, 0, b"\3") == 0
    master.remote.sdo[0x1400][1].raw = RPDO1
    master.start()
    master.send(RPDO1, b"\xaa\xbb\xcc" + u32(5_000_000))
    assert master.commands["valve_current"] == pytest.approx(0.005)


def test_bit_dummies_are_possible(master: Master) -> None:
    """Eight BOOLEAN dummies make one byte."""
    switch_off(master, 0x1400)
    master.abort_code(0x1600, 0, b"\0")
    words = [0x00010001] * 7 + [0x20000020]
    for subindex, word in enumerate(words, start=1):
        assert master.abort_code(0x1600, subindex, u32(word)) == 0
    assert master.abort_code(0x1600, 0, b"\x08") == 0
    master.remote.sdo[0x1400][1].raw = RPDO1
    master.start()
    value = 5_000_000 << 7 | 0x7F
    master.send(RPDO1, value.to_bytes(5, "little"))
    assert master.commands["valve_current"] == pytest.approx(0.005)


def test_identifiers_follow_the_node_id(master: Master) -> None:
    """$NODEID of the EDS is the node's number."""
    assert master.remote.sdo[0x1803][1].raw == 0x480 + NODE_ID


def test_faulty_mapping_of_an_unused_pdo_keeps_it_unused(tmp_path: Path) -> None:
    """A PDO that is off by default may have an impossible mapping; it cannot be enabled."""
    eds = edited(
        tmp_path,
        ("DefaultValue=$NODEID+0x180\n", "DefaultValue=$NODEID+0x80000180\n"),
        ("DefaultValue=0x20100010\n", "DefaultValue=0x2FFF0010\n"),
    )
    dictionary = Dictionary.from_eds(eds, NODE_ID)
    master = booted(Node(dictionary, CHANNELS, {"valve_current": 0.0}), eds)
    assert master.abort_code(0x1800, 1, u32(TPDO1)) == NO_SUCH_OBJECT
    assert master.remote.sdo[0x1800][1].raw & OFF
    master.start()
    master.run(3)
    assert master.data(TPDO1) == []


def test_strings_cannot_be_mapped(tmp_path: Path) -> None:
    """An object without a fixed length cannot be mapped, even with PDOMapping=1."""
    old = "DataType=0x0009\nAccessType=const\nDefaultValue=Hydraulic actuator emulator\n"
    eds = edited(tmp_path, (old + "PDOMapping=0", old + "PDOMapping=1"))
    dictionary = Dictionary.from_eds(eds, NODE_ID)
    master = booted(Node(dictionary, CHANNELS, {"valve_current": 0.0}), eds)
    switch_off(master, 0x1800)
    master.abort_code(0x1A00, 0, b"\0")
    assert master.abort_code(0x1A00, 1, u32(0x10080000)) == NOT_MAPPABLE


def test_an_eds_may_give_29_bits(tmp_path: Path) -> None:
    """A default COB-ID with bit 29 is kept, even if its low bits are 0x180."""
    eds = edited(tmp_path, ("DefaultValue=$NODEID+0x180\n", "DefaultValue=0x38F00180\n"))
    node = Node(Dictionary.from_eds(eds, NODE_ID), CHANNELS, {"valve_current": 0.0})
    master = booted(node, eds)
    master.start()
    master.send(SYNC)
    assert any(f.can_id == 0x18F00180 and f.extended for f in master.frames)
    dictionary = Dictionary.from_eds(eds, NODE_ID)
    dictionary.extended_ids = False
    with pytest.raises(UserError, match="TPDO1 has a 29-bit identifier"):
        Node(dictionary, CHANNELS, {})

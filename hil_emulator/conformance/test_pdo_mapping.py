"""Chapter 3, second part: PDO mapping (CiA 301 7.5.2.36, 7.5.2.38)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import OPERATIONAL, SYNC_COB_ID, Device
from hil_emulator.conformance.expectation import FIRST_OBJECT
from hil_emulator.conformance.parameters import APPLICATION
from hil_emulator.conformance.patterns import pattern
from hil_emulator.conformance.pdo import (
    Pdo,
    carriable,
    mappable,
    pdos,
    rpdos,
    silence,
    tpdos,
    word,
)
from hil_emulator.conformance.situations import EVERY, SYNC
from hil_emulator.device.entry import Entry

INPUTS, OUTPUTS = {"ro", "rwr", "const"}, {"rww", "wo"}
RECEIVABLE = {"rw", "rww", "wo"}
NOT_MAPPABLE = {0x0602_0000, 0x0604_0041, 0x0604_0042, 0x0604_0043, 0x0609_0030}
TOO_MUCH = {0x0602_0000, 0x0604_0041, 0x0604_0042}
PDO_TOO_SHORT, PDO_TOO_LONG = 0x8210, 0x8220
DUMMY_UNSIGNED8 = 0x0005
MAX_BITS = 64


def variable_pdos(device: Device) -> list[Pdo]:
    """Return the PDOs whose mapping can be written."""
    remappable = [pdo for pdo in pdos(device) if pdo.variable and candidates(device, pdo)]
    if not remappable:
        pytest.skip("all mappings are fixed, or nothing can be mapped")
    return remappable


def candidates(device: Device, pdo: Pdo) -> list[Entry]:
    """Return the objects that the EDS allows in a PDO."""
    return carriable(device, receive=pdo.receive)


def length(variable: Entry) -> int:
    """Return the bits of a variable in a PDO."""
    return variable.type.bits


def another_word(device: Device, pdo: Pdo) -> int:
    """Return an entry that is allowed in a PDO and differs from its first entry, if possible."""
    words = [word(variable) for variable in candidates(device, pdo)]
    if pdo.receive and DUMMY_UNSIGNED8 in device.eds.dummies:
        words.append(DUMMY_UNSIGNED8 << 16 | 8)
    return next((other for other in words if [other] != pdo.words()[:1]), words[0])


def first_mapping_code(device: Device, pdo: Pdo, variable: Entry) -> int:
    """Return the abort code of mapping one variable alone, 0 if it is accepted."""
    pdo.need_variable_mapping()
    return pdo.map([word(variable)])


def distinct(variable: Entry) -> bool:
    """Return whether SDO can read a variable and the patterns give it different values."""
    return variable.readable and pattern(variable, 1) != pattern(variable, 9)


def unmappable(device: Device) -> Entry:
    """Return a variable of fixed length that no PDO may carry."""
    variables = [
        v for v in device.eds.find(RECEIVABLE, mappable=False) if 1 <= v.type.bits <= MAX_BITS
    ]
    assert variables, "every object is mappable"
    return variables[0]


@case("3.21")
def test_default_mapping_is_sound(device: Device) -> None:
    """Each default entry names a mappable object of the EDS with its length."""
    for pdo in pdos(device):
        words = pdo.words()
        for entry in words:
            index, subindex, width = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
            if index < FIRST_OBJECT:
                assert pdo.receive, f"{pdo.name} maps a dummy"
                assert index in device.eds.dummies, f"{pdo.name}: dummy {index:04X} is not allowed"
                continue
            variable = device.eds.variables.get((index, subindex))
            assert variable is not None, f"{pdo.name}: {entry:08X} does not exist"
            allowed = variable.receivable if pdo.receive else variable.transmittable
            assert allowed, f"{pdo.name}: {entry:08X} is not mappable"
            assert width == variable.type.bits, f"{pdo.name}: {entry:08X} has another length"
        assert sum(entry & 0xFF for entry in words) <= MAX_BITS, f"{pdo.name} is too long"


@case("3.22")
def test_mapping_procedure(device: Device) -> None:
    """After mapping by the procedure, a PDO has the new entry, and a TPDO is sent with it."""
    device.prepare_sync()
    silence(device)
    for pdo in variable_pdos(device):
        variable = candidates(device, pdo)[-1]
        assert first_mapping_code(device, pdo, variable) == 0, pdo.name
        assert pdo.words() == [word(variable)], pdo.name
        if not pdo.receive:
            pdo.configure(EVERY)
        pdo.enable()
    if SYNC_COB_ID not in device.eds:
        return
    sent = {pdo.can_id: pdo.size() for pdo in variable_pdos(device) if not pdo.receive}
    device.enter(OPERATIONAL)
    device.wire.send(SYNC)
    for can_id, size in sent.items():
        data = device.wire.await_frame(can_id)
        assert data is not None, f"{can_id:03X} was not sent"
        assert len(data) == size


@case("3.23")
def test_entries_are_locked_while_counted(device: Device) -> None:
    """While the number of entries is not 0, an entry cannot be changed in a disabled PDO."""
    for pdo in variable_pdos(device):
        pdo.disable()
        if not pdo.words():
            pdo.map([word(candidates(device, pdo)[-1])])
        before = pdo.words()
        assert pdo.entry_code(1, another_word(device, pdo)), (
            f"{pdo.name} took an entry without the procedure"
        )
        assert pdo.words() == before


@case("3.24")
def test_mapping_is_locked_while_valid(device: Device) -> None:
    """In an enabled PDO neither the number of entries nor an entry can be changed."""
    for pdo in [pdo for pdo in variable_pdos(device) if pdo.valid]:
        before = pdo.words()
        assert device.sdo.write_code(pdo.mapping, 0, b"\0"), f"{pdo.name} was emptied while valid"
        assert pdo.entry_code(1, another_word(device, pdo)), f"{pdo.name} took an entry while valid"
        assert pdo.words() == before


@case("3.25")
def test_too_many_objects_are_refused(device: Device) -> None:
    """A number of objects above the number of entries of the mapping record is refused."""
    for pdo in variable_pdos(device):
        smallest = min(candidates(device, pdo), key=length)
        room = pdo.capacity()
        fitting = min(room, MAX_BITS // smallest.type.bits)
        assert pdo.map([word(smallest)] * fitting) == 0, pdo.name
        assert device.sdo.write_code(pdo.mapping, 0, b"\0") == 0
        code = device.sdo.write_code(pdo.mapping, 0, bytes([room + 1]))
        assert code in TOO_MUCH, f"{pdo.name}: {room + 1} objects end with {code:08X}"


@case("3.26")
def test_too_long_objects_are_refused(device: Device) -> None:
    """Objects of more than 64 bits in total are refused."""
    for pdo in variable_pdos(device):
        longest = max(candidates(device, pdo), key=length)
        count = MAX_BITS // longest.type.bits + 1
        if count > pdo.capacity():
            pytest.skip(f"{pdo.name} has no room for more than 64 bits")
        code = pdo.map([word(longest)] * count)
        assert code in TOO_MUCH, (
            f"{pdo.name}: {count} x {longest.type.bits} bits end with {code:08X}"
        )


@case("3.27")
def test_rpdo_takes_an_output(device: Device) -> None:
    """A process output (rww, wo, or rw if there is no other) can be mapped into an RPDO."""
    pdo = rpdos(device)[0]
    variables = device.eds.find(OUTPUTS, mappable=True)
    outputs = [v for v in variables if v.index in APPLICATION] or mappable(device, {"rw"})
    assert first_mapping_code(device, pdo, outputs[0]) == 0


@case("3.28")
def test_rpdo_refuses_an_input(device: Device) -> None:
    """A process input (ro, rwr) cannot be mapped into an RPDO."""
    pdo = rpdos(device)[0]
    assert first_mapping_code(device, pdo, mappable(device, INPUTS)[0]) in NOT_MAPPABLE


@case("3.29")
def test_rpdo_refuses_the_unmappable(device: Device) -> None:
    """An object that is not mappable by the EDS cannot be mapped into an RPDO."""
    assert first_mapping_code(device, rpdos(device)[0], unmappable(device)) in NOT_MAPPABLE


@case("3.30")
def test_tpdo_takes_an_input(device: Device) -> None:
    """A process input (ro, rwr) can be mapped into a TPDO."""
    assert first_mapping_code(device, tpdos(device)[0], mappable(device, INPUTS)[-1]) == 0


@case("3.31")
def test_tpdo_refuses_an_output(device: Device) -> None:
    """A process output (rww, wo) cannot be mapped into a TPDO."""
    pdo = tpdos(device)[0]
    assert first_mapping_code(device, pdo, mappable(device, OUTPUTS)[0]) in NOT_MAPPABLE


@case("3.32")
def test_tpdo_refuses_the_unmappable(device: Device) -> None:
    """An object that is not mappable by the EDS cannot be mapped into a TPDO."""
    assert first_mapping_code(device, tpdos(device)[0], unmappable(device)) in NOT_MAPPABLE


@case("3.33")
def test_dummies_fill_an_rpdo(device: Device) -> None:
    """An object after a dummy byte receives its bytes, and the dummy counts in the length."""
    pdo = rpdos(device)[0]
    if DUMMY_UNSIGNED8 not in device.eds.dummies:
        pytest.skip("the EDS allows no dummy UNSIGNED8")
    pdo.need_variable_mapping()
    variable = next((v for v in mappable(device, {"rww", "rw"}) if distinct(v)), None)
    if variable is None:
        pytest.skip("no mappable object can hold two distinct values")
    assert pdo.map([DUMMY_UNSIGNED8 << 16 | 8, word(variable)]) == 0
    pdo.enable()
    can_id = pdo.can_id
    before = device.sdo.upload(variable.index, variable.subindex)
    value = before
    if variable.type.numeric:
        value = next(p for p in (pattern(variable, 1), pattern(variable, 9)) if p != before)
    device.enter(OPERATIONAL)
    device.wire.send(can_id, b"\xaa" + value)
    device.barrier()
    now = device.sdo.upload(variable.index, variable.subindex)
    assert now == value, f"{value.hex()} behind a dummy was stored as {now.hex()}"
    codes = set(device.emergencies())
    assert not codes & {PDO_TOO_SHORT, PDO_TOO_LONG}, "the RPDO had the wrong length"

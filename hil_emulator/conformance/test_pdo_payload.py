"""Chapter 3, third part: PDOs carry the values of their objects (CiA 301 7.2.2, 7.5.2.36)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import (
    need_emergency,
    need_remote_frames,
    need_sync,
    need_writable,
)
from hil_emulator.conformance.device import OPERATIONAL, PRE_OPERATIONAL, STOPPED, Device
from hil_emulator.conformance.errors import PDO_TOO_SHORT
from hil_emulator.conformance.patterns import loops, packed, pattern
from hil_emulator.conformance.pdo import (
    EVENT_TIMER,
    TRANSMISSION_TYPE,
    Pdo,
    receiving,
    usable,
    word,
)
from hil_emulator.conformance.situations import ACYCLIC, EVERY
from hil_emulator.device.entry import Entry

RPDO_OVERDUE = 0x8250
SYNCHRONOUS_WINDOW = 0x1007
ON_REQUEST_AT_SYNC = 252
SYNC_CYCLIC_MAX = 240
"""Largest transmission type of a synchronous RPDO (CiA 301 7.5.2.35)."""
WINDOW_MS, DEADLINE_MS = 2000, 100
DIGITS = 2
"""Largest change of process data at rest [digits] (assumed)."""
LOOKS = 3
"""SDO reads before and after a TPDO, to measure the change of process data (assumed)."""


def mapped(device: Device, pdo: Pdo) -> list[Entry]:
    """Return the variables of a PDO; skip the case if some cannot be read."""
    keys = [(entry >> 16, entry >> 8 & 0xFF) for entry in pdo.words()]
    variables = [device.eds.variables.get(key) for key in keys]
    readable = [v for v in variables if v is not None and v.readable and v.type.numeric]
    if len(readable) < len(keys):
        pytest.skip(f"{pdo.name} carries objects that cannot be read")
    return readable


def values(device: Device, variables: list[Entry]) -> list[bytes]:
    """Read variables by SDO."""
    return [device.sdo.upload(v.index, v.subindex) for v in variables]


def answer(device: Device, can_id: int) -> bytes | None:
    """Return the data of an identifier after a SYNC; skip the case without a SYNC consumer."""
    need_sync(device)
    since = len(device.wire.log)
    device.sync()
    return device.wire.await_frame(can_id, since=since, patience_ms=200)


def loop_tpdo(device: Device, kind: int, *, remote: bool = False) -> tuple[int, Entry]:
    """Map one writable object into a TPDO; return identifier and object."""
    pdo = usable(device)[0]
    pdo.need_variable_mapping()
    objects = loops(device.eds)
    if not objects:
        pytest.skip("no object can be both written and mapped into a TPDO")
    assert pdo.map([word(objects[0])]) == 0
    pdo.configure(kind)
    pdo.enable(remote=remote)
    return pdo.can_id, objects[0]


def put(device: Device, variable: Entry, seed: int) -> bytes:
    """Write a pattern and return it."""
    data = pattern(variable, seed)
    device.sdo.download(variable.index, variable.subindex, data)
    return data


class Reception:
    """An enabled RPDO, with the values of its objects before and after."""

    def __init__(self, device: Device, kind: int = 255) -> None:
        self.device = device
        if kind <= SYNC_CYCLIC_MAX:
            need_sync(device)
        self.pdo = receiving(device)
        self.variables = mapped(device, self.pdo)
        self.pdo.set(TRANSMISSION_TYPE, kind)
        self.sent: list[bytes] = []

    def start(self) -> None:
        """Enable the RPDO and enter OPERATIONAL."""
        self.pdo.enable()
        self.can_id = self.pdo.can_id
        self.device.enter(OPERATIONAL)

    def send(self, seed: int, change: int = 0) -> None:
        """Send patterns, with `change` bytes more than the RPDO maps."""
        before = values(self.device, self.variables)
        choices = [
            [pattern(v, seed + n), pattern(v, seed + n + 7)] for n, v in enumerate(self.variables)
        ]
        self.sent = [a if a != b else c for (a, c), b in zip(choices, before, strict=True)]
        self.before = before
        data = packed(self.variables, self.sent)
        data = data[:change] if change < 0 else data + bytes(change)
        self.device.wire.send(self.can_id, data)
        self.device.barrier()

    @property
    def applied(self) -> bool:
        """Whether the objects have the values sent last; otherwise they must be unchanged."""
        present = values(self.device, self.variables)
        assert present in (self.sent, self.before), (
            f"{present}: neither {self.sent} nor {self.before}"
        )
        return present == self.sent


@case("3.301")
def test_tpdos_show_their_objects(device: Device) -> None:
    """The data of a TPDO are the values that SDO reads, in the order of the mapping."""
    for pdo in usable(device):
        pdo.configure(EVERY)
        variables = mapped(device, pdo)
        pdo.enable()
        can_id = pdo.can_id
        device.enter(OPERATIONAL)
        looks = [values(device, variables) for _ in range(LOOKS)]
        shown = _parts(variables, answer(device, can_id))
        looks += [values(device, variables) for _ in range(LOOKS)]
        for variable, part, *reads in zip(variables, shown, *looks, strict=True):
            assert _among(variable, part, reads), f"{pdo.name}: {part.hex()} for {reads[-1].hex()}"
        device.enter(PRE_OPERATIONAL)
        pdo.disable()


def _among(variable: Entry, part: bytes, reads: list[bytes]) -> bool:
    """Return whether a value is one of those read, or near them for process data."""
    if part in reads or variable.writable:
        return part in reads
    value, *numbers = (variable.type.decode(data) for data in (part, *reads))
    margin = 3 * (max(numbers) - min(numbers)) + DIGITS
    return bool(min(numbers) - margin <= value <= max(numbers) + margin)


def _parts(variables: list[Entry], data: bytes | None) -> list[bytes]:
    """Return the values in a PDO's data."""
    assert data is not None, "SYNC triggered no TPDO"
    number, parts = int.from_bytes(data, "little"), []
    for variable in variables:
        bits = variable.type.bits
        parts.append((number & (1 << bits) - 1).to_bytes(variable.type.size, "little"))
        number >>= bits
    return parts


@case("3.302")
def test_tpdo_follows_its_object(device: Device) -> None:
    """The next TPDO carries the value written by SDO, least significant byte first."""
    can_id, variable = loop_tpdo(device, EVERY)
    device.enter(OPERATIONAL)
    for seed in range(3):
        assert put(device, variable, seed) == answer(device, can_id)


@case("3.303")
def test_rpdo_is_stored(device: Device) -> None:
    """Each object of an RPDO has the value at its position."""
    reception = Reception(device)
    reception.start()
    for seed in range(2):
        reception.send(seed)
        assert reception.applied


@case("3.304")
def test_rpdo_is_taken_in_operational_alone(device: Device) -> None:
    """An RPDO in PRE-OPERATIONAL or STOPPED changes no object, neither at once nor later."""
    reception = Reception(device)
    reception.start()
    device.enter(PRE_OPERATIONAL)
    reception.send(1)
    assert not reception.applied, "taken in PRE-OPERATIONAL"
    data = packed(reception.variables, reception.sent)
    device.enter(STOPPED)
    device.wire.send(reception.can_id, data)
    device.wire.run(50)
    device.enter(PRE_OPERATIONAL)
    assert not reception.applied, "taken in STOPPED"
    device.enter(OPERATIONAL)
    assert not reception.applied, "taken later"


@case("3.305")
def test_synchronous_rpdo_waits_for_sync(device: Device) -> None:
    """With type 0 an RPDO takes effect with the next SYNC, not before."""
    reception = Reception(device, kind=0)
    reception.start()
    reception.send(1)
    assert not reception.applied, "applied without SYNC"
    device.sync()
    device.barrier()
    assert reception.applied, "not applied at SYNC"


@case("3.306")
def test_synchronous_window_is_open(device: Device) -> None:
    """An RPDO between SYNC and the end of the window takes effect; a later one need not."""
    need_writable(device, SYNCHRONOUS_WINDOW)
    device.sdo.write(SYNCHRONOUS_WINDOW, 0, 1000 * WINDOW_MS, 4)
    reception = Reception(device, kind=0)
    reception.start()
    device.sync()
    device.wire.run(WINDOW_MS / 20)
    reception.send(1)
    device.sync()
    device.barrier()
    assert reception.applied


@case("3.307")
def test_short_rpdo_is_reported(device: Device) -> None:
    """An RPDO with a byte too few causes an emergency 8210 and changes no object."""
    need_emergency(device)
    reception = Reception(device)
    reception.start()
    since = len(device.wire.log)
    reception.send(1, change=-1)
    assert not reception.applied
    assert device.await_emergency(PDO_TOO_SHORT, since) is not None, "no emergency 8210"


@case("3.308")
def test_long_rpdo_is_taken(device: Device) -> None:
    """The first bytes of an RPDO that is too long are used."""
    reception = Reception(device)
    if reception.pdo.size() == 8:
        pytest.skip(f"{reception.pdo.name} has eight bytes")
    reception.start()
    reception.send(1, change=1)
    assert reception.applied


@case("3.309")
def test_overdue_rpdo_is_reported(device: Device) -> None:
    """An RPDO that is missing after its event timer causes an emergency 8250."""
    need_emergency(device)
    reception = with_deadline(device)
    since = len(device.wire.log)
    reception.send(1)
    assert device.await_emergency(RPDO_OVERDUE, since) is not None, "no emergency 8250"


@case("3.310")
def test_remote_frame_is_answered_with_the_last_sync(device: Device) -> None:
    """With type 252 the values are those at the last SYNC, despite later writes."""
    need_remote_frames(device)
    need_sync(device)
    can_id, variable = loop_tpdo(device, ON_REQUEST_AT_SYNC, remote=True)
    device.enter(OPERATIONAL)
    sampled = put(device, variable, 1)
    device.sync()
    put(device, variable, 2)
    since = len(device.wire.log)
    device.wire.send(can_id, remote=True)
    assert device.wire.await_frame(can_id, since=since) == sampled


@case("3.311")
def test_acyclic_tpdo_needs_an_event(device: Device) -> None:
    """With type 0, SYNC triggers no TPDO while the object is unchanged."""
    can_id, variable = loop_tpdo(device, ACYCLIC)
    put(device, variable, 1)
    device.enter(OPERATIONAL)
    answer(device, can_id)
    assert [answer(device, can_id) for _ in range(3)] == [None, None, None]


@case("3.312")
def test_rpdo_that_never_came_is_not_overdue(device: Device) -> None:
    """The event timer of an RPDO starts with its first reception, not with OPERATIONAL."""
    need_emergency(device)
    reception = with_deadline(device)
    since = len(device.wire.log)
    device.wire.run(3 * DEADLINE_MS)
    assert RPDO_OVERDUE not in device.emergencies(since)
    assert reception.pdo.valid


@case("3.313")
def test_rpdo_is_overdue_again(device: Device) -> None:
    """An RPDO that returns and stops again is reported a second time."""
    need_emergency(device)
    reception = with_deadline(device)
    for seed in (1, 2):
        since = len(device.wire.log)
        device.enter(OPERATIONAL)  # an error may have ended this state
        reception.send(seed)
        assert device.await_emergency(RPDO_OVERDUE, since) is not None, f"not reported: {seed}"


@case("3.314")
def test_synchronous_rpdo_is_forgotten(device: Device) -> None:
    """An RPDO that waits for SYNC is dropped when OPERATIONAL is left."""
    reception = Reception(device, kind=0)
    reception.start()
    reception.send(1)
    device.enter(PRE_OPERATIONAL)
    device.enter(OPERATIONAL)
    device.sync()
    assert not reception.applied


@case("3.315")
def test_last_synchronous_rpdo_is_applied_once(device: Device) -> None:
    """SYNC applies the last of two RPDOs; the next SYNC does not apply it again."""
    reception = Reception(device, kind=0)
    variable = next((v for v in reception.variables if v.writable), None)
    reception.start()
    reception.send(1)
    reception.send(3)
    device.sync()
    assert reception.applied, "not the last one"
    if variable is None:
        return
    written = put(device, variable, 5)
    device.sync()
    value = device.sdo.upload(variable.index, variable.subindex)
    assert value == written, "applied a second time"


@case("3.316")
def test_invalid_rpdo_is_not_taken(device: Device) -> None:
    """With bit 31 of its COB-ID set again, an RPDO changes no object."""
    reception = Reception(device)
    reception.start()
    reception.send(1)
    reception.pdo.disable()
    reception.send(3)
    assert not reception.applied


def with_deadline(device: Device) -> Reception:
    """Return an RPDO with an event timer, in OPERATIONAL; skip the case without an event timer."""
    reception = Reception(device)
    if not reception.pdo.offers(EVENT_TIMER):
        pytest.skip(f"{reception.pdo.name} has no event timer")
    reception.pdo.set(EVENT_TIMER, DEADLINE_MS)
    reception.start()
    return reception

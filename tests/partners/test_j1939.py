"""J1939 partners, judged by `can-j1939`: address claim, transport protocol, requests."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import cantools
import j1939
import pytest

from hil_emulator.device.measured import Measured
from hil_emulator.frame import Frame
from hil_emulator.partners.commands import CommandSignal, ObeyedMessage
from hil_emulator.partners.j1939 import NO_ADDRESS, J1939Partner, Name
from hil_emulator.partners.sent_message import SentMessage
from hil_emulator.platform.paths import shipped

MS = 1_000_000
ADDRESS, OTHER = 0x80, 0x90
FORCE, CALIBRATION, LIMITS = 0xFF10, 0xFF20, 0xFF30
CLAIM_ID = 0x18EEFF80
DATABASE = cantools.database.load_file(shipped("configs/partners/load_cell.dbc"))
LIMITS_DBC = """VERSION ""

BU_: load_cell

BO_ 2566861054 Limits: 12 master
 SG_ Current : 64|32@1- (0.001,0) [0|0] "mA" load_cell
"""


def load_cell(arbitrary: bool = False, identity: int = 4711) -> J1939Partner:
    """Return the load cell of the examples; it also obeys a message of twelve bytes."""
    force, calibration = (DATABASE.get_message_by_name(n) for n in ("Force", "Calibration"))
    limits = cantools.database.load_string(LIMITS_DBC, "dbc").get_message_by_name("Limits")
    return J1939Partner(
        "load_cell",
        [
            SentMessage(force, {"Force": lambda now_ns, m: m.values[0]}, 5 * MS),
            SentMessage(calibration, {"Span": lambda now_ns, m: 20_000}, 0),
        ],
        [ObeyedMessage(limits, [CommandSignal("Current", "valve_current", 1e-3, 0.0)], 0)],
        Name(identity, 0, 0, arbitrary),
        ADDRESS,
    )


class Bench:
    """A partner in simulated time, and an ECU of `can-j1939` that hears it."""

    def __init__(self, partner: J1939Partner) -> None:
        self.partner = partner
        self.now_ns = 0
        self.heard: list[Frame] = []
        self.received: list[tuple[int, int, bytes]] = []
        self._arriving: list[Frame] = []
        self.ecu: Any = j1939.ElectronicControlUnit(send_message=self._sent)
        name = j1939.Name(arbitrary_address_capable=0, identity_number=9)
        self.application = self.ecu.add_ca(name=name, device_address=OTHER)
        self.application.subscribe(self._on_message)
        self.application.start()

    def _sent(self, can_id: int, extended: bool, data: Any, fd: bool = False) -> None:
        self._arriving.append(Frame(can_id, bytes(data), False, extended))

    def _on_message(self, priority: int, pgn: int, source: int, stamp: float, data: Any) -> None:
        self.received.append((pgn, source, bytes(data)))

    def step(self, *frames: Frame, milliseconds: int = 1) -> None:
        """Let time pass for the partner; the ECU hears at once what it sends."""
        for _ in range(milliseconds):
            arriving, self._arriving = [*self._arriving, *frames], []
            frames = ()
            self.commands = self.partner.receive(self.now_ns, arriving)
            for frame in self.partner.publish(self.now_ns, Measured([123.4], [0])):
                self.heard.append(frame)
                self.ecu.notify(frame.can_id, bytearray(frame.data), self.now_ns * 1e-9)
            self.now_ns += MS

    def until(self, met: Callable[[], bool]) -> None:
        """Let time pass until a condition holds; the ECU's own thread gets moments to act."""
        for _ in range(2000):
            if met():
                return
            self.step()
            time.sleep(0.0005)
        raise AssertionError("it did not come")

    def count(self, can_id: int) -> int:
        """Return how many frames with an identifier the partner has sent."""
        return sum(frame.can_id == can_id for frame in self.heard)


@pytest.fixture(scope="module")
def claimed() -> Iterator[Bench]:
    """Yield the load cell and an ECU, both with an address: the ECU takes a while for it."""
    made = Bench(load_cell())
    made.until(lambda: made.application.state == j1939.ControllerApplication.State.NORMAL)
    made.step(milliseconds=300)
    yield made
    made.ecu.stop()


@pytest.fixture
def bench(claimed: Bench) -> Bench:
    """Return both, with nothing heard yet and no transfer under way."""
    claimed.step(milliseconds=300)
    claimed.heard.clear()
    claimed.received.clear()
    return claimed


def test_nothing_is_sent_before_the_address_is_claimed() -> None:
    """The claim comes first; a node in the contested range waits 250 ms (J1939-81)."""
    partner = load_cell()
    frames = partner.publish(0, Measured([0.0], [0]))
    assert [f.can_id for f in frames] == [CLAIM_ID]
    assert int.from_bytes(frames[0].data, "little") == 4711
    quiet = [f for ms in range(1, 250) for f in partner.publish(ms * MS, Measured([0.0], [0]))]
    assert quiet == []
    assert [f.can_id & 0xFF for f in partner.publish(250 * MS, Measured([0.0], [0]))] == [ADDRESS]


def test_the_name_is_that_of_the_standard() -> None:
    """`can-j1939` finds the same fields in the number."""
    name = j1939.Name(bytes=list(Name(0x1ABCD, 0x3F1, 0x55, True).value.to_bytes(8, "little")))
    assert (name.identity_number, name.manufacturer_code, name.function) == (0x1ABCD, 0x3F1, 0x55)
    assert name.arbitrary_address_capable


@pytest.mark.parametrize(("arbitrary", "address"), [(False, NO_ADDRESS), (True, 129)])
def test_the_smaller_name_keeps_an_address(arbitrary: bool, address: int) -> None:
    """A claim with a smaller NAME takes the address, one with a greater NAME is answered."""
    partner = load_cell(arbitrary)
    partner.publish(0, Measured([0.0], [0]))
    greater = Frame(CLAIM_ID, (1 << 63 | 9999).to_bytes(8, "little"), False, True)
    partner.receive(MS, [greater])
    assert partner.address == ADDRESS
    assert [f.can_id for f in partner.publish(MS, Measured([0.0], [0]))] == [CLAIM_ID]
    partner.receive(2 * MS, [Frame(CLAIM_ID, (5).to_bytes(8, "little"), False, True)])
    assert partner.address == address
    (claim,) = partner.publish(2 * MS, Measured([0.0], [0]))
    assert claim.can_id == 0x18EEFF00 | address


def test_short_messages_are_read_by_the_ecu(bench: Bench) -> None:
    """A message of eight bytes comes with PGN, source address and the value of the channel."""
    bench.until(lambda: any(pgn == FORCE for pgn, _, _ in bench.received))
    _, source, data = next(r for r in bench.received if r[0] == FORCE)
    assert source == ADDRESS
    assert DATABASE.get_message_by_name("Force").decode(data)["Force"] == pytest.approx(123.4)


def test_a_requested_long_message_is_broadcast(bench: Bench) -> None:
    """The ECU's request for 16 bytes is answered by BAM, which the ECU assembles."""
    bench.application.send_request(0, CALIBRATION, ADDRESS)
    bench.until(lambda: any(pgn == CALIBRATION for pgn, _, _ in bench.received))
    _, source, data = next(r for r in bench.received if r[0] == CALIBRATION)
    assert (source, len(data)) == (ADDRESS, 16)
    assert DATABASE.get_message_by_name("Calibration").decode(data)["Span"] == 20_000


def test_packets_of_a_broadcast_are_50_ms_apart() -> None:
    """BAM, then a packet every 50 ms (J1939-21)."""
    partner, times = load_cell(), []
    request = Frame(0x18EA8090, CALIBRATION.to_bytes(3, "little"), False, True)
    for ms in range(600):
        partner.receive(ms * MS, [request] if ms == 300 else [])
        for frame in partner.publish(ms * MS, Measured([0.0], [0])):
            if frame.can_id >> 16 & 0xFF in (0xEC, 0xEB):
                times.append((ms, frame.data[0]))
    assert times == [(300, 32), (350, 1), (400, 2), (450, 3)]


def test_a_request_for_what_is_not_there_is_refused(bench: Bench) -> None:
    """A request of an unknown group has a negative acknowledgement with that group."""
    bench.application.send_request(0, 0xFECA, ADDRESS)
    bench.step(milliseconds=5)
    (frame,) = [f for f in bench.heard if f.can_id >> 16 & 0xFF == 0xE8]
    assert (frame.data[0], frame.data[5:]) == (1, 0xFECA.to_bytes(3, "little"))


def test_the_address_can_be_requested(bench: Bench) -> None:
    """A request for the address claimed is answered by the claim."""
    before = bench.count(CLAIM_ID)
    bench.application.send_request(0, 0xEE00, 255)
    bench.step(milliseconds=5)
    assert bench.count(CLAIM_ID) == before + 1


def test_a_long_command_comes_by_connection(bench: Bench) -> None:
    """The ECU sends twelve bytes by RTS; the partner answers CTS and acknowledges the end."""
    data = [0] * 8 + list((2500).to_bytes(4, "little"))
    bench.application.send_pgn(0, 0xEF, ADDRESS, 6, data)  # PDU1 to the partner
    bench.until(lambda: any(f.can_id >> 16 & 0xFF == 0xEC and f.data[0] == 19 for f in bench.heard))


def test_a_long_message_goes_to_one_node_by_connection(bench: Bench) -> None:
    """Sixteen bytes to the ECU's address: RTS, packets as its CTS allow, end acknowledged."""
    bench.partner._transport.send(0xEF00, bytes(range(16)), OTHER)
    bench.until(lambda: any(pgn == 0xEF00 for pgn, _, _ in bench.received))
    assert next(r for r in bench.received if r[0] == 0xEF00) == (0xEF00, ADDRESS, bytes(range(16)))


def test_a_connection_without_an_answer_is_given_up() -> None:
    """Where no CTS comes, the partner aborts after 1.25 s and goes on (J1939-21, T3)."""
    partner = load_cell()
    controls = []
    for ms in range(1700):
        if ms == 300:
            partner._transport.send(0xEF00, bytes(16), OTHER)
        for frame in partner.publish(ms * MS, Measured([0.0], [0])):
            if frame.can_id >> 16 & 0xFF == 0xEC:
                controls.append((ms, frame.data[0]))
    assert controls == [(300, 16), (1550, 255)]


def test_a_long_command_is_obeyed_from_a_broadcast(bench: Bench) -> None:
    """What the ECU broadcasts in two packets sets the current."""
    data = [0] * 8 + list((2500).to_bytes(4, "little"))
    bench.application.send_pgn(0, LIMITS >> 8, LIMITS & 0xFF, 6, data)
    bench.until(lambda: bench.commands.get("valve_current") == pytest.approx(2.5e-3))

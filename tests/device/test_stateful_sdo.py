"""The SDO server against a second one written from the specification, request by request."""

from binascii import crc_hqx

from device_master import CHANNELS, EDS, NODE_ID, SDO_ANSWER, Master, booted
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from sdo_reference import TIMEOUT_MS, Object, SdoReference, head

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

LIMIT = 10_000_000
KEYS = ((0x1000, 0), (0x1000, 1), (0x1004, 0), (0x1008, 0), (0x1017, 0), (0x1029, 1), (0x2001, 0))
WRITABLE = KEYS[4:]
NAME = b"Hydraulic actuator emulator"

keys = st.sampled_from(KEYS)
targets = st.sampled_from(WRITABLE)
values = st.sampled_from([0, 1, 2, 3, 500, LIMIT, LIMIT + 1]).map(lambda n: n.to_bytes(4, "little"))
values |= st.binary(min_size=4, max_size=4)
parts = st.binary(min_size=7, max_size=7)


def known_objects() -> dict[tuple[int, int], Object]:
    """Return the objects of both servers."""
    return {
        (0x1000, 0): Object((0x198).to_bytes(4, "little")),
        (0x1008, 0): Object(NAME),
        (0x1017, 0): Object((0).to_bytes(2, "little"), writable=True, high=0xFFFF),
        (0x1029, 1): Object(b"\0", writable=True, high=2),
        (0x2001, 0): Object(bytes(4), writable=True, low=-LIMIT, high=LIMIT),
    }


class SdoConversation(RuleBasedStateMachine):
    """A client that sends random requests; both servers must answer the same."""

    def __init__(self) -> None:
        super().__init__()
        node = Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, {"valve_current": 0.0})
        self.master: Master = booted(node)
        self.reference = SdoReference(known_objects())
        self.master.remote.sdo.download(0x1017, 0, b"\0\0")
        self.number = 1  # of the next segment, if the client makes no mistake
        self.toggle = 0

    def send(self, request: bytes) -> None:
        """Send a request to both servers and compare."""
        assert len(request) == 8
        answer = bytes.fromhex(self.master.request(request.hex()).replace(" ", ""))
        expected = b"".join(self.reference.answer(request))
        assert answer == expected, f"{request.hex()}: {answer.hex()}, not {expected.hex()}"

    @rule(key=keys)
    def begin_upload(self, key: tuple[int, int]) -> None:
        """Request an object."""
        self.toggle = 0
        self.send(head(0x40, key) + bytes(4))

    @rule(mistake=st.booleans() | st.just(False))
    def ask_for_segment(self, mistake: bool) -> None:
        """Request the next segment, or a wrong one."""
        self.send(bytes([0x60 | (0x10 if self.toggle ^ mistake else 0)]) + bytes(7))
        self.toggle ^= 1

    @rule(key=targets, value=values, length=st.integers(1, 4), sized=st.booleans())
    def write(self, key: tuple[int, int], value: bytes, length: int, sized: bool) -> None:
        """Write up to four bytes."""
        command = 0x23 | 4 - length << 2 if sized else 0x22
        self.send(head(command, key) + value)

    @rule(key=targets, value=values)
    def write_right_length(self, key: tuple[int, int], value: bytes) -> None:
        """Write as many bytes as the object has."""
        length = len(self.reference.objects[key].value)
        self.send(head(0x23 | 4 - length << 2, key) + value)

    @rule(key=keys, size=st.integers(0, 8), sized=st.booleans())
    def begin_download(self, key: tuple[int, int], size: int, sized: bool) -> None:
        """Announce segments."""
        self.toggle = 0
        self.send(head(0x20 | sized, key) + size.to_bytes(4, "little"))

    @rule(
        part=parts,
        unused=st.integers(0, 7),
        last=st.booleans(),
        mistake=st.just(False) | st.booleans(),
    )
    def send_segment(self, part: bytes, unused: int, last: bool, mistake: bool) -> None:
        """Send a segment with a correct or wrong toggle bit."""
        toggle = 0x10 if self.toggle ^ mistake else 0
        self.send(bytes([toggle | unused << 1 | last]) + part)
        self.toggle ^= 1

    @rule(
        key=keys, block=st.sampled_from([0, 1, 2, 127, 128]), threshold=st.sampled_from([0, 4, 99])
    )
    def begin_block_upload(self, key: tuple[int, int], block: int, threshold: int) -> None:
        """Request a block."""
        self.send(head(0xA4, key) + bytes([block, threshold, 0, 0]))

    @rule()
    def start_block(self) -> None:
        """Start the block upload."""
        self.send(bytes([0xA3]) + bytes(7))

    @rule(received=st.integers(0, 5), block=st.sampled_from([1, 2, 3, 127, 0]))
    def acknowledge(self, received: int, block: int) -> None:
        """Acknowledge some segments of a block, perhaps more than there were."""
        self.send(bytes([0xA2, received, block]) + bytes(5))

    @rule()
    def end_block_upload(self) -> None:
        """Confirm the end."""
        self.send(bytes([0xA1]) + bytes(7))

    @rule(key=targets, sized=st.booleans(), checked=st.booleans(), wrong=st.integers(0, 1))
    def begin_block_download(
        self, key: tuple[int, int], sized: bool, checked: bool, wrong: int
    ) -> None:
        """Announce a block."""
        self.number = 1
        size = len(self.reference.objects[key].value) + wrong
        command = 0xC0 | (2 if sized else 0) | (4 if checked else 0)
        self.send(head(command, key) + size.to_bytes(4, "little"))

    @precondition(lambda self: self.in_block_download)
    @rule(part=parts, last=st.booleans(), skip=st.sampled_from([0, 0, 0, 1, 126]))
    def send_block_segment(self, part: bytes, last: bool, skip: int) -> None:
        """Send a segment of a block, in sequence or not."""
        number = min(self.number + skip, 127)
        self.send(bytes([number | (0x80 if last else 0)]) + part)
        self.number = number % 127 + 1

    @precondition(lambda self: self.in_block_download)
    @rule(mistake=st.just(False) | st.booleans())
    def end_block_download(self, mistake: bool) -> None:
        """End the block with its checksum, perhaps a wrong one."""
        transfer = self.reference.transfer
        assert transfer is not None
        length = len(self.reference.objects[transfer.key].value)
        padding = max(0, min(7, len(transfer.data) - length))
        checksum = crc_hqx(transfer.data[: len(transfer.data) - padding], 0) ^ mistake
        self.send(bytes([0xC1 | padding << 2]) + checksum.to_bytes(2, "little") + bytes(5))

    @rule(block=st.integers(1, 5), received=st.lists(st.integers(0, 5), max_size=4))
    def upload_blocks(self, block: int, received: list[int]) -> None:
        """Take a string in blocks of which some segments get lost."""
        self.give_up((0x1008, 0))
        self.begin_block_upload((0x1008, 0), block, 0)
        self.start_block()
        for count in received:
            self.acknowledge(count, block)

    @rule(key=targets, value=values, checked=st.booleans(), mistake=st.booleans())
    def download_block(
        self, key: tuple[int, int], value: bytes, checked: bool, mistake: bool
    ) -> None:
        """Write an object as a block, at times with a wrong checksum."""
        self.give_up(key)
        self.begin_block_download(key, True, checked, 0)
        self.send_block_segment(value + bytes(3), True, 0)
        self.end_block_download(mistake)

    @rule(key=targets, value=values, announced=st.booleans(), short=st.booleans())
    def download_segment(
        self, key: tuple[int, int], value: bytes, announced: bool, short: bool
    ) -> None:
        """Write an object in a segment, at times with fewer bytes than announced."""
        length = len(self.reference.objects[key].value)
        self.give_up(key)
        self.begin_download(key, length, announced)
        self.send_segment(value + bytes(3), 7 - length + short, True, False)

    @rule(key=keys)
    def give_up(self, key: tuple[int, int]) -> None:
        """Abort as a client."""
        self.send(head(0x80, key) + (0x0800_0000).to_bytes(4, "little"))

    @rule(key=keys)
    def send_undefined_command(self, key: tuple[int, int]) -> None:
        """Send the undefined command specifier 7."""
        self.send(head(0xE0, key) + bytes(4))

    @rule()
    def pause(self) -> None:
        """Send no request for longer than the server's time-out."""
        before = len(self.master.data(SDO_ANSWER))
        self.master.run(TIMEOUT_MS + 1)
        assert self.master.data(SDO_ANSWER)[before:] == self.reference.time_out()

    @property
    def in_block_download(self) -> bool:
        """Whether a block is being downloaded."""
        transfer = self.reference.transfer
        return transfer is not None and transfer.kind == "block_download"

    @invariant()
    def objects_are_the_same(self) -> None:
        """Both servers' objects have the same values."""
        dictionary = self.master.network.node.dictionary
        for key in WRITABLE:
            assert dictionary.upload(*key) == self.reference.objects[key].value


TestSdoConversation = SdoConversation.TestCase
TestSdoConversation.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)

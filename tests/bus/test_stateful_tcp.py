"""The TCP server compared with a model of its clients."""

import contextlib
import re
import struct
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import can
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from tcp_client import Client, polled
from wires import PATIENCE_S, frame_of, message_of

from hil_emulator.bus.tcp_listener import MAX_CLIENTS
from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.frame import Frame

SERVER = 0  # its number among the senders
FORBIDDEN = Frame(0x7FF, b"intruder")
OPEN = b"< open can0 >"
BAD_BEGINNINGS = (
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n",
    *(b"GET / HTTP/1.0\r\n\r\n", b"\x16\x03\x01", b" " * 200),
    *(b"< rawmode >", b"< hi >", b"<>", b">"),
)
ANSWERS = {
    b"< open can7 >": b"< error",
    b"< echo >": b"< echo >",
    b"<>": b"< error",
    b"< send 7ff 1 66 >": b"< error",
}
NOISES = (
    *(b"<" * 50, b">" * 50, b"< se", OPEN),
    *(b"< send >", b"< send 800 0 >", b"< send 1 9 >", b"< send 7ff 2 66 >"),
)

beginnings = st.sampled_from(BAD_BEGINNINGS)
beginnings |= st.binary(min_size=1, max_size=40).map(lambda tail: b"\0" + tail)
# drawn at random, too, a command is a command
noises = st.binary(max_size=300).filter(lambda n: b"send" not in n) | st.sampled_from(NOISES)
which = st.integers(0, MAX_CLIENTS)


def line_of(frame: Frame) -> bytes:
    """Return a send command as a client writes it."""
    id_text = f"{frame.can_id:08x}" if frame.extended else f"{frame.can_id:x}"
    return f"< send {id_text} {len(frame.data)} {frame.data.hex(' ')} >".encode()


class Speaker:
    """A client on the bus, and its incomplete command."""

    def __init__(self, client: Client, number: int) -> None:
        self.client = client
        self.number = number
        self.rest = b""
        self.begun: Frame | None = None  # the frame of the command once `rest` is sent


class TcpBus(RuleBasedStateMachine):
    """Correct and wrong clients; a stock client that only listens records the frames of the bus."""

    def __init__(self) -> None:
        super().__init__()
        self.server = SocketcandServerBus(port=0)
        address = {"host": self.server.host, "port": self.server.port, "channel": "can0"}
        with ThreadPoolExecutor(1) as pool:
            joining = pool.submit(lambda: can.Bus(interface="socketcand", **address))
            polled(self.server, joining.done)
        self.witness = joining.result()
        self.speakers: list[Speaker] = []
        self.halfway: list[Client] = []  # they began well, and are not on the bus yet
        self.senders = SERVER + 1
        self.count = 0
        self.sent: list[Frame] = []  # in the order of each sender
        self.witnessed: list[Frame] = []
        self.arrived: list[Frame] = []  # at the server

    def teardown(self) -> None:
        """Close all connections."""
        for client in [*self.halfway, *(speaker.client for speaker in self.speakers)]:
            client.socket.close()
        self.witness.shutdown()
        self.server.shutdown()

    def next_frame(self, sender: int, size: int = 8) -> Frame:
        """Return a unique frame whose identifier is the number of its sender."""
        self.count += 1
        data = struct.pack("<I", self.count) + bytes(4)
        return Frame(sender, data[:size], extended=bool(self.count % 2))

    def poll_until(self, true: Callable[[], bool]) -> None:
        """Poll the server until a condition is true; keep the received frames."""
        self.arrived += polled(self.server, true)

    def ask(self, client: Client, words: bytes, answer: bytes) -> None:
        """Send from a client that is not on the bus, and wait for the answer."""
        before = len(client.heard())
        client.send(words)
        self.poll_until(lambda: b">" in client.heard()[before:])
        assert client.heard()[before:].startswith(answer)

    def greeted(self) -> Client:
        """Return a client that has been greeted."""
        client = Client(self.server)
        self.poll_until(lambda: client.heard() == b"< hi >")
        return client

    @property
    def clients(self) -> int:
        """The expected number of clients, including the witness."""
        return 1 + len(self.speakers) + len(self.halfway)

    @precondition(lambda self: self.clients < MAX_CLIENTS - 1)
    @rule(opened=st.booleans())
    def begin(self, opened: bool) -> None:
        """Connect and open a channel, perhaps a channel that does not exist."""
        client = self.greeted()
        self.ask(client, *((OPEN, b"< ok >") if opened else (b"< open can7 >", b"< error")))
        self.halfway.append(client)

    @precondition(lambda self: self.halfway)
    @rule(at=which, words=st.sampled_from(list(ANSWERS)))
    def dawdle(self, at: int, words: bytes) -> None:
        """Send other commands during the handshake: frames are ignored."""
        self.ask(self.halfway[at % len(self.halfway)], words, ANSWERS[words])

    @precondition(lambda self: self.halfway)
    @rule(at=which, torn=st.integers(0, len(OPEN) - 1))
    def finish_handshake(self, at: int, torn: int) -> None:
        """Open the channel, perhaps again, in two pieces, and request raw mode."""
        client = self.halfway.pop(at % len(self.halfway))
        client.send(OPEN[:torn])
        self.poll_until(iter([False, True]).__next__)
        self.ask(client, OPEN[torn:], b"< ok >")
        self.ask(client, b"< rawmode >", b"< ok >")
        self.speakers.append(Speaker(client, self.senders))
        self.senders += 1

    @precondition(lambda self: self.speakers)
    @rule(at=which, count=st.integers(1, 200), size=st.integers(4, 8))
    def send(self, at: int, count: int, size: int) -> None:
        """Send complete commands at once; an incomplete command before them is dropped."""
        speaker = self.speakers[at % len(self.speakers)]
        frames = [self.next_frame(speaker.number, size) for _ in range(count)]
        speaker.client.send(b"".join(line_of(frame) for frame in frames))
        speaker.begun = None
        self.sent += frames

    @precondition(lambda self: self.speakers)
    @rule(at=which, cut=st.integers(1, 20))
    def tear(self, at: int, cut: int) -> None:
        """Send the beginning of a command."""
        speaker = self.speakers[at % len(self.speakers)]
        speaker.begun = self.next_frame(speaker.number)
        line = line_of(speaker.begun)
        speaker.client.send(line[:cut])
        speaker.rest = line[cut:]

    @precondition(lambda self: any(speaker.begun for speaker in self.speakers))
    @rule(at=which)
    def complete(self, at: int) -> None:
        """Send the rest of a command."""
        torn = [speaker for speaker in self.speakers if speaker.begun]
        speaker = torn[at % len(torn)]
        assert speaker.begun is not None
        speaker.client.send(speaker.rest)
        self.sent.append(speaker.begun)
        speaker.begun = None

    @precondition(lambda self: self.speakers)
    @rule(at=which, noise=noises)
    def rave(self, at: int, noise: bytes) -> None:
        """Send an invalid command; its `<` ends an incomplete command."""
        speaker = self.speakers[at % len(self.speakers)]
        speaker.client.send(b"<" + noise)
        speaker.begun = None

    @rule(count=st.integers(1, 30))
    def speak_as_the_server(self, count: int) -> None:
        """Send as the owner of the bus."""
        for _ in range(count):
            frame = self.next_frame(SERVER)
            self.server.send(message_of(frame))
            self.sent.append(frame)

    @precondition(lambda self: self.clients < MAX_CLIENTS - 1)
    @rule(beginning=beginnings, piece=st.sampled_from([1, 7, 4096]))
    def intrude(self, beginning: bytes, piece: int) -> None:
        """Begin with other bytes than `< open`: the server closes, at most with an error."""
        with self.greeted() as client:
            text = beginning + OPEN + b"< rawmode >" + line_of(FORBIDDEN) * 3
            with contextlib.suppress(OSError):
                for start in range(0, len(text), piece):
                    client.send(text[start : start + piece])
            self.poll_until(lambda: self.server.clients == self.clients)
            received = b""
            with contextlib.suppress(ConnectionResetError):
                while part := client.socket.recv(4096):
                    received += part
            assert re.fullmatch(rb"(< error [^<>]* >)?", received), received

    @precondition(lambda self: self.speakers or self.halfway)
    @rule(at=which, reset=st.booleans(), last=st.booleans())
    def vanish(self, at: int, reset: bool, last: bool) -> None:
        """Close or reset the connection, sometimes after the beginning of a command."""
        everybody = [*self.halfway, *(speaker.client for speaker in self.speakers)]
        client = everybody[at % len(everybody)]
        if last:
            client.send(b"< send 7ff 0")
        client.reset() if reset else client.socket.close()
        self.halfway = [other for other in self.halfway if other is not client]
        self.speakers = [speaker for speaker in self.speakers if speaker.client is not client]

    @rule()
    def come_and_go(self) -> None:
        """Connect and close before the server polls."""
        Client(self.server).reset()

    @invariant()
    def the_witness_receives_all_sent_frames(self) -> None:
        """Check that witness and owner receive every frame once, in the order of its sender."""
        self.speak_as_the_server(1)
        of_clients = sum(frame.can_id != SERVER for frame in self.sent)
        deadline = time.monotonic() + PATIENCE_S
        while (
            len(self.witnessed) < len(self.sent)
            or len(self.arrived) < of_clients
            or self.server.clients != self.clients
        ):
            assert time.monotonic() < deadline, "frames are missing, or clients too many"
            self.poll_until(iter([False, True]).__next__)
            while (message := self.witness.recv(0)) is not None:
                self.witnessed.append(frame_of(message))
        for sender in range(self.senders):
            sent = [frame for frame in self.sent if frame.can_id == sender]
            assert [frame for frame in self.witnessed if frame.can_id == sender] == sent
            arrived = [frame for frame in self.arrived if frame.can_id == sender]
            assert arrived == (sent if sender != SERVER else [])
        assert len(self.witnessed) == len(self.sent)
        assert len(self.arrived) == of_clients
        assert self.server.dropped == 0


TestTcpBus = pytest.mark.slow(TcpBus.TestCase)
TestTcpBus.settings = settings(max_examples=15, stateful_step_count=20, deadline=None)

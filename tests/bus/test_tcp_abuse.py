"""The embedded TCP server with floods, garbage and clients that do not read."""

import contextlib
import random
from collections.abc import Iterator

import can
import pytest
from tcp_client import Client, polled
from wires import message_of

from hil_emulator.bus import tcp_connection
from hil_emulator.bus.socketcand import CommandStream
from hil_emulator.bus.tcp_connection import READ_BYTES, WRITE_BUFFER_BYTES
from hil_emulator.bus.tcp_listener import MAX_CLIENTS
from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.frame import Frame

FRAME = Frame(0x181, bytes(range(8)))


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[SocketcandServerBus]:
    """Yield a server that only the test polls, without a pause after the handshake."""
    monkeypatch.setattr(tcp_connection, "HANDSHAKE_PAUSE_S", 0.0)
    with SocketcandServerBus(port=0) as server:
        yield server


def send_line(frame: Frame) -> bytes:
    """Return a send command as a client writes it."""
    id_text = f"{frame.can_id:08x}" if frame.extended else f"{frame.can_id:x}"
    return f"< send {id_text} {len(frame.data)} {frame.data.hex(' ')} >".encode()


def test_a_hundred_thousand_frames_cross_the_bus_in_order(server: SocketcandServerBus) -> None:
    """With any segmentation the owner and the other client receive every frame unchanged."""
    chance = random.Random(2)
    frames = [
        Frame(chance.getrandbits(11), chance.randbytes(chance.randrange(9))) for _ in range(100_000)
    ]
    stream = b"".join(send_line(frame) for frame in frames)
    with Client(server).shake_hands() as sender, Client(server).shake_hands() as witness:
        sender.socket.setblocking(False)
        got: list[Frame] = []
        while len(got) < len(frames):
            if stream:
                with contextlib.suppress(BlockingIOError):
                    stream = stream[sender.socket.send(stream[: chance.randrange(1, 20_000)]) :]
            got += polled(server, iter([False] * 100 + [True]).__next__)
            witness.heard()
        assert got == frames
        lines = CommandStream().feed(witness.hear(len(frames)))
        assert [line.split()[1] for line in lines] == [b"%03X" % frame.can_id for frame in frames]
        assert (server.dropped, server.ignored) == (0, 0)


def test_a_hundred_thousand_random_bytes_do_no_harm(server: SocketcandServerBus) -> None:
    """Noise before and after the handshake is counted and ignored; the client can still send."""
    chance = random.Random(3)
    noise = bytes(chance.choices([*range(256), *b"<<<<>>>>"], k=100_000))
    with Client(server) as deaf, Client(server).shake_hands() as loud:
        witness = Client(server).shake_hands()
        deaf.send(b"< open can7 >")
        for start in range(0, len(noise), 1000):
            deaf.send(noise[start : start + 1000])
            loud.send(noise[start : start + 1000])
            assert polled(server, iter([False] * 5 + [True]).__next__) == []
            deaf.heard()
        loud.send(send_line(FRAME))
        assert server.recv(10.0) is not None
        assert FRAME.data.hex().encode() in witness.hear(1)
        assert server.ignored > 100
        assert server.clients == 3


POST = (
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1:29536\r\nOrigin: http://evil.test\r\n"
    b"Content-Type: text/plain\r\n\r\n< open can0 >< rawmode >" + send_line(FRAME)
)


@pytest.mark.parametrize(
    "beginning",
    [POST, b"GET / HTTP/1.0\r\n\r\n", send_line(FRAME), b"\x16\x03\x01", b"< hi >", b" " * 200],
)
@pytest.mark.parametrize("piece", [1, 7, 4096])
def test_a_client_that_does_not_begin_with_open_is_closed(
    server: SocketcandServerBus, beginning: bytes, piece: int
) -> None:
    """The POST of a web page with commands in its body sends no frame, with any segmentation."""
    with Client(server).shake_hands() as witness, Client(server) as page:
        polled(server, lambda: server.clients == 2)
        for start in range(0, len(beginning), piece):
            with contextlib.suppress(OSError):
                page.send(beginning[start : start + piece])
        assert polled(server, lambda: server.clients == 1) == []
        assert b"frame" not in witness.heard()


def test_idle_connections_are_closed(
    server: SocketcandServerBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Connections that do not open the bus are closed after a time-out, for other clients."""
    idle = [Client(server) for _ in range(MAX_CLIENTS)]
    polled(server, lambda: server.clients == MAX_CLIENTS)
    with Client(server) as late:
        assert b"error" in late.hear(1)
    monkeypatch.setattr(tcp_connection, "HANDSHAKE_LIMIT_S", 0.0)
    with Client(server).shake_hands() as client:
        assert b"< error no rawmode for 5 s: connect again >" in idle[0].heard()
        server.send(message_of(FRAME))
        assert b"frame" in client.hear(1)
    for connection in idle:
        connection.socket.close()


def test_one_poll_takes_no_more_than_a_portion(server: SocketcandServerBus) -> None:
    """A client that sends many frames is served in portions and cannot block the loop."""
    with Client(server).shake_hands() as client:
        client.send(send_line(FRAME) * 1000)
        polled(server, lambda: bool(server._inbox))
        assert len(server._inbox) <= READ_BYTES // len(send_line(FRAME)) + 1


def test_only_a_client_that_stops_reading_loses_frames(
    server: SocketcandServerBus,
) -> None:
    """Its buffer is bounded, its losses are counted, and only whole frames are lost."""
    with (
        Client(server, receive_buffer=4096).shake_hands() as stalled,
        Client(server).shake_hands() as witness,
    ):
        assert server.recv(0) is None
        sent = 0
        while not server.dropped and sent < 1_000_000:  # the kernel buffers some 100 000 itself
            with contextlib.suppress(can.CanOperationError):
                server.send(message_of(FRAME))
            sent += 1
            witness.heard()
        for _ in range(9):
            with pytest.raises(can.CanOperationError):
                server.send(message_of(FRAME))
        assert server.dropped == 10
        connection = server._clients.connected[0]
        assert len(connection._waiting) <= WRITE_BUFFER_BYTES
        assert witness.hear(sent + 9).count(b"< frame 181 ") == sent + 9

        caught_up = stalled.hear(sent - 1)
        lines = CommandStream().feed(caught_up)
        assert len(lines) == sent - 1
        assert {line.split()[3] for line in lines} == {FRAME.data.hex().encode()}
        server.send(message_of(FRAME))
        assert stalled.hear(1).startswith(b"< frame 181 ")
    polled(server, lambda: server.clients == 0)
    assert server.dropped == 10

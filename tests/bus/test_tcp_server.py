"""The embedded TCP server: handshake, connecting and leaving clients, limits."""

import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import can
import pytest
from tcp_client import Client, polled
from wires import PATIENCE_S, Wire, message_of

from hil_emulator.bus import tcp_connection
from hil_emulator.bus.tcp_listener import MAX_CLIENTS
from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.frame import BUS_OFF, Frame

SYNC = message_of(Frame(0x80))
SYNC_LINE = b"< send 80 0  >"


@pytest.fixture
def server() -> Iterator[SocketcandServerBus]:
    """Yield a server on a free port that only the test polls."""
    with SocketcandServerBus(port=0) as server:
        yield server


def test_it_listens_on_this_machine_only_and_no_longer_than_open() -> None:
    """The default address is the loopback; after shutdown the port is closed."""
    with SocketcandServerBus(port=0) as server:
        assert server.host == "127.0.0.1"
        Client(server).socket.close()
    with pytest.raises(ConnectionRefusedError):
        Client(server)


def test_no_frame_shares_a_segment_with_the_handshake(
    server: SocketcandServerBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the last ok of the handshake a client receives no frame until it sends."""
    monkeypatch.setattr(tcp_connection, "HANDSHAKE_PAUSE_S", 3600.0)
    with Client(server).shake_hands() as client:
        for _ in range(10):
            server.send(SYNC)
            assert server.recv(0.001) is None
        assert client.heard() == b""
        client.send(SYNC_LINE)
        assert client.hear(10).count(b"< frame 080 ") == 10


def test_a_client_that_only_listens_is_not_kept_waiting(
    server: SocketcandServerBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames held back arrive after the pause, even if the client never sends."""
    monkeypatch.setattr(tcp_connection, "HANDSHAKE_PAUSE_S", 0.001)
    with Client(server).shake_hands() as client:
        server.send(SYNC)
        assert client.hear(1).startswith(b"< frame 080 ")


def test_a_busy_bus_can_be_joined() -> None:
    """Stock clients complete the handshake while frames are sent at every poll."""
    wire = Wire({"interface": "socketcand_server", "port": 0})

    def busy_poll() -> None:
        wire.bus.send([Frame(0x80)] * 4)
        wire.bus.receive()

    wire.poll = busy_poll  # type: ignore[method-assign]
    try:
        for _ in range(MAX_CLIENTS):
            wire.join()
    finally:
        wire.close()


def test_a_client_of_another_channel_is_refused(server: SocketcandServerBus) -> None:
    """The refusal names the existing channel, and the client may try again."""
    with Client(server) as client:
        client.send(b"< open can7 >")
        assert b"error" in (text := client.hear(2))
        assert b"can0" in text
        client.send(b"< rawmode >")
        assert b"error" in client.hear(1)
        client.send(b"< open can0 >< rawmode >")
        assert client.hear(2) == b"< ok >< ok >"
        assert server.ignored == 2


def test_no_frames_are_exchanged_before_raw_mode(server: SocketcandServerBus) -> None:
    """A client that has not finished the handshake is not on the bus."""
    with Client(server) as client:
        assert client.hear(1) == b"< hi >"
        server.send(SYNC)
        client.send(b"< open can0 >" + SYNC_LINE + b"< echo >")
        assert polled(server, lambda: client.heard().endswith(b"< echo >")) == []
        assert b"frame" not in client.heard()


def test_clients_that_vanish_are_forgotten(server: SocketcandServerBus) -> None:
    """Closed or reset before, during or after the handshake: other clients lose no frames."""
    with Client(server).shake_hands() as witness:
        witness.send(SYNC_LINE)
        for leave in (lambda c: c.socket.close(), Client.reset):
            leave(Client(server))
            halfway = Client(server)
            halfway.send(b"< open can0 >< raw")
            halfway.hear(2)
            leave(halfway)
            talking = Client(server).shake_hands()
            talking.send(SYNC_LINE + b"< send 12")
            leave(talking)
            for _ in range(20):
                server.send(SYNC)
        polled(server, lambda: server.clients == 1)
        assert witness.hear(40).count(b"< frame 080 ") >= 40
        assert server.dropped == 0


def test_frames_of_a_client_that_has_left_are_received(server: SocketcandServerBus) -> None:
    """A client may send and disconnect at once, as a command-line tool does."""
    with Client(server).shake_hands() as client:
        client.send(SYNC_LINE * 3)
    assert polled(server, lambda: server.clients == 0) == [Frame(0x80)] * 3


def test_there_is_room_for_a_stated_number_of_clients(
    server: SocketcandServerBus, caplog: pytest.LogCaptureFixture
) -> None:
    """A client above the limit is refused; after another client leaves it can connect."""
    with ExitStack() as stack:
        clients = [stack.enter_context(Client(server).shake_hands()) for _ in range(MAX_CLIENTS)]
        with Client(server) as late:
            assert b"< error 16 clients are connected already: close one >" in late.hear(1)
            assert late.socket.recv(1) == b""
        assert "16 clients are connected already" in caplog.text
        server.send(SYNC)
        assert all(client.hear(1).startswith(b"< frame") for client in clients)
        clients[0].socket.close()
        polled(server, lambda: server.clients == MAX_CLIENTS - 1)
        stack.enter_context(Client(server).shake_hands())


@pytest.mark.parametrize("beginning", [b"< hi >", b"GET / HTTP/1.1\r\n\r\n", b"?" * 10_000])
def test_a_refused_client_receives_the_reason(
    server: SocketcandServerBus, caplog: pytest.LogCaptureFixture, beginning: bytes
) -> None:
    """It receives an error message of the protocol; each reason is logged once."""
    reason = "no socketcand client: begin with open can0, then rawmode"
    for _ in range(2):
        with Client(server) as client:
            client.send(beginning)
            assert client.hear(2) == f"< hi >< error {reason} >".encode()
            assert client.socket.recv(1) == b""
    assert server.clients == 0
    assert [r.getMessage() for r in caplog.records] == [
        f"CAN port {server.port}: a client is refused: {reason}"
    ]


@pytest.mark.parametrize(
    "message",
    [
        can.Message(arbitration_id=1, is_remote_frame=True),
        can.Message(arbitration_id=1, is_fd=True, data=bytes(12)),
    ],
)
def test_what_the_protocol_cannot_carry_is_refused(
    server: SocketcandServerBus, message: can.Message
) -> None:
    """Remote and FD frames are refused, not converted."""
    with pytest.raises(can.CanOperationError):
        server.send(message)


UNACKNOWLEDGED = 24
"""Where Linux's `struct tcp_info` (linux/tcp.h) has the segments that await acknowledgement."""


@pytest.mark.skipif(not hasattr(socket, "TCP_QUICKACK"), reason="Linux only")
def test_acknowledgements_stay_prompt(server: SocketcandServerBus) -> None:
    """Segments are acknowledged with the answer or at the next poll.

    The kernel switches to delayed acknowledgements in a dialogue. A client with Nagle's algorithm
    waits for the acknowledgement of a small segment before it sends the next: a delay of 40 ms.
    """
    with Client(server).shake_hands() as client:
        for answered in [True, True, False, False] * 5:
            client.send(SYNC_LINE)
            assert server.recv(PATIENCE_S) is not None
            if answered:
                server.send(SYNC)
                client.hear(1)
            server.recv(0)
            info = client.socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 104)
            assert int.from_bytes(info[UNACKNOWLEDGED : UNACKNOWLEDGED + 4], sys.byteorder) == 0


@pytest.mark.parametrize("length", [0, 8])
def test_a_remote_frame_is_no_data_frame(
    server: SocketcandServerBus, caplog: pytest.LogCaptureFixture, length: int
) -> None:
    """A remote frame of a stock client reaches only the owner, as a remote frame; one warning."""
    request = b"< send 185 %d  >" % length
    with Client(server).shake_hands() as asking, Client(server).shake_hands() as other:
        server.send(message_of(Frame(0x185, b"data")))
        asking.send(request * 2 + b"< send 205 0  >")
        arrived: list[Frame] = []
        while len(arrived) < 3:
            arrived += polled(server, iter([False, True]).__next__)
        assert arrived == [Frame(0x185, remote=True)] * 2 + [Frame(0x205)]
        heard = other.hear(2)
        assert [heard.count(text) for text in (b"< frame 185 ", b"< frame 205 ", b">")] == [1, 1, 2]
    with pytest.raises(can.CanOperationError):
        server.send(message_of(Frame(0x705, remote=True)))
    assert [r.getMessage()[:16] for r in caplog.records] == ["remote frame 185"]


def test_an_error_frame_reaches_stock_clients() -> None:
    """Python-can's client receives its class, as from socketcand."""
    wire = Wire({"interface": "socketcand_server", "port": 0})
    try:
        node = wire.join()
        wire.bus.report(BUS_OFF)
        message = None
        while message is None:
            wire.poll()
            message = node.recv(0.01)
        assert message.is_error_frame
        assert message.arbitration_id == BUS_OFF
    finally:
        wire.close()


def test_a_sync_without_a_counter_stays_one(server: SocketcandServerBus) -> None:
    """A SYNC of a client without a counter is received without data."""
    with Client(server).shake_hands() as client:
        server.send(message_of(Frame(0x080, b"\x01")))
        client.send(b"< send 80 0  >")
        arrived: list[Frame] = []
        while not arrived:
            arrived = polled(server, iter([False, True]).__next__)
        assert arrived == [Frame(0x080)]

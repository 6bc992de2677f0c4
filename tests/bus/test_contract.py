"""The contract of `Bus` for every interface, tested with stock python-can and canopen nodes.

The interfaces are memory, TCP and the kernel's vcan.
"""

import shlex
import subprocess
import sys

import pytest
from wires import PATIENCE_S, Wire, message_of

from hil_emulator.frame import Frame

DEVICE_TYPE_REPLY = bytes.fromhex("43 00 10 00 98 01 00 00")  # SDO: 0x1000 holds 0x198

CLASSICAL = [
    *(Frame(0x181 + length, bytes(range(length))) for length in range(9)),
    Frame(0x000),
    Frame(0x7FF, b"\xff" * 8),
    Frame(0x123, b"\x01", extended=True),
    Frame(0x1FFF_FFFF, b"<send>>", extended=True),
]


def test_the_bus_receives_what_a_node_sends(wire: Wire) -> None:
    """Every identifier, length and byte arrives unchanged and in order."""
    node = wire.join()
    for frame in CLASSICAL:
        node.send(message_of(frame))
    assert wire.arrived(len(CLASSICAL)) == CLASSICAL
    assert wire.bus.received == len(CLASSICAL)


def test_every_node_receives_what_the_bus_sends(wire: Wire) -> None:
    """All nodes receive the same frames in the same order, and the bus not its own frames."""
    nodes = [wire.join(), wire.join()]
    wire.bus.send(CLASSICAL)
    for node in nodes:
        assert wire.read(node, len(CLASSICAL)) == CLASSICAL
    assert wire.bus.receive() == []
    assert (wire.bus.sent, wire.bus.dropped) == (len(CLASSICAL), 0)


def test_nodes_receive_each_other_but_not_themselves(wire: Wire) -> None:
    """A frame of a node reaches the bus and every other node, not the sender."""
    first, second = wire.join(), wire.join()
    first.send(message_of(Frame(0x601, b"\x40")))
    assert wire.arrived(1) == [Frame(0x601, b"\x40")]
    assert wire.read(second, 1) == [Frame(0x601, b"\x40")]
    second.send(message_of(Frame(0x602)))
    assert wire.read(first, 1) == [Frame(0x602)]
    assert wire.arrived(1) == [Frame(0x602)]


def test_a_remote_frame_is_carried_or_counted(wire: Wire) -> None:
    """A bus without remote frames drops and counts them; it does not convert them."""
    node = wire.join()
    request, mark = Frame(0x705, remote=True), Frame(0x80)
    wire.bus.send([request, mark])
    got = wire.read(node, 1)
    if got == [request]:
        got = wire.read(node, 1)
        assert (wire.bus.sent, wire.bus.dropped) == (2, 0)
    else:
        assert (wire.bus.sent, wire.bus.dropped) == (1, 1)
    assert got == [mark]


def test_waiting_ends_with_the_first_frame(wire: Wire) -> None:
    """A wait returns whether a frame arrived, and leaves the frame to `receive`."""
    node = wire.join()
    assert not wire.bus.wait(0.0)
    node.send(message_of(Frame(0x80)))
    assert wire.bus.wait(PATIENCE_S)
    assert wire.bus.receive() == [Frame(0x80)]


def test_leaving_twice_is_harmless(wire: Wire) -> None:
    """A bus may be closed twice."""
    wire.bus.close()
    wire.bus.close()


def test_a_canopen_master_in_another_process_finds_the_device(wire: Wire) -> None:
    """The client command scans the bus in another process and prints the node that answers."""
    if wire.bus.client_command.startswith("#"):
        pytest.skip("a bus inside one process")
    command = shlex.split(wire.bus.client_command)
    assert command[0] == "python"
    command[0] = sys.executable
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as master:
        while master.poll() is None:
            wire.bus.wait(0.01)
            asked = any(frame.can_id == 0x625 for frame in wire.bus.receive())
            wire.bus.send([Frame(0x5A5, DEVICE_TYPE_REPLY)] if asked else [])
        assert master.communicate()[0].strip() == "[37]"

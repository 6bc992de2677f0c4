"""Behaviour of a `Bus` on kernel CAN, checked with Linux's can-utils."""

import os
import select
import shutil
import subprocess
from collections.abc import Iterator
from itertools import islice

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.frame import Frame

PATIENCE_S = 120.0  # an emulated processor is slow; a passing test never waits for it

pytestmark = [
    pytest.mark.vcan,
    pytest.mark.skipif(shutil.which("candump") is None, reason="can-utils is not installed"),
]


@pytest.fixture
def bus(socketcan_channel: str) -> Iterator[Bus]:
    """Yield a bus on the kernel's virtual CAN."""
    with Bus({"interface": "socketcan", "channel": socketcan_channel}) as bus:
        yield bus


@pytest.mark.parametrize(
    ("text", "frame"),
    [
        ("601#4000100000000000", Frame(0x601, bytes.fromhex("4000100000000000"))),
        ("080#", Frame(0x80)),
        ("705#R", Frame(0x705, remote=True)),
        ("1F334455#11", Frame(0x1F334455, b"\x11", extended=True)),
    ],
)
def test_cansend_reaches_the_bus(bus: Bus, socketcan_channel: str, text: str, frame: Frame) -> None:
    """Data, empty, remote and extended frames of cansend arrive as what they are."""
    subprocess.run(["cansend", socketcan_channel, text], check=True)
    assert bus.wait(PATIENCE_S)
    assert bus.receive() == [frame]


def test_candump_sees_what_the_bus_sends(bus: Bus, socketcan_channel: str) -> None:
    """Every kind of frame is on the wire as Linux's own tool shows it."""
    frames = {
        "705#00": Frame(0x705, b"\x00"),
        "080#": Frame(0x80),
        "181#R": Frame(0x181, remote=True),
        "1F334455#FF": Frame(0x1F334455, b"\xff", extended=True),
    }
    with subprocess.Popen(["candump", "-L", socketcan_channel], stdout=subprocess.PIPE) as candump:
        assert candump.stdout is not None
        while not select.select([candump.stdout], [], [], 0.1)[0]:
            bus.send([Frame(0x7FF)])  # until candump has begun to listen
        bus.send(frames.values())
        shown = (line.split()[2].decode() for line in candump.stdout)
        assert list(islice((text for text in shown if text != "7FF#"), 4)) == list(frames)
        candump.terminate()
    assert bus.dropped == 0


@pytest.mark.skipif(not os.access("/", os.W_OK), reason="only root takes interfaces down")
@pytest.mark.usefixtures("socketcan_channel")
def test_an_interface_that_goes_down_is_survived() -> None:
    """As with a cable pulled and put back: frames are lost and counted, and the run goes on."""
    link("add", "dev", "vcanflap", "type", "vcan")
    try:
        link("set", "vcanflap", "up")
        with Bus({"interface": "socketcan", "channel": "vcanflap"}) as bus:
            link("set", "vcanflap", "down")
            bus.send([Frame(0x80)])
            assert bus.receive() == []
            assert (bus.sent, bus.dropped) == (0, 1)
            link("set", "vcanflap", "up")
            bus.receive()
            subprocess.run(["cansend", "vcanflap", "080#"], check=True)
            bus.send([Frame(0x80)])
            assert bus.wait(PATIENCE_S)
            assert bus.receive() == [Frame(0x80)]
            assert bus.sent == 1
    finally:
        link("delete", "vcanflap")


def link(*arguments: str) -> None:
    """Change a network interface."""
    subprocess.run(["ip", "link", *arguments], check=True)

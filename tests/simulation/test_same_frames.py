"""The nodes send byte-identical frames on both kinds of virtual bus."""

import struct
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager

import can

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load_rig
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator

TICKS = 600
EVENTS = {
    0: [Frame(0x000, bytes([1, 5]))],
    100: [Frame(0x605, bytes.fromhex("2b 00 10 00 00 00 00 00"))],  # refused: read only
    150: [Frame(0x605, bytes.fromhex("23 00 18 01 85 01 00 80"))],  # TPDO 1 does not exist,
    151: [Frame(0x605, bytes.fromhex("2f 00 1a 00 00 00 00 00"))],  # maps nothing,
    152: [Frame(0x605, bytes.fromhex("2f 00 1a 00 01 00 00 00"))],  # maps one object,
    153: [Frame(0x605, bytes.fromhex("2f 00 18 02 02 00 00 00"))],  # comes with each second SYNC
    154: [Frame(0x605, bytes.fromhex("23 00 18 01 85 01 00 00"))],  # and exists again
    250: [Frame(0x185, remote=True), Frame(0x205, b"\x01")],  # asked; an RPDO that is too short
    350: [Frame(0x000, bytes([2, 5])), Frame(0x7E5, bytes([4, 1, 0, 0, 0, 0, 0, 0]))],
    360: [Frame(0x7E5, bytes([0x5E, 0, 0, 0, 0, 0, 0, 0]))],  # LSS: which node-ID?
    370: [Frame(0x000, bytes([129, 5]))],
    400: [Frame(0x000, bytes([1, 5]))],
}
"""Frames of a master in addition to its set points and SYNC, by tick."""

Listener = Callable[[Emulator], "Own | Stock"]


class Own(AbstractContextManager["Own"]):
    """A peer that receives frames unchanged."""

    def __init__(self, emulator: Emulator) -> None:
        self._bus = Bus(emulator.bus)
        self.send = self._bus.send
        self.receive = self._bus.receive

    def __exit__(self, *error: object) -> None:
        self._bus.close()


class Stock(AbstractContextManager["Stock"]):
    """A peer on python-can's virtual bus."""

    def __init__(self, emulator: Emulator) -> None:
        self._bus = can.Bus(**emulator.bus, ignore_config=True)

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames as messages."""
        for can_id, data, remote, extended in frames:
            self._bus.send(can.Message(0.0, can_id, extended, remote, data=data))

    def receive(self) -> list[Frame]:
        """Return messages as frames."""
        heard = iter(lambda: self._bus.recv(0), None)
        return [
            Frame(m.arbitration_id, bytes(m.data), m.is_remote_frame, m.is_extended_id)
            for m in heard
        ]

    def __exit__(self, *error: object) -> None:
        self._bus.shutdown()


def course(listener: Listener) -> list[tuple[int, Frame]]:
    """Return all frames of the reference machine in a session with faults and a master."""
    sent = []
    with (
        Emulator(load_rig([shipped("configs/hyq_knee.toml")])) as emulator,
        listener(emulator) as party,
    ):
        emulator.tick()
        for tick in range(TICKS):
            if tick == 200:
                stuck = emulator.fault("pressure_a", "stuck")
            if tick == 300:
                stuck.end()
            set_point = struct.pack("<i", 4000 * (tick % 300))
            party.send([*EVENTS.get(tick, ()), Frame(0x205, set_point), Frame(0x080)])
            emulator.tick()
            sent += [(tick, frame) for frame in party.receive()]
    return sent


def test_frames_are_the_same_by_either_bus() -> None:
    """With faults, SYNC, remapping, NMT and LSS; one bus passes frames, the other messages."""
    sent = course(Own)
    assert sent == course(Stock)
    kinds = {frame.can_id for _, frame in sent}
    assert {0x705, 0x185, 0x285, 0x385, 0x485, 0x585, 0x085, 0x7E4} <= kinds

"""Random frames (`--storm`) with identifiers that the device accepts.

The frames do no lasting harm: they store no parameters, change no program or node-ID, and address
no other node on the bus.
"""

import random
from collections.abc import Callable

from hil_emulator.conformance.device import COMMANDS, RESET_COMMUNICATION, RESET_NODE, Device
from hil_emulator.conformance.parameters import COMMANDS as LASTING
from hil_emulator.frame import Frame

SEED = 301
_SDO_COMMANDS = (
    *(0x23, 0x27, 0x2B, 0x2F, 0x22, 0x21, 0x20, 0x00, 0x10, 0x0F, 0x1F, 0x40, 0x60, 0x70, 0x80),
    *(0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6, 0xC1, 0xC5, 0xE0),
)
"""First bytes of downloads, uploads, segments, blocks and aborts (CiA 301 7.2.4.3)."""
_LSS_REQUESTS = (0x40, 0x41, 0x42, 0x43, *range(0x46, 0x4D), 0x51, *range(0x5A, 0x5F))
"""All LSS requests that do not configure or enter configuration state (CiA 305)."""
_MESSAGES = (0x080, 0x100, 0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500)
"""SYNC and EMCY, TIME, PDOs."""
BURST = 8
"""Frames between two pauses in which the device may answer (assumed)."""


class Storm:
    """A source of random frames with a fixed seed.

    Args:
        device: the device under test.

    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._random = random.Random(SEED)
        self._objects = [key for key in device.eds.variables if key[0] not in LASTING]

    def rage(self, count: int) -> None:
        """Send `count` frames, then bring the device to its state after power-on."""
        wire = self._device.wire
        aims: list[Callable[[], Frame]] = [self._sdo, self._message, self._lss, self._nmt]
        for n in range(count):
            frame = self._random.choices(aims, (50, 35, 14, 1))[0]()
            wire.send(
                frame.can_id, frame.data, extended=frame.extended,
                remote=frame.remote and wire.remote_frames,
            )  # fmt: skip
            if n % BURST == 0:
                wire.run(1)
                wire.forget()
        self._device.reset()
        self._device.restore_defaults()

    def _sdo(self) -> Frame:
        """Return a request of any kind to the SDO server."""
        index, subindex = self._random.choice(self._objects)
        command = self._random.choice(_SDO_COMMANDS)
        head = bytes([command]) + index.to_bytes(2, "little") + bytes([subindex])
        return Frame(0x600 + self._device.node_id, head + self._random.randbytes(4))

    def _message(self) -> Frame:
        """Return a message of the predefined connection set, of the node or of the network."""
        can_id = self._random.choice(_MESSAGES) + self._random.choice((0, self._device.node_id))
        return Frame(can_id, self._data(), self._random.random() < 0.2, self._random.random() < 0.1)

    def _lss(self) -> Frame:
        """Return a request of an LSS master that searches for slaves."""
        return Frame(0x7E5, bytes([self._random.choice(_LSS_REQUESTS)]) + self._random.randbytes(7))

    def _nmt(self) -> Frame:
        """Return an NMT command to the node, or an invalid command."""
        command = self._random.choice((*COMMANDS.values(), RESET_NODE, RESET_COMMUNICATION, 3))
        data = bytes([command, self._device.node_id]) + bytes(self._random.choice((0, 0, 1)))
        return Frame(0x000, data)

    def _data(self) -> bytes:
        return self._random.randbytes(self._random.choice((0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8)))

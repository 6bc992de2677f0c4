"""Random frames with identifiers that a device accepts."""

import random
from binascii import crc_hqx
from collections.abc import Callable

from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

NMT, LSS = 0x000, 0x7E5
NMT_COMMANDS = (1, 1, 1, 2, 128, 128, 129, 130)
SDO_COMMANDS = (
    *(0x23, 0x27, 0x2B, 0x2F, 0x22, 0x21, 0x20, 0x40, 0x60, 0x70, 0x80),
    *(0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6, 0xC1, 0xC5),
)
"""First bytes of downloads, uploads, segments, blocks and aborts (CiA 301 7.2.4.3)."""
SIGNATURES = (b"save", b"load", b"zero", b"tara")
LSS_SERVICES = (0x04, 0x11, 0x13, 0x15, 0x17, *range(0x40, 0x44), *range(0x46, 0x4D), 0x51,
                *range(0x5A, 0x5F))  # fmt: skip
LSS_REQUESTS = (b"\x04\x01", b"\x04\x00", b"\x11\x05", b"\x11\x7f", b"\x11\xff", b"\x17\x00")
"""Switch all nodes to configuration and back, configure node-IDs and 0xFF, store."""
NS_PER_MS = 1_000_000


class Fuzzer:
    """A source of random frames, reproducible by the seed.

    Args:
        seed: seed of the random numbers.
        node: the device under test.

    """

    def __init__(self, seed: int, node: Node) -> None:
        self.random = random.Random(seed)
        self._node = node
        self._objects = [(entry.index, entry.subindex) for entry in node.dictionary]
        self._talk: list[bytes] = []  # remaining requests of a transfer with the SDO server
        self._aims: list[tuple[Callable[[], Frame], int]] = [
            (self.sdo, 40),
            (self.pdo, 20),
            (self.lss, 10),
            (self.nmt, 1),
            (self.anything, 29),
        ]

    def batch(self) -> list[Frame]:
        """Return the frames of one tick, 0 to 12."""
        aims, weights = zip(*self._aims, strict=True)
        chosen = self.random.choices(aims, weights, k=self.random.randrange(13))
        return [aim() for aim in chosen]

    def pause_ns(self) -> int:
        """Return the time to the next tick: usually one tick, sometimes longer than time-outs."""
        if self.random.random() < 0.01:
            return self.random.randrange(2_000) * NS_PER_MS
        return NS_PER_MS

    def sdo(self) -> Frame:
        """Return a request of an SDO client: a random request, or the next of a transfer."""
        if self._talk and self.random.random() < 0.8:
            data = bytearray(self._talk.pop(0))
            if self.random.random() < 0.03:
                data[self.random.randrange(8)] = self.random.randrange(256)
            return Frame(0x600 + self._node.node_id, bytes(data))
        if self.random.random() < 0.2:
            self._talk = self._transfer()
        elif self.random.random() < 0.2:
            return Frame(0x600 + self._node.node_id, self._data())
        command = self.random.choice(SDO_COMMANDS)
        return Frame(0x600 + self._node.node_id, self._head(command) + self._value())

    def _head(self, command: int) -> bytes:
        index, subindex = self.random.choice(self._objects)
        if self.random.random() < 0.1:
            index, subindex = 0x1008, 0  # one of the few that come in segments
        return bytes([command]) + index.to_bytes(2, "little") + bytes([subindex])

    def _transfer(self) -> list[bytes]:
        """Return all requests of one transfer, correct but with random object and data."""
        size = self.random.choice((1, 2, 4, 8, 20, 600))
        data = self.random.randbytes(size)
        segments = [data[at : at + 7].ljust(7, b"\0") for at in range(0, size, 7)]
        last, padding = len(segments) - 1, -size % 7
        announced = size.to_bytes(4, "little")
        more = [bytes([command]) + bytes(7) for command in (0x60, 0x70) * 4]
        upload = [self._head(0x40) + bytes(4), *more]
        block_upload = [self._head(0xA4) + bytes([127, 0, 0, 0]), bytes([0xA3]) + bytes(7)]
        block_upload += [bytes([0xA2, 1, 127]) + bytes(5), bytes([0xA1]) + bytes(7)]
        download = [self._head(0x21) + announced]
        block_download = [self._head(0xC6) + announced]
        for n, segment in enumerate(segments):
            end = n == last
            download.append(bytes([n % 2 << 4 | (padding << 1 | 1 if end else 0)]) + segment)
            block_download.append(bytes([n + 1 | (0x80 if end else 0)]) + segment)
        checksum = crc_hqx(data, 0).to_bytes(2, "little")
        block_download.append(bytes([0xC1 | padding << 2]) + checksum + bytes(5))
        return self.random.choice((upload, block_upload, download, block_download))

    def pdo(self) -> Frame:
        """Return an RPDO, a remote frame, or another message that a node may accept."""
        base = self.random.choice((0x080, 0x100, 0x180, 0x200, 0x280, 0x300, 0x380, 0x480, 0x700))
        near = self.random.choice((0, self._node.node_id, self.random.randrange(128)))
        return Frame(base + near, self._data(), self.random.random() < 0.2)

    def lss(self) -> Frame:
        """Return a request of an LSS master; the identity is often right."""
        if self.random.random() < 0.3:
            return Frame(LSS, self.random.choice(LSS_REQUESTS) + bytes(6))
        service = self.random.choice(LSS_SERVICES)
        part = service & 3
        entry = self._node.dictionary.get(0x1018, part + 1)
        right = b"\0\0\0\0" if entry is None else int(entry.value).to_bytes(4, "little")
        number = right if self.random.random() < 0.5 else self._value()
        return Frame(LSS, bytes([service]) + number + self.random.randbytes(3))

    def nmt(self) -> Frame:
        """Return an NMT command, mostly to the node or to all."""
        address = self.random.choice((0, self._node.node_id, self.random.randrange(256)))
        return Frame(NMT, bytes([self.random.choice(NMT_COMMANDS), address]))

    def anything(self) -> Frame:
        """Return any frame except NMT commands, which are rarer."""
        extended = self.random.random() < 0.2
        can_id = self.random.getrandbits(29) if extended else self.random.randrange(1, 0x800)
        return Frame(can_id, self._data(), self.random.random() < 0.2, extended)

    def _data(self) -> bytes:
        return self.random.randbytes(self.random.choice((0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8)))

    def _value(self) -> bytes:
        """Return four bytes: a small number, a command, or any."""
        kind = self.random.random()
        if kind < 0.4:
            return self.random.randrange(300).to_bytes(4, "little")
        return self.random.choice(SIGNATURES) if kind < 0.5 else self.random.randbytes(4)


def healing(node_id: int) -> list[Frame]:
    """Return the frames that recover a node: stop, node-ID by LSS, reset."""
    lss = (b"\x04\x01", bytes([0x11, node_id]), b"\x17", b"\x04\x00")
    requests = [Frame(LSS, request.ljust(8, b"\0")) for request in lss]
    return [Frame(NMT, b"\x02\x00"), *requests, Frame(NMT, b"\x81\x00")]

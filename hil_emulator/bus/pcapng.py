"""Frames in pcapng files, as Wireshark and tcpdump read and write them.

Source: IETF draft-ietf-opsawg-pcapng, and LINKTYPE_CAN_SOCKETCAN of tcpdump.org.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import can

_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_ORDER = 0x1A2B3C4D
_CAN_SOCKETCAN = 227
_RESOLUTION, _FLAGS, _COMMENT, _END = 9, 2, 1, 0
_NANOSECONDS = 9  # of the option `if_tsresol`: 10 to the power of -9
_INBOUND, _OUTBOUND = 1, 2
_EXTENDED, _REMOTE, _ERROR = 0x80000000, 0x40000000, 0x20000000
_LONGEST = 1 << 20  # of a block [B]


class Writer:
    """Writes frames into a pcapng file of one interface.

    Args:
        file: output file.
        remark: comment of the file.

    """

    def __init__(self, file: Path, remark: str = "") -> None:
        self._stream: BinaryIO = file.open("wb")
        self._block(_SECTION, struct.pack("<IHHq", _ORDER, 1, 0, -1) + _comment(remark))
        resolution = struct.pack("<HHB3x", _RESOLUTION, 1, _NANOSECONDS) + bytes(4)
        self._block(_INTERFACE, struct.pack("<HHI", _CAN_SOCKETCAN, 0, 0) + resolution)

    def __enter__(self) -> "Writer":
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def write(self, now_ns: int, m: can.Message) -> None:
        """Write one frame with its time [ns] and direction."""
        identifier = m.arbitration_id | _EXTENDED * m.is_extended_id | _REMOTE * m.is_remote_frame
        packet = struct.pack(">IB3x", identifier, len(m.data)) + bytes(m.data)
        size = len(packet)
        head = struct.pack("<IIIII", 0, now_ns >> 32, now_ns & 0xFFFFFFFF, size, size)
        way = struct.pack("<HHI", _FLAGS, 4, _INBOUND if m.is_rx else _OUTBOUND) + bytes(4)
        self._block(_PACKET, head + packet + bytes(-size % 4) + way)

    def _block(self, kind: int, body: bytes) -> None:
        size = struct.pack("<I", len(body) + 12)
        self._stream.write(struct.pack("<I", kind) + size + body + size)


def _comment(remark: str) -> bytes:
    data = remark.encode()
    return struct.pack("<HH", _COMMENT, len(data)) + data + bytes(-len(data) % 4) + bytes(4)


def messages(file: Path) -> Iterator[can.Message]:
    """Yield the CAN frames of a pcapng file; other packets are left out.

    Raises:
        ValueError: if the file is damaged.

    """
    order, interfaces = "<", list[tuple[int, float]]()
    with file.open("rb") as stream:
        while len(head := stream.read(8)) == 8:
            if head[:4] == b"\x0a\x0d\x0d\x0a":
                order, interfaces = _order(stream), []
            kind, size = struct.unpack(order + "II", head)
            if not 12 <= size <= _LONGEST:
                raise ValueError(f"a block states a size of {size} bytes")
            body = stream.read(size - 8)[:-4]
            if kind == _INTERFACE:
                link = struct.unpack_from(order + "H", body)[0]
                interfaces.append((link, _tick(order, body[8:])))
            elif kind == _PACKET and len(body) >= 20:
                yield from _frame(order, body, interfaces)


def _order(stream: BinaryIO) -> str:
    mark = stream.read(4)
    stream.seek(-4, 1)
    return "<" if struct.unpack("<I", mark)[0] == _ORDER else ">"


def _options(order: str, data: bytes) -> dict[int, bytes]:
    options_by_code, at = {}, 0
    while at + 4 <= len(data):
        code, size = struct.unpack_from(order + "HH", data, at)
        if code == _END:
            break
        options_by_code[code] = data[at + 4 : at + 4 + size]
        at += 4 + size + -size % 4
    return options_by_code


def _tick(order: str, options: bytes) -> float:
    """Return the unit of an interface's time stamps [s]; default: microseconds."""
    power = (_options(order, options).get(_RESOLUTION) or b"\x06")[0]
    return float(2.0 ** -(power & 0x7F) if power & 0x80 else 10.0**-power)


def _frame(order: str, body: bytes, interfaces: list[tuple[int, float]]) -> Iterator[can.Message]:
    number, high, low, size, _ = struct.unpack_from(order + "IIIII", body)
    if number >= len(interfaces):
        raise ValueError(f"a packet names interface {number}, which is not declared")
    link, tick = interfaces[number]
    packet, rest = body[20 : 20 + size], body[20 + size + -size % 4 :]
    if link != _CAN_SOCKETCAN or len(packet) < 8:
        return
    identifier, length = struct.unpack_from(">IB", packet)
    way = struct.unpack(order + "I", _options(order, rest).get(_FLAGS, bytes(4)))[0] & 3
    yield can.Message(
        timestamp=((high << 32) + low) * tick, arbitration_id=identifier & 0x1FFFFFFF,
        is_extended_id=bool(identifier & _EXTENDED), is_remote_frame=bool(identifier & _REMOTE),
        is_error_frame=bool(identifier & _ERROR), data=packet[8 : 8 + length], channel=number,
        is_rx=way != _OUTBOUND, is_fd=length > 8, dlc=length,
    )  # fmt: skip

"""Names in a scenario: messages, frames and objects."""

import re

from hil_emulator.errors import brief
from hil_emulator.faults.connection import MESSAGES
from hil_emulator.faults.objects import place
from hil_emulator.frame import Frame

NMT = {"start": 1, "stop": 2, "pre-operational": 128, "reset": 129, "reset communication": 130}
"""NMT commands (CiA 301 7.2.8.2.1)."""

LARGEST_ID = 0x1FFF_FFFF
"""Largest identifier of 29 bits (ISO 11898-1)."""

_LARGEST_STANDARD = 0x7FF  # of 11 bits (ISO 11898-1)
_BYTES = 8  # of a classical frame (ISO 11898-1)
_MESSAGE = re.compile(r"(node\d{1,3}\.)?(nmt|sync|emcy|sdo|heartbeat|[rt]pdo\d{1,3})", re.ASCII)
_OBJECT = re.compile(r"(?:node(\d{1,3})\.)?(0x.*)", re.ASCII)


def message_of(text: str) -> int | str:
    """Return a COB-ID as a number, the name of a message as it is.

    Raises:
        ValueError: for text that is neither.

    """
    if _MESSAGE.fullmatch(text.lower()):
        return text.lower()
    try:
        return int(text, 16)
    except ValueError:
        raise ValueError(
            f"'{brief(text)}' is not a message; write {', '.join(MESSAGES[:6])} ... tpdo4, that of "
            "one node as node5.tpdo1, or a COB-ID such as 0x185"
        ) from None


def frame_of(line: str) -> Frame:
    """Return the frame of a line: COB-ID and data, in hexadecimal.

    Raises:
        ValueError: for text that is not a classical frame.

    """
    identifier, _, data = line.strip().partition(" ")
    try:
        can_id, content = int(identifier, 16), bytes.fromhex(data)
    except ValueError:
        can_id, content = -1, b""
    if not 0 <= can_id <= LARGEST_ID or len(content) > _BYTES:
        raise ValueError(
            f"'{brief(line)}' is not a frame; write a COB-ID and up to 8 bytes, such as "
            "'0x301 10 27'"
        )
    return Frame(can_id, content, extended=can_id > _LARGEST_STANDARD)


def object_of(text: str) -> tuple[int | None, int, int]:
    """Return node, index and sub-index of an object; None means the first node that has it.

    Raises:
        ValueError: for other text.

    """
    match = _OBJECT.fullmatch(text.lower())
    where = place(match[2]) if match else None
    if match is None or where is None:
        raise ValueError(f"'{brief(text)}' is not an object; write 0x6041, or node7.0x7130:1")
    return (int(match[1]) if match[1] else None), *where

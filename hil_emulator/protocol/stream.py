"""Binary messages of the panel's stream: buckets of signals, and the present values."""

import struct
from typing import NamedTuple

LIVE, PAST = 1, 2
"""Kinds of a message: what has come since the last one, or a time in the past."""


class HeadField(NamedTuple):
    """A field at the beginning of a message.

    Attributes:
        name: of the field.
        code: its type, see `struct`.
        meaning: one line.

    """

    name: str
    code: str
    meaning: str


HEAD_FIELDS = (
    HeadField("kind", "H", f"{LIVE}: live; {PAST}: a time in the past"),
    HeadField("columns", "H", "number of signals of the view"),
    HeadField("count", "I", "number of buckets"),
    HeadField("generation", "I", "that of the `view` request"),
    HeadField("number", "I", "counts the messages of a session; `painted` names it"),
    HeadField("begin", "d", "begin of the first bucket, emulator time [s]"),
    HeadField("width", "d", "duration of a bucket [s]"),
    HeadField("now", "d", "emulator time of the last tick [s]"),
    HeadField("written", "d", "when that tick was written, monotonic clock of the machine [s]"),
)
HEAD = struct.Struct("<" + "".join(field.code for field in HEAD_FIELDS))


def offset(name: str) -> int:
    """Return where a field of the head begins [bytes]."""
    before = [field.name for field in HEAD_FIELDS].index(name)
    return struct.calcsize("<" + "".join(field.code for field in HEAD_FIELDS[:before]))

"""The traffic of the bus for the panel: content, rate and meaning by identifier."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hil_emulator.device.bus_load import frame_bits
from hil_emulator.device.message import Message
from hil_emulator.frame import Frame
from hil_emulator.panel.words import emergency
from hil_emulator.recording.messages import describe, from_json
from hil_emulator.units import factor, read_as

_TRACE = 20_000
"""Number of frames in the trace: some seconds of a full bus (assumed)."""
_WINDOW_NS = 1_000_000_000


@dataclass
class Identifier:
    """Frames of one identifier: how many came, and the last one."""

    frame: Frame
    sent: bool
    count: int = 0
    last_ns: int = 0
    marks: deque[int] = field(default_factory=lambda: deque(maxlen=100))

    @property
    def period(self) -> float | None:
        """Mean time between the last frames [s]; None after a single one."""
        if len(self.marks) < 2:
            return None
        return (self.marks[-1] - self.marks[0]) * 1e-9 / (len(self.marks) - 1)


class Frames:
    """Counts every frame of the bus.

    Args:
        header: of a recording, with the meaning of the frames.
        bit_rate: of the bus [bit/s].

    Attributes:
        rate: frames in the last whole second [1/s].
        load: share of the bit rate that they took, with worst-case stuffing.
        emergencies: by identifier of EMCY, time [s] and words of the last message.

    """

    def __init__(self, header: Mapping[str, Any], bit_rate: float) -> None:
        self.rate, self.load = 0, 0.0
        self.emergencies: dict[int, tuple[float, str]] = {}
        self.identifiers: dict[int, Identifier] = {}
        self._bit_rate = bit_rate
        self._trace: deque[tuple[int, int, bool, Frame]] = deque(maxlen=_TRACE)
        self._count = self._bits = self._frames = 0
        self._until_ns = _WINDOW_NS
        self._services = {m.identifier: m for m in from_json(header.get("services", []))}
        self.learn(header["messages"])

    def learn(self, messages: Iterable[Mapping[str, Any]]) -> None:
        """Set the meaning of PDOs from now on."""
        self.pdos = {m.identifier: m for m in from_json(messages)}

    def take(self, frames: Iterable[tuple[int, bool, Frame]]) -> None:
        """Count frames, oldest first."""
        for now_ns, sent, frame in frames:
            if now_ns >= self._until_ns:
                self._close_window(now_ns)
            self._count += 1
            self._frames += 1
            self._bits += frame_bits(len(frame.data), extended=frame.extended)
            self._trace.append((self._count, now_ns, sent, frame))
            entry = self.identifiers.get(frame.identifier)
            if entry is None:
                entry = self.identifiers[frame.identifier] = Identifier(frame, sent)
            entry.frame, entry.sent, entry.last_ns = frame, sent, now_ns
            entry.count += 1
            entry.marks.append(now_ns)
            if self._is_emergency(frame):
                self.emergencies[frame.can_id] = now_ns * 1e-9, emergency(frame.data)

    def words(self, frame: Frame) -> str:
        """Return a frame in words."""
        if self._is_emergency(frame):
            return f"EMCY node {frame.can_id & 0x7F}  {emergency(frame.data)}"
        return describe(frame, self.pdos)

    def table(self, now: float) -> list[dict[str, Any]]:
        """Return the last frame of each identifier, by identifier, with its age at a time [s]."""
        return [
            {
                "id": _written(s.frame), "count": s.count, "sent": s.sent,
                "period": s.period, "age": now - s.last_ns * 1e-9,
                "data": s.frame.data.hex(" "), "words": self.words(s.frame),
            }
            for _, s in sorted(self.identifiers.items())
        ]  # fmt: skip

    def trace(self, after: int, wanted: str, most: int) -> tuple[int, list[dict[str, Any]]]:
        """Return the newest frames whose line contains a text, and the number of the last frame.

        Args:
            after: number after which frames are searched.
            wanted: the text.
            most: largest number of frames.

        """
        lines: list[dict[str, Any]] = []
        for number, now_ns, sent, frame in reversed(self._trace):
            if number <= after or len(lines) >= most:
                break
            line = {
                "n": number, "time": now_ns * 1e-9, "sent": sent, "id": _written(frame),
                "data": frame.data.hex(" "), "words": self.words(frame),
            }  # fmt: skip
            if not wanted or wanted in f"{line['id']} {line['data']} {line['words']}".lower():
                lines.append(line)
        return self._count, lines[::-1]

    def values(self, message: Message) -> list[dict[str, Any]]:
        """Return the last content of a PDO, in the units that engineers write."""
        stream = self.identifiers.get(message.identifier)
        data = stream.frame.data if stream and len(stream.frame.data) >= message.size else None
        rows = []
        for each in message.fields:
            shown = read_as(each.unit)
            scale = factor(each.unit, shown) if shown != each.unit else 1.0
            value = None if data is None else each.value(data) / scale
            rows.append({"name": each.name, "value": value, "unit": "" if shown == "1" else shown})
        return rows

    def _is_emergency(self, frame: Frame) -> bool:
        message = self._services.get(frame.identifier)
        return message is not None and message.pdo == "EMCY" and len(frame.data) == 8

    def _close_window(self, now_ns: int) -> None:
        self.rate, self.load = self._frames, self._bits / self._bit_rate
        self._frames = self._bits = 0
        self._until_ns = now_ns - now_ns % _WINDOW_NS + _WINDOW_NS


def _written(frame: Frame) -> str:
    return f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"

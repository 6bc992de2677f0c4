"""Expectations of frames, observed as they pass."""

import math
from collections.abc import Callable, Iterable, Sequence

from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.faults.connection import message_ids
from hil_emulator.frame import Frame
from hil_emulator.recording.messages import describe
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.outcome import Span
from hil_emulator.scenario.watch import ROUNDING_S, State

_DATA_BYTES = 8  # of a classical frame

Chosen = Callable[[Frame], bool]


class SeenFrame:
    """A frame that has to come, or must not come, within a time.

    Args:
        e: the expectation.
        chosen: selects its frames.

    """

    def __init__(self, e: Expect, chosen: Chosen) -> None:
        self.state: State = "open"
        self._seen, self._chosen = e.seen, chosen
        ends = [time for time in (e.until, e.by) if time is not None]
        self._start, self._until = e.start - ROUNDING_S, min(ends, default=math.inf) + ROUNDING_S
        self._count, self._first = 0, 0.0
        end = f" to {min(ends):g} s" if ends else ""
        wanted = "seen" if e.seen else "not seen"
        self.text = f"{words(e)} {wanted} from {e.start:g} s{end}"

    @property
    def observed(self) -> str:
        """Number of frames, and the time of the first."""
        return f"{self._count}, first at {self._first:.3f} s" if self._count else "0"

    def tick(self, now: float) -> None:
        """Observe the end of a tick."""
        if now > self._until:
            self.end()

    def frames(self, now: float, frames: Iterable[Frame]) -> None:
        """Observe frames on the bus."""
        if not self._start <= now <= self._until:
            return
        number = sum(map(self._chosen, frames))
        if number and not self._count:
            self._first = now
            self.state = "met" if self._seen else "missed"
        self._count += number

    def end(self) -> None:
        """Conclude: what did not come will not come."""
        if self.state == "open":
            self.state = "missed" if self._seen else "met"

    def span(self, duration: float) -> Span | None:
        """Return None: it is not a signal."""


class AnsweringFrame:
    """A frame that follows each frame of another kind within a time.

    Args:
        e: the expectation.
        chosen: selects its frames.
        asking: selects the frames that it follows.

    """

    def __init__(self, e: Expect, chosen: Chosen, asking: Chosen) -> None:
        assert e.by is not None
        self.state: State = "open"
        self._chosen, self._asking, self._by = chosen, asking, e.by + ROUNDING_S
        self._start, self._until = e.start, math.inf if e.until is None else e.until
        self._asked: float | None = None
        self._answers, self._longest = 0, 0.0
        self.text = f"{words(e)} within {1e3 * e.by:g} ms of each {_name(e.after_each)}"

    @property
    def observed(self) -> str:
        """Number of answers and the longest delay."""
        if self._asked is not None and self.state == "missed":
            return f"no answer to the one at {self._asked:.3f} s"
        if not self._answers:
            return "0"
        return f"{self._answers}, after {1e3 * self._longest:g} ms at most"

    def tick(self, now: float) -> None:
        """Observe the end of a tick."""
        if self._asked is not None and now > self._asked + self._by:
            self.state = "missed"
        elif now > self._until:
            self.end()

    def frames(self, now: float, frames: Iterable[Frame]) -> None:
        """Observe frames on the bus."""
        for frame in frames:
            if self._asked is not None and self._chosen(frame):
                self._answers += 1
                self._longest = max(self._longest, now - self._asked)
                self._asked = None
            if self._asked is None and self._asking(frame) and self._start <= now <= self._until:
                self._asked = now
        if self._longest > self._by:
            self.state = "missed"

    def end(self) -> None:
        """Conclude: without an answer it is missed."""
        if self.state == "open":
            self.state = "met" if self._answers else "missed"

    def span(self, duration: float) -> Span | None:
        """Return None: it is not a signal."""


def words(e: Expect) -> str:
    """Return a frame as text."""
    if e.code is not None:
        return f"{_name(e.frame)} {e.code:04X}"
    content = e.data and f" {e.data}"
    if not isinstance(e.frame, int):
        return f"{_name(e.frame)}{content}"
    data = e.content.ljust(_DATA_BYTES, b"\0") if content else b""
    meaning = describe(Frame(e.frame, data), {}).partition("  ")[0]
    return f"{_name(e.frame)}{content}" + (f" ({meaning})" if meaning else "")


def _name(message: int | str | None) -> str:
    if isinstance(message, int):
        return f"frame {message:03X}"
    node, dot, name = str(message).rpartition(".")
    return f"{node}{dot}{name if name == 'heartbeat' else name.upper()}"


def chosen(message: int | str, nodes: Sequence[Node], content: bytes = b"") -> Chosen:
    """Return what selects the frames of a message that begin with some data.

    Raises:
        UserError: if the rig has no such node, or no such PDO.

    """
    if isinstance(message, int):
        return lambda frame: frame.can_id == message and frame.data.startswith(content)
    of, _, name = message.rpartition(".")
    meant = [node for node in nodes if not of or of == f"node{node.node_id}"]
    fixed = set().union(*(message_ids(node).get(name, ()) for node in meant))
    pdos = [pdo for node in meant for pdo in node.pdos if pdo.name.lower() == name]
    if not (fixed or pdos):
        numbers = ", ".join(str(node.node_id) for node in nodes)
        raise UserError(f"expect: {message}: no node has this message; nodes: {numbers}")

    def selects(frame: Frame) -> bool:
        if not frame.data.startswith(content):
            return False
        if pdos:  # whose identifiers a master may change
            return any(pdo.exists and pdo.identifier == frame.identifier for pdo in pdos)
        return frame.identifier in fixed

    return selects

"""Pre-trigger capture: the ticks before and after a condition."""

from collections import deque

from hil_emulator.model.layout import Vector
from hil_emulator.signals.columns import columns
from hil_emulator.signals.condition import Condition


class Capture:
    """Delays ticks until a condition first holds.

    Args:
        condition: the trigger, over the columns of a recording.
        before_ns: time before the trigger that is kept [ns].
        after_ns: time after it that is recorded [ns].

    Attributes:
        text: the condition as the user wrote it.
        triggered_ns: when the condition first held; None before that.

    """

    def __init__(self, condition: Condition, before_ns: int, after_ns: int) -> None:
        self.text = condition.text
        self.triggered_ns: int | None = None
        self._condition = condition
        self._before_ns = before_ns
        self._after_ns = after_ns
        self._kept: deque[tuple[int, bytes]] = deque()
        self._index = {name: i for i, name in enumerate(columns())}

    def passed(self, now_ns: int, row: Vector, tick: bytes) -> bytes:
        """Return the ticks to record after a new one, as encoded bytes."""
        if self.triggered_ns is not None:
            return tick if now_ns <= self.triggered_ns + self._after_ns else b""
        self._kept.append((now_ns, tick))
        while self._kept[0][0] < now_ns - self._before_ns:
            self._kept.popleft()
        if not self._condition.holds(lambda name: float(row[self._index[name]])):
            return b""
        self.triggered_ns = now_ns
        kept = b"".join(data for _, data in self._kept)
        self._kept.clear()
        return kept

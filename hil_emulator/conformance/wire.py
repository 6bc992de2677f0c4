"""Frames and time of the suite, with the wall clock or stepped time."""

import time
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

from hil_emulator.frame import Frame

NS_PER_MS = 1_000_000
PATIENCE_MS = 5_000
"""Longest wait for an expected frame; only a failing case waits that long (assumed)."""

NO_REMOTE_FRAMES = frozenset({"socketcand", "socketcand_server"})
"""Interfaces of python-can that carry no remote frames."""


class SuitePort(Protocol):
    """The bus: `hil_emulator.bus.bus.Bus`."""

    def receive(self) -> list[Frame]:
        """Return the frames received, without waiting."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames, without waiting."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait for a frame, at most `timeout` [s]."""
        ...


class Time(Protocol):
    """The time of the device."""

    def now_ns(self) -> int:
        """Return the present moment."""
        ...

    def advance(self, port: SuitePort) -> None:
        """Advance the time by a small step, in which the device may send frames."""
        ...


class WallTime:
    """Wall-clock time, for a device outside this process."""

    def now_ns(self) -> int:
        """Return the present moment."""
        return time.monotonic_ns()

    def advance(self, port: SuitePort) -> None:
        """Wait for a frame, at most 2 ms."""
        port.wait(0.002)


class SteppedTime:
    """Time that the suite steps, for a device in this process.

    Args:
        step: executes one tick of the device.
        tick_ns: length of the tick.

    """

    def __init__(self, step: Callable[[], None], tick_ns: int = NS_PER_MS) -> None:
        self._step = step
        self._tick_ns = tick_ns
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the present moment."""
        return self._now_ns

    def advance(self, port: SuitePort) -> None:
        """Execute one tick."""
        self._step()
        self._now_ns += self._tick_ns


class Heard(NamedTuple):
    """A frame and the time of its reception."""

    time_ns: int
    frame: Frame


class Wire:
    """The suite's connection to the bus.

    Args:
        port: sends and receives the frames.
        clock: advances the time.
        remote_frames: whether the bus carries remote frames.

    Attributes:
        log: every frame received since `forget`, oldest first.

    """

    def __init__(self, port: SuitePort, clock: Time, *, remote_frames: bool = True) -> None:
        self.remote_frames = remote_frames
        self.log: list[Heard] = []
        self._port = port
        self._clock = clock

    @property
    def now_ns(self) -> int:
        """The present moment."""
        return self._clock.now_ns()

    def send(
        self, can_id: int, data: bytes = b"", *, remote: bool = False, extended: bool = False
    ) -> None:
        """Send one frame."""
        self._port.send([Frame(can_id, data, remote, extended)])

    def run(self, milliseconds: float) -> float:
        """Record frames for at least `milliseconds`; return the actual duration in ms."""
        begin_ns = now_ns = self._clock.now_ns()
        while now_ns - begin_ns < milliseconds * NS_PER_MS:
            self._take()
            now_ns = self._clock.now_ns()
        return (now_ns - begin_ns) / NS_PER_MS

    def watch(self, can_id: int, at_least: int, milliseconds: float) -> tuple[list[bytes], float]:
        """Record frames for at least `milliseconds`, longer if there are fewer than `at_least`.

        Returns:
            The data of the frames with this identifier, and the actual duration in ms.

        """
        since = len(self.log)
        elapsed_ms = self.run(milliseconds)
        while len(self.heard(can_id, since)) < at_least and elapsed_ms < PATIENCE_MS:
            elapsed_ms += self.run(milliseconds)
        return self.heard(can_id, since), elapsed_ms

    def await_frame(
        self,
        can_id: int,
        wanted: Callable[[bytes], bool] = lambda data: True,
        *,
        since: int = 0,
        patience_ms: float = PATIENCE_MS,
    ) -> bytes | None:
        """Return the data of the first matching frame in the log or received later, else None.

        Args:
            can_id: identifier of the frame.
            wanted: predicate of the frame's data.
            since: position in the log at which the search begins.
            patience_ms: longest waiting time.

        """
        end_ns = self._clock.now_ns() + patience_ms * NS_PER_MS
        while True:
            for _, frame in self.log[since:]:
                if frame.can_id == can_id and not frame.remote and wanted(frame.data):
                    return frame.data
            since = len(self.log)
            if self._clock.now_ns() >= end_ns:
                return None
            self._take()

    def heard(self, can_id: int, since: int = 0) -> list[bytes]:
        """Return the data of all frames in the log with this identifier."""
        return [
            frame.data
            for _, frame in self.log[since:]
            if frame.can_id == can_id and not frame.remote and not frame.extended
        ]

    def forget(self) -> None:
        """Clear the log, and drop the frames that have not been read."""
        self._take()
        self.log.clear()

    def _take(self) -> None:
        self._clock.advance(self._port)
        now_ns = self._clock.now_ns()
        self.log += [Heard(now_ns, frame) for frame in self._port.receive()]

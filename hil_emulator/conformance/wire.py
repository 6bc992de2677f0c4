"""Frames and time as the suite sees them, whether time passes by itself or is stepped."""

import time
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

from hil_emulator.frame import Frame

NS_PER_MS = 1_000_000
PATIENCE_MS = 5_000
"""How long the suite waits for what must come; only a failing case waits that long. Assumed."""

NO_REMOTE_FRAMES = frozenset({"socketcand", "socketcand_server"})
"""Interfaces of python-can that carry no remote frames."""


class Door(Protocol):
    """The bus: `hil_emulator.bus.bus.Bus`."""

    def receive(self) -> list[Frame]:
        """Return what has arrived, never wait."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames, never wait."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait for a frame, at most `timeout` [s]."""
        ...


class Time(Protocol):
    """How time passes for the device."""

    def now_ns(self) -> int:
        """Return the present moment."""
        ...

    def advance(self, door: Door) -> None:
        """Let a moment pass, in which the device may have sent something."""
        ...


class WallTime:
    """Time that passes by itself: the device runs elsewhere."""

    def now_ns(self) -> int:
        """Return the present moment."""
        return time.monotonic_ns()

    def advance(self, door: Door) -> None:
        """Wait for a frame, at most 2 ms."""
        door.wait(0.002)


class SteppedTime:
    """Time that the suite moves: the device is in this process.

    Args:
        step: lets one tick of the device pass.
        tick_ns: how long that is.

    """

    def __init__(self, step: Callable[[], None], tick_ns: int = NS_PER_MS) -> None:
        self._step = step
        self._tick_ns = tick_ns
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the present moment."""
        return self._now_ns

    def advance(self, door: Door) -> None:
        """Let one tick pass."""
        self._step()
        self._now_ns += self._tick_ns


class Heard(NamedTuple):
    """A frame and when the suite got it."""

    time_ns: int
    frame: Frame


class Wire:
    """The suite's place on the bus.

    Args:
        door: carries the frames.
        clock: lets time pass.
        remote_frames: whether the bus carries remote frames.

    Attributes:
        log: every frame heard since `forget`, oldest first.

    """

    def __init__(self, door: Door, clock: Time, *, remote_frames: bool = True) -> None:
        self.remote_frames = remote_frames
        self.log: list[Heard] = []
        self._door = door
        self._clock = clock

    @property
    def now_ns(self) -> int:
        """The present moment."""
        return self._clock.now_ns()

    def send(
        self, can_id: int, data: bytes = b"", *, remote: bool = False, extended: bool = False
    ) -> None:
        """Send one frame."""
        self._door.send([Frame(can_id, data, remote, extended)])

    def run(self, milliseconds: float) -> float:
        """Listen for a while; return how long it was, in ms: no less, maybe more."""
        begin_ns = now_ns = self._clock.now_ns()
        while now_ns - begin_ns < milliseconds * NS_PER_MS:
            self._take()
            now_ns = self._clock.now_ns()
        return (now_ns - begin_ns) / NS_PER_MS

    def watch(self, can_id: int, at_least: int, milliseconds: float) -> tuple[list[bytes], float]:
        """Listen for a while, and longer while there are too few frames, as on a busy machine.

        Returns:
            The data of the frames with this identifier, and how long it was, in ms.

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
        """Return the data of the first such frame, from the log or still to come; else None.

        Args:
            can_id: its identifier.
            wanted: tells by its data whether it is the one.
            since: where in the log to begin.
            patience_ms: how long to wait for it.

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
        """Empty the log, and drop what has arrived but was not looked at."""
        self._take()
        self.log.clear()

    def _take(self) -> None:
        self._clock.advance(self._door)
        now_ns = self._clock.now_ns()
        self.log += [Heard(now_ns, frame) for frame in self._door.receive()]

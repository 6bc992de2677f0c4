"""Changes of frames between a node and the bus."""

from collections.abc import Callable, Sequence
from typing import Protocol

from hil_emulator.faults.strength import Strength
from hil_emulator.frame import Frame


class FrameFault(Protocol):
    """A fault on the connection of one node."""

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Return the frames that reach the node."""
        ...

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Return the frames of the node that reach the bus."""
        ...

    def destroys(self, s: Strength) -> bool:
        """Return whether an error frame destroys the frame that the node sends, on a timed bus."""
        ...

    def acknowledged(self, s: Strength) -> bool:
        """Return whether another node acknowledges the frame being sent, on a timed bus."""
        ...

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Return the frames that are still delayed: those for the node, and those for the bus."""
        ...


class PassThrough:
    """Passes all frames: the base of the other filters."""

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let all frames pass."""
        return list(frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let all frames pass."""
        return list(frames)

    def destroys(self, s: Strength) -> bool:
        """Return False: every frame is sent."""
        return False

    def acknowledged(self, s: Strength) -> bool:
        """Let all frames be acknowledged."""
        return True

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Return no delayed frames."""
        return [], []


class Rewriting(PassThrough):
    """Replaces single frames by others, or removes them.

    Args:
        chosen: selects the frames.
        rewrite: returns the frames that replace a chosen one.

    """

    def __init__(
        self,
        chosen: Callable[[Frame], bool],
        rewrite: Callable[[Strength, Frame], Sequence[Frame]],
    ) -> None:
        self._chosen = chosen
        self._rewrite = rewrite

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Rewrite frames on their way to the node."""
        passed: list[Frame] = []
        for frame in frames:
            passed += self._rewrite(s, frame) if self._chosen(frame) and s.hits() else [frame]
        return passed

    leaving = arriving


class Delayed(PassThrough):
    """Delays frames by a time, in both directions."""

    def __init__(self, chosen: Callable[[Frame], bool], time_ns: int) -> None:
        self._chosen = chosen
        self._time_ns = time_ns
        self._inward: list[tuple[int, Frame]] = []
        self._outward: list[tuple[int, Frame]] = []

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Delay arriving frames; pass those that have waited long enough."""
        return self._through(self._inward, s, frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Delay leaving frames; pass those that have waited long enough."""
        return self._through(self._outward, s, frames)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Return all delayed frames."""
        return [f for _, f in self._inward], [f for _, f in self._outward]

    def _through(
        self, held: list[tuple[int, Frame]], s: Strength, frames: Sequence[Frame]
    ) -> list[Frame]:
        passed = []
        for frame in frames:
            if self._chosen(frame) and s.hits():
                held.append((s.now_ns + self._time_ns, frame))
            else:
                passed.append(frame)
        due = [f for until, f in held if until <= s.now_ns]
        held[:] = [(until, f) for until, f in held if until > s.now_ns]
        return due + passed


class Reordered(PassThrough):
    """Exchanges a frame with the one after it, in this tick or a later one."""

    def __init__(self, chosen: Callable[[Frame], bool]) -> None:
        self._chosen = chosen
        self._inward: list[Frame] = []
        self._outward: list[Frame] = []

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Reorder what comes."""
        return self._through(self._inward, s, frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Reorder what is sent."""
        return self._through(self._outward, s, frames)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Return all delayed frames."""
        return self._inward, self._outward

    def _through(self, held: list[Frame], s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        passed: list[Frame] = []
        for frame in frames:
            if not held and self._chosen(frame) and s.hits():
                held.append(frame)
            else:
                passed += [frame, *held]
                held.clear()
        return passed


class Cut(PassThrough):
    """Stops all frames of the node, and those for it if it is deaf.

    Args:
        deaf: whether the node receives no frames either.

    """

    def __init__(self, deaf: bool) -> None:
        self._deaf = deaf

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Pass arriving frames unless the node is deaf."""
        return [] if self._deaf and s.hits() else list(frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Stop leaving frames."""
        return [] if s.hits() else list(frames)

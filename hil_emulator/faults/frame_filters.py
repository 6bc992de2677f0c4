"""What can happen to frames on the way between a node and the bus."""

from collections.abc import Callable, Sequence
from typing import Protocol

from hil_emulator.faults.strength import Strength
from hil_emulator.frame import Frame


class FrameFault(Protocol):
    """A fault on the connection of one node."""

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Return what reaches the node of the frames that came."""
        ...

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Return what reaches the bus of the frames that the node sends."""
        ...

    def destroys(self, s: Strength) -> bool:
        """Return whether an error frame destroys what the node begins to send, on a timed bus."""
        ...

    def acknowledged(self, s: Strength) -> bool:
        """Return whether another node acknowledges the frame being sent, on a timed bus."""
        ...

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Return the frames still held back: those for the node, and those for the bus."""
        ...


class PassThrough:
    """Lets everything pass; what the others have in common."""

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let all frames pass."""
        return list(frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let all frames pass."""
        return list(frames)

    def destroys(self, s: Strength) -> bool:
        """Let all frames be sent."""
        return False

    def acknowledged(self, s: Strength) -> bool:
        """Let all frames be acknowledged."""
        return True

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Hold nothing back."""
        return [], []


class Rewriting(PassThrough):
    """Puts other frames, or none, in the place of single ones.

    Args:
        chosen: which frames it can befall.
        rewrite: the frames in place of one that it does befall.

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
    """Holds frames back for a time, in both directions."""

    def __init__(self, chosen: Callable[[Frame], bool], time_ns: int) -> None:
        self._chosen = chosen
        self._time_ns = time_ns
        self._inward: list[tuple[int, Frame]] = []
        self._outward: list[tuple[int, Frame]] = []

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Hold back what comes; let go what has waited long enough."""
        return self._through(self._inward, s, frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Hold back what is sent; let go what has waited long enough."""
        return self._through(self._outward, s, frames)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Let everything go."""
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
    """Lets a frame change places with the one after it, in this tick or a later one."""

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
        """Let everything go."""
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
    """Lets no frame of the node out, and none in where it is deaf.

    Args:
        deaf: whether the node hears nothing either.

    """

    def __init__(self, deaf: bool) -> None:
        self._deaf = deaf

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let frames in, or not."""
        return [] if self._deaf and s.hits() else list(frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let no frame out."""
        return [] if s.hits() else list(frames)

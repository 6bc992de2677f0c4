"""Expectations of values, observed tick by tick: each is open until it is met or missed."""

from collections.abc import Callable, Iterable
from typing import Literal, Protocol

from hil_emulator.frame import Frame
from hil_emulator.scenario.outcome import Check, Span

State = Literal["open", "met", "missed"]

ROUNDING_S = 1e-9
"""Difference of times that are equal but for the rounding of their units [s]."""


class Watch(Protocol):
    """An expectation under observation; its times [s] are those of the expectation.

    Attributes:
        text: what is expected.
        state: `met` and `missed` are final.

    """

    text: str
    state: State

    @property
    def observed(self) -> str:
        """What was observed so far."""
        ...

    def tick(self, now: float) -> None:
        """Observe the end of a tick."""
        ...

    def frames(self, now: float, frames: Iterable[Frame]) -> None:
        """Observe frames on the bus."""
        ...

    def end(self) -> None:
        """Conclude at the end of the scenario."""
        ...

    def span(self, duration: float) -> Span | None:
        """Return where a signal is expected in a run of a duration [s]; None for others."""
        ...


class LimitedValue:
    """A value with limits.

    Args:
        name: of the value.
        read: returns its present value.
        written: returns a value as text with its unit.
        limits: lowest and highest expected value.
        signal: the signal that it is; "" if it is not a signal.

    """

    def __init__(
        self, name: str, read: Callable[[], float], written: Callable[[float], str],
        limits: tuple[float, float], signal: str = "",
    ) -> None:  # fmt: skip
        self.read, self.written, self.limits, self.signal = read, written, limits, signal
        low, high = limits
        self.text = f"{name} in {written(low)} ... {written(high)}"

    def rounded(self, value: float) -> str:
        """Return a value that was observed as text."""
        return self.written(float(f"{value:.5g}"))

    def inside(self, value: float) -> bool:
        """Return whether a value is within the limits."""
        return self.limits[0] <= value <= self.limits[1]


class StayingValue:
    """A value that stays within its limits from a time to another one.

    Args:
        value: the value.
        start: beginning of this time [s].
        until: its end [s]; None for the end of the scenario.

    """

    def __init__(self, value: LimitedValue, start: float, until: float | None) -> None:
        end = "the end" if until is None else f"{until:g} s"
        self.text = f"{value.text} from {start:g} s to {end}"
        self.state: State = "open"
        self._value, self._start, self._until = value, start, until
        self._extremes: tuple[float, float] | None = None
        self._outside = ""

    @property
    def observed(self) -> str:
        """The value that left the limits, else the smallest and the largest value."""
        if self._outside:
            return self._outside
        if self._extremes is None:
            return "no sample there"
        return " ... ".join(map(self._value.rounded, self._extremes))

    def tick(self, now: float) -> None:
        """Observe the end of a tick."""
        if now < self._start - ROUNDING_S:
            return
        if self._until is not None and now > self._until + ROUNDING_S:
            self.end()
            return
        value = self._value.read()
        low, high = self._extremes or (value, value)
        self._extremes = min(low, value), max(high, value)
        if not self._value.inside(value):
            self.state, self._outside = "missed", f"{self._value.rounded(value)} at {now:.3f} s"

    def frames(self, now: float, frames: Iterable[Frame]) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Conclude: without a sample it is missed."""
        if self.state == "open":
            self.state = "met" if self._extremes else "missed"

    def span(self, duration: float) -> Span | None:
        """Return its time and its limits."""
        until = duration if self._until is None else self._until
        return _span(self._value, self._start, until)


class ReachingValue:
    """A value that enters its limits by a time, and stays there.

    Args:
        value: the value.
        start: time [s] from which on it is looked at.
        by: latest time [s] at which it enters.
        lasting: how long [s] it stays; None for the rest of the scenario.

    """

    def __init__(self, value: LimitedValue, start: float, by: float, lasting: float | None) -> None:
        self.text = f"{value.text} by {by:g} s"
        if lasting is not None:
            self.text += f" for {lasting:g} s"
        self.state: State = "open"
        self._value, self._start, self._by, self._lasting = value, start, by, lasting
        self._entered: float | None = None
        self._last = 0.0

    @property
    def observed(self) -> str:
        """When it entered its limits, and the last value if it is outside."""
        if self._entered is not None:
            return f"at {self._entered:.3f} s"
        return f"never, last {self._value.rounded(self._last)}"

    def tick(self, now: float) -> None:
        """Observe the end of a tick."""
        if now < self._start - ROUNDING_S:
            return
        self._last = self._value.read()
        if not self._value.inside(self._last):
            self._entered = None
        elif self._entered is None and now <= self._by + ROUNDING_S:
            self._entered = now
        if self._entered is None:
            self.state = "missed" if now > self._by + ROUNDING_S else "open"
        elif self._lasting is not None and now >= self._entered + self._lasting - ROUNDING_S:
            self.state = "met"

    def frames(self, now: float, frames: Iterable[Frame]) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Conclude: a time to stay there that is not over is missed."""
        if self.state == "open":
            self.state = "met" if self._entered is not None and self._lasting is None else "missed"

    def span(self, duration: float) -> Span | None:
        """Return its limits since it entered them, or since it should have."""
        begin = self._by if self._entered is None else self._entered
        until = duration if self._lasting is None else begin + self._lasting
        return _span(self._value, begin, until)


def _span(value: LimitedValue, begin: float, end: float) -> Span | None:
    return Span(begin, end, "expected", value.signal, value.limits) if value.signal else None


def check(watch: Watch, after: str = "") -> Check:
    """Return the present check of an expectation, whose times may count from a step."""
    text = f"{watch.text} after {after}" if after else watch.text
    return Check(text, watch.state == "met", watch.observed, watch.state)

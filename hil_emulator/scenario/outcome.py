"""How a scenario went."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

Curve = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Check:
    """One expectation: what it was, whether it is met, and what was found."""

    text: str
    passed: bool
    found: str


@dataclass(frozen=True)
class Span:
    """What lasted for a while: a fault, or an expectation of a signal.

    Attributes:
        begin: when it began [s].
        end: when it ended [s].
        words: what it was.
        signal: what was expected of; "" for a fault.
        band: lowest and highest value that was expected, SI.

    """

    begin: float
    end: float
    words: str
    signal: str = ""
    band: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Outcome:
    """A scenario that has run.

    Attributes:
        file: its file.
        title: its title.
        checks: its expectations.
        error: why it could not run, "" where it did.
        digest: digest of every frame and signal: the same for the same course of events.
        duration: emulator time [s].
        elapsed: how long it took [s].
        curves: signals over time for pictures, thinned out.
        events: when something was done [s], and what.
        faults: what was broken meanwhile.
        bands: where signals were expected.

    """

    file: str
    title: str
    checks: tuple[Check, ...] = ()
    error: str = ""
    digest: str = ""
    duration: float = 0.0
    elapsed: float = 0.0
    curves: dict[str, Curve] = field(default_factory=dict)
    events: tuple[tuple[float, str], ...] = ()
    faults: tuple[Span, ...] = ()
    bands: tuple[Span, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether it ran and every expectation is met."""
        return not self.error and all(check.passed for check in self.checks)

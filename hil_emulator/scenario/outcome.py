"""Outcome of a scenario."""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

Curve = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Check:
    """An expectation, whether it is met, what was observed, and whether that is final."""

    text: str
    passed: bool
    observed: str
    state: Literal["open", "met", "missed"] = "open"


@dataclass(frozen=True)
class Span:
    """A fault, or the expectation of a signal, with its time.

    Attributes:
        begin: when it began [s].
        end: when it ended [s].
        words: its description.
        signal: the expected signal; "" for a fault.
        band: lowest and highest expected value, SI.

    """

    begin: float
    end: float
    words: str
    signal: str = ""
    band: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Outcome:
    """Outcome of a scenario.

    Attributes:
        file: its file.
        title: its title.
        checks: its expectations.
        error: why it could not run; "" if it ran.
        digest: of all frames and signals; the same for the same course of events.
        duration: emulator time [s].
        elapsed: computing time [s].
        curves: signals over time for pictures, thinned out.
        events: time [s] and description of each action.
        faults: faults with their times.
        bands: where signals were expected.
        rotary: whether the axis is rotary, so that lengths are angles.

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
    rotary: bool = False

    @property
    def passed(self) -> bool:
        """Whether it ran and every expectation is met."""
        return not self.error and all(check.passed for check in self.checks)

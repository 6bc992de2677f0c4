"""One injected fault: begin, strength and end."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from random import Random

from hil_emulator.faults.fault import Fault
from hil_emulator.faults.strength import Strength


class Running(AbstractContextManager["Running"]):
    """An injected fault; ends with `end()`, its block, or its duration.

    Attributes:
        fault: the fault.
        number: counts the faults of a rig.
        began_ns: when it began; None before that.
        ended: whether it is over.
        value: returns the present value of a signal, for its condition.
        others: the same fault in the other rigs that it acts on; they end with it.

    """

    def __init__(
        self, fault: Fault, number: int, now_ns: int, value: Callable[[str], float],
        on_end: Callable[["Running"], None],
    ) -> None:  # fmt: skip
        self.fault = fault
        self.number = number
        self.value = value
        self.others: Sequence[Running] = ()
        self.began_ns: int | None = None
        self.ended = False
        self.earliest_ns = now_ns + fault.start_ns
        self.random = Random(fault.seed)
        self._on_end = on_end

    def strength(self, now_ns: int) -> Strength:
        """Return its present strength."""
        assert self.began_ns is not None
        elapsed, fault = now_ns - self.began_ns, self.fault
        ramp = min(1.0, elapsed / fault.ramp_ns) if fault.ramp_ns else 1.0
        return Strength(now_ns, elapsed, ramp, self.random, fault.probability)

    def end(self) -> None:
        """End it; repeated calls have no effect."""
        if not self.ended:
            self.ended = True
            self._on_end(self)
            for other in self.others:
                other.end()

    def __exit__(self, *error: object) -> None:
        self.end()

"""What a bench test is: a procedure that gives a result, and a picture of it."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.stand import Bench


@dataclass(frozen=True)
class Procedure:
    """A bench test.

    Attributes:
        name: what the command line calls it.
        title: one line.
        run: performs it.
        draw: draws its result into an empty figure.

    """

    name: str
    title: str
    run: Callable[[Bench], BenchResult]
    draw: Callable[[BenchResult, Figure], None]

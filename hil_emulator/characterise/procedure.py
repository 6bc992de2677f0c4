"""The declaration of a bench test: its procedure and its picture."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from matplotlib.figure import Figure

from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.stand import Bench


class Chapter(IntEnum):
    """Subject of a bench test, in the order of the page."""

    VALVE = 1
    OIL = 2
    CYLINDER = 3
    DYNAMICS = 4
    PUMP = 5
    SENSORS = 6


@dataclass(frozen=True)
class Procedure:
    """A bench test.

    Attributes:
        name: name on the command line.
        title: one line.
        run: performs the test.
        draw: draws the result into an empty figure.
        chapter: chapter of the page.
        place: position in the chapter, from 1.

    """

    name: str
    title: str
    run: Callable[[Bench], BenchResult]
    draw: Callable[[BenchResult, Figure], None]
    chapter: Chapter
    place: int

"""What a bench test is: a procedure that gives a result, and a picture of it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from matplotlib.figure import Figure

from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.stand import Bench


class Chapter(IntEnum):
    """What a bench test is about, in the order of the page."""

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
        name: what the command line calls it.
        title: one line.
        run: performs it.
        draw: draws its result into an empty figure.
        chapter: of the page.
        place: in the chapter, from 1.

    """

    name: str
    title: str
    run: Callable[[Bench], BenchResult]
    draw: Callable[[BenchResult, Figure], None]
    chapter: Chapter
    place: int

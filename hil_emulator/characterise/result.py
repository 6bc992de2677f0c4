"""What a bench test finds: a table, and how it compares with what it should reproduce."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Series = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        unit: as engineers write it, "" where there is none.
        values: shape (rows,).

    """

    unit: str
    values: Series


def column(unit: str, values: ArrayLike) -> Column:
    """Return a column from anything that converts to numbers."""
    return Column(unit, np.atleast_1d(np.asarray(values, dtype=np.float64)))


class Agreement(StrEnum):
    """What agreement says, the strongest first; the value is the heading of the group.

    Where more than one holds the weakest is chosen: a number of a document that is a parameter of
    the machine is only found again.
    """

    DOCUMENT = "the document's figure"
    DERIVED = "two derivations agree"
    CONFIGURED = "configured, found again"

    @property
    def meaning(self) -> str:
        """One line for the reader of a group."""
        return _MEANINGS[self]


_MEANINGS = {
    Agreement.DOCUMENT:
        "A number that stands in a document and is no parameter of the machine, whose parameters "
        "were chosen for it.",
    Agreement.DERIVED:
        "A number that follows from the machine's parameters on another way than through the "
        "emulator: a closed form, or the linear model.",
    Agreement.CONFIGURED:
        "A parameter or a law that the machine was given, seen through its sensors.",
}  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """One number of the emulator beside the number it should reproduce.

    Attributes:
        quantity: what it is.
        unit: of both numbers.
        expected: the document's value, or what its formula gives for the configured machine.
        source: where `expected` comes from.
        measured: what the test found.
        tolerance: largest relative difference that counts as agreement.
        kind: what agreement says.
        rests_on: defaults one spread of which moves the expected number by more than 10 %.

    """

    quantity: str
    unit: str
    expected: float
    source: str
    measured: float
    tolerance: float
    kind: Agreement
    rests_on: tuple[str, ...] = ()

    @property
    def difference(self) -> float:
        """Difference relative to the expected value; nan where that is zero."""
        return self.measured / self.expected - 1.0 if self.expected else math.nan

    @property
    def agrees(self) -> bool:
        """Whether the difference lies within the tolerance."""
        return abs(self.difference) <= self.tolerance


@dataclass(frozen=True)
class DocumentFigure:
    """A figure of a document that a picture shows too, as far as its numbers are known.

    Attributes:
        name: such as "S1 Fig. 3.8".
        states: what the document says.
        drawn: what the picture takes from it.

    """

    name: str
    states: str
    drawn: str


@dataclass(frozen=True)
class BenchResult:
    """What one bench test found.

    Attributes:
        name: the test's name.
        title: one line above the picture.
        procedure: how it was done, two or three sentences.
        columns: the table, by column name; all of the same length.
        comparisons: what the summary shows.
        notes: what a reader of the numbers has to know.
        figures: those of the documents that the picture shows too; of another machine than the
            documents' none, and the picture then draws nothing of them.
        again: returns the comparisons for the same bench with another parameter, of the same
            measurement; None where no expected number depends on a default.
        inapplicable: quantities that this machine does not have, each with the reason.

    """

    name: str
    title: str
    procedure: str
    columns: Mapping[str, Column]
    comparisons: Sequence[Comparison]
    notes: Sequence[str] = field(default=())
    figures: Sequence[DocumentFigure] = field(default=())
    inapplicable: Sequence[str] = field(default=())
    again: Callable[[Any], Sequence[Comparison]] | None = None

    def __getitem__(self, name: str) -> Series:
        """Return the values of a column."""
        return self.columns[name].values

    def where(self, name: str, value: float, wanted: str) -> Series:
        """Return one column's values in the rows where another one has a value."""
        return np.asarray(self[wanted][self[name] == value])


@dataclass(frozen=True)
class Group:
    """The comparisons of one kind, each with the name of its test."""

    kind: Agreement
    rows: Sequence[tuple[str, Comparison]]

    @property
    def summary(self) -> str:
        """Heading and count."""
        agreeing = sum(c.agrees for _, c in self.rows)
        return f"{self.kind.value}: {agreeing} of {len(self.rows)}"


def grouped(results: Iterable[BenchResult]) -> list[Group]:
    """Return every comparison by its kind; kinds without any are left out."""
    rows = [(result.name, c) for result in results for c in result.comparisons]
    groups = [Group(kind, [row for row in rows if row[1].kind is kind]) for kind in Agreement]
    return [group for group in groups if group.rows]

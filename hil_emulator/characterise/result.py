"""What a bench test finds: a table, and how it compares with what it should reproduce."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

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

    """

    quantity: str
    unit: str
    expected: float
    source: str
    measured: float
    tolerance: float

    @property
    def difference(self) -> float:
        """Difference relative to the expected value; nan where that is zero."""
        return self.measured / self.expected - 1.0 if self.expected else math.nan

    @property
    def agrees(self) -> bool:
        """Whether the difference lies within the tolerance."""
        return abs(self.difference) <= self.tolerance


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

    """

    name: str
    title: str
    procedure: str
    columns: Mapping[str, Column]
    comparisons: Sequence[Comparison]
    notes: Sequence[str] = field(default=())

    def __getitem__(self, name: str) -> Series:
        """Return the values of a column."""
        return self.columns[name].values

    def where(self, name: str, value: float, wanted: str) -> Series:
        """Return one column's values in the rows where another one has a value."""
        return np.asarray(self[wanted][self[name] == value])

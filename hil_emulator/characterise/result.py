"""The result of a bench test: a table, and comparisons with expected values."""

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
        unit: as engineers write it, "" for a column without a unit.
        values: shape (rows,).

    """

    unit: str
    values: Series


def column(unit: str, values: ArrayLike) -> Column:
    """Return a column from anything that converts to numbers."""
    return Column(unit, np.atleast_1d(np.asarray(values, dtype=np.float64)))


class Agreement(StrEnum):
    """Meaning of an agreement, the strongest first; the value is the heading of the group.

    If more than one applies the weakest is chosen: a number of a document that is a parameter of
    the machine counts as configured.
    """

    DOCUMENT = "the document's figure"
    DERIVED = "two derivations agree"
    CONFIGURED = "configured, found again"

    @property
    def meaning(self) -> str:
        """Explanation of the group in one line."""
        return _MEANINGS[self]


_MEANINGS = {
    Agreement.DOCUMENT:
        "A number of a document that is not a parameter of the machine; the machine's parameters "
        "were chosen to reproduce it.",
    Agreement.DERIVED:
        "A number that follows from the machine's parameters without the emulator: by a closed "
        "form, or by the linear model.",
    Agreement.CONFIGURED:
        "A parameter or a law of the configuration, measured through the sensors.",
}  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """A number of the emulator and its expected value.

    Attributes:
        quantity: name of the quantity.
        unit: of both numbers.
        expected: the document's value, or that of its formula for the configured machine.
        source: origin of `expected`.
        measured: result of the test.
        tolerance: largest relative difference that counts as agreement.
        kind: meaning of the agreement.
        rests_on: defaults whose spread changes the expected number by more than 10 %.

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
    """A figure of a document that a picture includes, as far as the document states numbers.

    Attributes:
        name: such as "S1 Fig. 3.8".
        states: statement of the document.
        drawn: part of the figure that the picture shows.

    """

    name: str
    states: str
    drawn: str


@dataclass(frozen=True)
class BenchResult:
    """The result of one bench test.

    Attributes:
        name: the test's name.
        title: one line above the picture.
        procedure: description of the test, two or three sentences.
        columns: the table, by column name; all of the same length.
        comparisons: rows of the summary.
        notes: remarks on the numbers.
        figures: figures of the documents in the picture; empty unless the machine is that of the
            documents.
        again: returns the comparisons of the same measurement for a bench with another parameter;
            None if no expected number depends on a default.
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
        """Return the values of column `wanted` in the rows where column `name` has a value."""
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
    """Return every comparison by its kind; kinds without comparisons are left out."""
    rows = [(result.name, c) for result in results for c in result.comparisons]
    groups = [Group(kind, [row for row in rows if row[1].kind is kind]) for kind in Agreement]
    return [group for group in groups if group.rows]

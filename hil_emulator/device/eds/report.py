"""Remarks on deviations from CiA 306 in a file, and refusals of files that cannot be used.

Files of makers break CiA 306 in many small ways. A harmless deviation with one possible meaning is
accepted with a remark; any other is refused with file, section and key.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hil_emulator.errors import UserError

SHOWN_PLACES = 4
"""Places that a line of the report names; it counts the others."""


KEPT = 10_000
"""Remarks that are kept; a file with more is not an EDS or repeats one deviation (assumed)."""


class Remark(NamedTuple):
    """One deviation: its section, its key ("" for the whole section), and how it was read."""

    section: str
    key: str
    text: str


class Report:
    """The first remarks on one file, in the order of the file.

    Args:
        source: the file, for messages.

    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.remarks: list[Remark] = []

    def note(self, section: str, key: str, text: str) -> None:
        """Add a remark on a harmless deviation."""
        if len(self.remarks) < KEPT:
            self.remarks.append(Remark(section, key, text))

    def refusal(self, section: str, key: str, text: str) -> UserError:
        """Return the error for a file that cannot be used, with place and reason."""
        place = f" [{section}]" if section else ""
        return UserError(f"{self.source}{place}{' ' if key else ''}{key}: {text}")


def lines(remarks: Sequence[Remark]) -> Iterator[str]:
    """Yield the report, one line for all places with the same deviation."""
    odd: dict[tuple[str, str], list[str]] = {}
    for remark in remarks:
        odd.setdefault((remark.key, remark.text), []).append(f"[{remark.section}]")
    for (key, text), places in odd.items():
        shown = " ".join(places[:SHOWN_PLACES])
        more = f" and {len(places) - SHOWN_PLACES} more" if len(places) > SHOWN_PLACES else ""
        yield f"{shown}{more}{' ' if key else ''}{key}: {text}"

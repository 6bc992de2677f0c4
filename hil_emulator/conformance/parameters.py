"""Objects that a master may write at any time, and values beyond their limits."""

from collections.abc import Iterator

from hil_emulator.conformance.expectation import Expectation, type_range
from hil_emulator.device.entry import Entry

COMMUNICATION, APPLICATION = range(0x1000, 0x2000), range(0x2000, 0x10000)
COMMANDS = frozenset({0x1003, 0x1010, 0x1011, 0x1020, 0x1F50, 0x1F51})
"""Objects whose write is a command: history, storing, program download and control."""
_MAPPINGS = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))
_PDOS = (range(0x1400, 0x1600), range(0x1800, 0x1A00))
_LOCKED_WHILE_VALID = (3, 6)
"""Inhibit time and SYNC start value (CiA 301 7.5.2.37)."""


def free(variable: Entry) -> bool:
    """Return whether a master may write a variable at any time and the write is not a command."""
    index = variable.index
    if index in COMMANDS or any(index in indices for indices in _MAPPINGS):
        return False
    pdo = any(index in indices for indices in _PDOS)
    return not (pdo and variable.subindex in _LOCKED_WHILE_VALID)


def free_parameters(eds: Expectation, within: range = range(0x1000, 0x10000)) -> list[Entry]:
    """Return all readable and writable parameters of a range that are free."""
    return [
        variable
        for variable in eds.find({"rw", "rwr", "rww"})
        if variable.index in within and free(variable)
    ]


def beyond(eds: Expectation, *, above: bool) -> Iterator[tuple[Entry, int]]:
    """Yield free parameters with a value above, or below, their limits.

    Limits are those of the EDS, and 0 and 2 to 240 for the SYNC counter overflow (CiA 301
    7.5.2.22).
    """
    for variable in free_parameters(eds):
        limits = type_range(variable)
        limit = variable.high if above else variable.low
        if limits is None or limit is None:
            continue
        wrong = int(limit) + 1 if above else int(limit) - 1
        if limits[0] <= wrong <= limits[1]:
            yield variable, wrong
    overflow = eds.variables.get((0x1019, 0))
    if overflow is not None and overflow.writable:
        yield overflow, 241 if above else 1


def numbers(eds: Expectation, *sizes: int) -> list[Entry]:
    """Return the free parameters that are integers of these sizes in bytes."""
    return [
        variable
        for variable in free_parameters(eds)
        if type_range(variable) is not None and variable.type.size in sizes
    ]


def strings(eds: Expectation) -> list[Entry]:
    """Return the readable variables too long for one frame, by type."""
    return [
        variable
        for variable in eds.variables.values()
        if variable.readable and (not variable.type.numeric or variable.type.size > 4)
    ]

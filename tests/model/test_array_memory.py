"""Memory as records and arrays, in machine code as in numpy."""

import numba
import numpy as np

from hil_emulator.model.array_memory import view

PAIR = np.dtype([("flow", np.float64), ("pressures", np.float64, (3,))])


@numba.njit
def swapped(flat: np.ndarray) -> int:
    """Move each flow into its first pressure; return the number of records."""
    records = view(flat, PAIR)
    for i in range(len(records)):
        records[i].pressures[0] = records[i].flow
    return len(records)


def test_records_are_the_memory_itself() -> None:
    """What is written into a record is in the array, as numpy's own view has it."""
    flat = np.arange(8.0)
    assert swapped(flat) == 2
    np.testing.assert_array_equal(flat, [0.0, 0.0, 2.0, 3.0, 4.0, 4.0, 6.0, 7.0])
    np.testing.assert_array_equal(flat.view(PAIR)["pressures"][:, 0], [0.0, 4.0])


def test_the_memory_stays_as_long_as_its_records() -> None:
    """An array without another reference is not freed while records of it are read."""

    @numba.njit
    def total(size: int) -> float:
        records = view(np.ones(4 * size), PAIR)
        other = np.zeros(4 * size)
        sum_of_flows = other[0]
        for i in range(len(records)):
            sum_of_flows += records[i].flow
        return sum_of_flows

    assert [total(n) for n in (1, 1000)] == [1.0, 1000.0]

"""The sensors' readings of one tick."""

from typing import NamedTuple


class Measured(NamedTuple):
    """One sample of every sensor channel.

    Attributes:
        values: one reading per channel in SI, in the order of the channel names.
        overrange: per channel -1 below the transducer's range, 0 inside, +1 above.

    """

    values: list[float]
    overrange: list[int]

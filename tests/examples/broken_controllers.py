"""Controllers with one deliberate mistake each: the tests of this folder have to find it."""

import can
from controller import Controller


class DeafToEmergencies(Controller):
    """Does not read emergency messages."""

    def on_emergency(self, data: bytes) -> None:
        """Do nothing."""


class Trusting(Controller):
    """Believes that the node is alive and the rod moves."""

    def supervise(self) -> None:
        """Check nothing."""


class Backwards(Controller):
    """Has the sign of its gain wrong."""

    GAIN = -Controller.GAIN


class Careless(Controller):
    """Takes whatever PDO comes for a position."""

    def on_position(self, data: bytes) -> None:
        """Fill up what is missing."""
        super().on_position(data.ljust(6, b"\0"))


KINDS: dict[str, type[Controller]] = {
    "sound": Controller,
    "deaf": DeafToEmergencies,
    "trusting": Trusting,
    "backwards": Backwards,
    "careless": Careless,
}


def make(kind: str, bus: can.BusABC, node: int) -> Controller:
    """Return a controller by name."""
    return KINDS[kind](bus, node)

"""A master by hand: frames that a person sends are on the bus and reach the nodes."""

from collections.abc import Iterable

from hil_emulator.frame import Frame
from hil_emulator.simulation.timed_can_port import CanPort


class MasterByHand:
    """Stands between a bus and its rig, and adds what a person sends.

    Args:
        bus: the bus.

    """

    def __init__(self, bus: CanPort) -> None:
        self._bus = bus
        self._said: list[Frame] = []
        self.send = bus.send
        self.report = bus.report

    def say(self, frames: Iterable[Frame]) -> None:
        """Send frames; the nodes hear them in the next tick."""
        given = list(frames)
        self._bus.send(given)
        self._said += given

    def receive(self) -> list[Frame]:
        """Return what has arrived, and what was said by hand."""
        said, self._said = self._said, []
        return said + self._bus.receive()

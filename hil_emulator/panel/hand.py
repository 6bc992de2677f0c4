"""CANopen master operated by hand: frames of an operator reach the bus and the nodes."""

from collections.abc import Iterable

from hil_emulator.frame import Frame
from hil_emulator.simulation.timed_can_port import CanPort


class MasterByHand:
    """Adds an operator's frames to the traffic between a bus and its rig.

    Args:
        bus: the bus.

    """

    def __init__(self, bus: CanPort) -> None:
        self._bus = bus
        self._said: list[Frame] = []
        self.send = bus.send
        self.report = bus.report

    def send_by_hand(self, frames: Iterable[Frame]) -> None:
        """Send frames; the nodes receive them in the next tick."""
        given = list(frames)
        self._bus.send(given)
        self._said += given

    def receive(self) -> list[Frame]:
        """Return the arrived frames, and those sent by hand."""
        sent, self._said = self._said, []
        return sent + self._bus.receive()

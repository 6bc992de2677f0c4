"""A stock `canopen` master whose bus is a `Node` in simulated time: no thread, no clock.

`canopen.Network` names `send_message` and `notify` as its override points. Sending a frame executes
one tick of the node, so an SDO request is answered before the stock client reads the answer.
"""

from collections.abc import Sequence

import canopen

from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

NS_PER_MS = 1_000_000


class SimulatedNetwork(canopen.Network):
    """Carries frames between a stock master and one node, one tick per millisecond.

    Attributes:
        node: the device under test.
        measured: readings of its sensors from the next tick on.
        now_ns: time of the next tick.
        log: every frame the device sent, with its time.
        commands: the commands in force since the last tick.

    """

    def __init__(self, node: Node, measured: Measured) -> None:
        super().__init__()
        self.node = node
        self.measured = measured
        self.now_ns = 0
        self.log: list[tuple[int, Frame]] = []
        self.commands: dict[str, float] = {}

    def send_message(self, can_id: int, data: Sequence[int] | bytes, remote: bool = False) -> None:
        """Send one frame of the master and execute a tick."""
        self.tick(Frame(can_id, bytes(data or b""), remote))

    def disconnect(self) -> None:
        """Do nothing."""

    def tick(self, *frames: Frame, period_ns: int = NS_PER_MS) -> list[Frame]:
        """Execute one tick in which the device receives `frames`; return the frames it sends."""
        self.commands = dict(self.node.receive(self.now_ns, frames))
        answers = self.node.publish(self.now_ns, Measured(*self.measured))
        self.log += [(self.now_ns, frame) for frame in answers]
        stamp = self.now_ns * 1e-9
        self.now_ns += period_ns
        for frame in answers:
            if not frame.remote:
                self.notify(frame.can_id, bytearray(frame.data), stamp)
        return answers

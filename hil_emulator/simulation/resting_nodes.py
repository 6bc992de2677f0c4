"""The nodes of a rig that rest: the sensors pack what they send.

See `device.rest` for what resting is, and `model.digits` for the packing, which is machine code.
"""

from collections.abc import Callable, Sequence

from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.device.repetition import Word
from hil_emulator.model.plant import Sensors


class RestingNodes:
    """Lets nodes rest, and lays out the record out of which they then send.

    Args:
        nodes: the rig's nodes.
        sensors: what samples for them.
        sampled: returns the last sample.

    """

    def __init__(
        self, nodes: Sequence[Node], sensors: Sensors, sampled: Callable[[], Measured]
    ) -> None:
        self._sensors = sensors
        self._sampled = sampled
        self._words: dict[Node, Sequence[Word]] = {node: () for node in nodes}

    def settle(self) -> None:
        """Let those rest whose services have nothing to do until something happens."""
        for node, known in self._words.items():
            if node.resting:
                continue
            words = node.rests(self._sensors.count)
            if words is None:
                continue
            if words is not known:
                self._words[node] = words
                self._lay_out()
            node.begin_rest(self._sampled)

    def attend(self, *, renewed: bool = False) -> None:
        """Wake the services of all nodes: see `Node.attend`."""
        for node in self._words:
            node.attend(renewed=renewed)

    def _lay_out(self) -> None:
        """Give each node its place in the record, one after the other."""
        laid: list[tuple[float, ...]] = []
        place = 0
        for node, words in self._words.items():
            node.place(place)
            laid += [(*word.shown, place + word.start, word.size) for word in words]
            place = max((int(first + size) for *_, first, size in laid), default=0)
        self._sensors.lay_out(laid, place)

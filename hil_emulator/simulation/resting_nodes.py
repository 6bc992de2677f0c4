"""The nodes of a rig that rest: the sensors pack what they send.

See `device.rest` for what resting is, and `model.digits` for the packing, which is machine code.
"""

from collections.abc import Callable, Sequence

from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.model.sampling import Sensors


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
        self._packed: dict[Node, PackedTpdos | None] = dict.fromkeys(
            node for node in nodes if node.may_rest
        )

    def settle(self) -> None:
        """Let those rest whose services have nothing to do until something happens."""
        for node, known in self._packed.items():
            if node.rest.on:
                continue
            found = node.packed(self._sensors.count)
            if found is None:
                continue
            if found is not known:
                self._packed[node] = found
                self._lay_out()
            node.begin_rest(found, self._sampled)

    def attend(self, *, renewed: bool = False) -> None:
        """Wake the services of all nodes: see `Node.attend`."""
        for node in self._packed:
            node.attend(renewed=renewed)

    def _lay_out(self) -> None:
        """Give each its place in the record, one after the other."""
        laid: list[tuple[float, ...]] = []
        place = 0
        for packed in filter(None, self._packed.values()):
            packed.move_to(place)
            laid += [(*w.shown, place + w.start, w.size) for w in packed.words]
            place += packed.size
        self._sensors.lay_out(laid, place)

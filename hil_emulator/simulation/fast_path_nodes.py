"""Conditions of the fast path.

At the end of a tick each node enters its fast path if all of these conditions hold:

1. No fault is active or scheduled: a fault changes samples and frames between services and bus.
2. Every channel is inside its measuring range: leaving the range is checked and reported each tick.
3. The node is OPERATIONAL: in other states it sends no TPDO and takes no set point.
4. No object is distorted: a distortion overwrites its object after each sample.
5. Every service has declared a later time before which it has nothing to do
   (`device/fast_path.py`, which also lists what ends the fast path).
6. The TPDOs carry only integers of up to 32 bits, on whole bytes, that show a channel, the
   sample counter or the sample time: the machine code can pack these (`model/digits.py`).

A rig executes whole ticks in `fast_tick` under these additional conditions:

7. the node on the fast path is its only one, without partners: no frames are carried between them;
8. its bus has no modelled timing: no frame waits for the bus;
9. the cylinder has ends, or the rod has left its stroke: otherwise each tick checks the stroke.
"""

from collections.abc import Callable

from hil_emulator.device.nmt import State
from hil_emulator.device.node import Node
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.simulation.fast_tick import TickingRig, fast_tick


class FastPathNodes:
    """The nodes of a rig, and the record out of which those on the fast path send.

    Args:
        rig: the rig.
        steps: integration steps per tick.

    Attributes:
        tick: executes a tick of the rig; returns False, without effect, if it cannot.

    """

    def __init__(self, rig: TickingRig, steps: int) -> None:
        self._rig = rig
        self._steps = steps
        self._has_ends = rig.plant.has_ends
        self._packed: dict[Node, PackedTpdos] = {}
        self.tick: Callable[[], bool] = lambda: False

    def enter(self) -> None:
        """Enter the fast path of each node, and of the rig, if the conditions hold."""
        rig = self._rig
        for node in rig.nodes:
            if (
                not node.fast_path.on
                and not rig.faults.active  # 1
                and not rig.sensors.ranges  # 2
                and node.state is State.OPERATIONAL  # 3
                and not node.distortions  # 4
                and (until_ns := node.quiet_until_ns) > rig.now_ns  # 5
                and (packed := node.packed(rig.sensors.count))  # 6
            ):
                if packed is not self._packed.get(node):
                    self._packed[node] = packed
                    self._lay_out()
                node.enter_fast_path(until_ns, packed, rig.sample)
        if (
            rig.nodes[0].fast_path.on
            and len(rig.nodes) == 1  # 7
            and not rig.partners
            and not rig.wire  # 8
            and (self._has_ends or rig.left_stroke_ns)  # 9
        ):
            self.tick = fast_tick(rig, rig.nodes[0], self._steps)

    def leave(self, *, renewed: bool = False) -> None:
        """Leave the fast path of all nodes, see `Node.leave_fast_path`."""
        for node in self._rig.nodes:
            node.leave_fast_path(renewed=renewed)

    def _lay_out(self) -> None:
        """Assign each node its place in the record, one after the other."""
        words: list[tuple[float, ...]] = []
        place = 0
        for packed in self._packed.values():
            packed.move_to(place)
            words += [(*w.shown, place + w.start, w.size) for w in packed.words]
            place += packed.size
        self._rig.sensors.lay_out(words, place)

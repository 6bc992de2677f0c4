"""Frames for the nodes of a rig: those of its other nodes in the last tick, then those of the bus.

Most frames on a bus concern no node of the rig. They are filtered once for all nodes, by the
identifiers that the nodes presently listen to. A single node filters by itself.
"""

from collections.abc import Iterable, Iterator, Sequence

from hil_emulator.device.node import Node
from hil_emulator.frame import EXTENDED, Frame
from hil_emulator.partners.partner import Partner

Participant = Node | Partner
"""A node or partner that sends and receives frames on a rig's bus."""

Spoken = list[tuple[Participant, Frame]]
"""Frames with the nodes that sent them."""


class FrameRouter:
    """Carries frames between the nodes of a rig, and to them.

    Args:
        nodes: the rig's nodes and partners.

    """

    def __init__(self, nodes: Sequence[Participant]) -> None:
        self._nodes = tuple(nodes)
        self._open = any(isinstance(node, Partner) for node in self._nodes)  # it filters itself
        self._alone = len(self._nodes) == 1  # no other node receives its frames
        self._spoken: Spoken = []
        self._stale = True
        self._hears: dict[int, bool] = {}
        self._asked: frozenset[int] = frozenset()
        for node in self._nodes:
            node.on_route = self._rerouted

    def begin(self, now_ns: int) -> None:
        """Begin a tick; no action on a bus without modelled timing."""

    def stand(self) -> None:
        """Pass frames at once from now on, because time is stopped."""

    def go_on(self) -> None:
        """Resume the time."""

    def publish(self, node: Participant, frames: Sequence[Frame]) -> None:
        """Pass a node's frames to the other nodes in the next tick."""
        if not self._alone:
            self._spoken += [(node, frame) for frame in frames]

    def arriving(
        self, frames: Sequence[Frame], *, everything: bool
    ) -> Iterable[tuple[Participant, Sequence[Frame]]]:
        """Return each node with the frames for it.

        Args:
            frames: of the bus since the last tick.
            everything: whether frames that no node takes are passed too.

        """
        if self._alone:
            return ((self._nodes[0], frames),)
        return self._shared(frames, everything=everything)

    def leaving(self, now_ns: int, sent: Sequence[Frame]) -> list[tuple[int, Sequence[Frame]]]:
        """Return the frames that leave the nodes at this tick: all that they have sent."""
        return [(now_ns, sent)] if sent else []

    def _shared(
        self, frames: Sequence[Frame], *, everything: bool
    ) -> Iterator[tuple[Participant, Sequence[Frame]]]:
        """Yield each of several nodes with the frames for it, including those of other nodes."""
        spoken, self._spoken = self._spoken, []
        if not (everything or self._open):
            spoken, frames = self._of_concern(spoken, frames)
        for node in self._nodes:
            if spoken:
                yield node, [*(f for speaker, f in spoken if speaker is not node), *frames]
            else:
                yield node, frames

    def _of_concern(
        self, spoken: Spoken, frames: Sequence[Frame]
    ) -> tuple[Spoken, Sequence[Frame]]:
        """Return the frames that a node accepts.

        These are all frames if one of them may change the identifiers that a node accepts.
        """
        if self._stale:
            self._listen()
        heard: list[Frame] = []
        for frame in frames:
            taken = self._taken(frame)
            if taken:
                return spoken, frames
            if taken is not None:
                heard.append(frame)
        needed: Spoken = []
        for speaking in spoken:
            taken = self._taken(speaking[1])
            if taken:
                return spoken, frames
            if taken is not None:
                needed.append(speaking)
        return needed, heard

    def _taken(self, frame: Frame) -> bool | None:
        """Return whether a frame may change a node's identifiers; None if no node accepts it."""
        can_id, _, remote, extended = frame
        identifier = can_id | EXTENDED if extended else can_id
        if remote:
            return False if identifier in self._asked else None
        return self._hears.get(identifier)

    def _listen(self) -> None:
        """Store the identifiers that nodes accept, and whether a frame may change them."""
        self._stale = False
        self._asked = frozenset().union(*(node.asked for node in self._nodes))
        self._hears = {}
        for node in self._nodes:
            for can_id, rerouting in node.hears.items():
                self._hears[can_id] = rerouting or self._hears.get(can_id, False)

    def _rerouted(self) -> None:
        self._stale = True

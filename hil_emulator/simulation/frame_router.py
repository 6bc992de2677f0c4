"""What the nodes of a rig hear: what the others said in the last tick, then the bus.

Most frames on a bus concern none of the rig's nodes. They are sorted out once for all of them, by
the identifiers that the nodes listen to at this moment; a node that is alone does that itself.
"""

from collections.abc import Iterable, Iterator, Sequence

from hil_emulator.device.node import Node
from hil_emulator.frame import EXTENDED, Frame
from hil_emulator.partners.partner import Partner

Participant = Node | Partner
"""What sends and hears frames on a rig's bus."""

Spoken = list[tuple[Participant, Frame]]
"""Frames with the nodes that sent them."""


class FrameRouter:
    """Carries frames between the nodes of a rig, and to them.

    Args:
        nodes: the rig's nodes and partners.

    """

    def __init__(self, nodes: Sequence[Participant]) -> None:
        self._nodes = tuple(nodes)
        self._open = any(isinstance(node, Partner) for node in self._nodes)  # sorts out itself
        self._alone = len(self._nodes) == 1  # nobody else to hear what it says
        self._spoken: Spoken = []
        self._stale = True
        self._hears: dict[int, bool] = {}
        self._asked: frozenset[int] = frozenset()
        for node in self._nodes:
            node.on_route = self._rerouted

    def begin(self, now_ns: int) -> None:
        """Begin a tick: nothing to do on a bus that takes no time."""

    def stand(self) -> None:
        """Let frames pass at once from now on: time stands still."""

    def go_on(self) -> None:
        """Let time pass again."""

    def say(self, node: Participant, frames: Sequence[Frame]) -> None:
        """Let the other nodes hear in the next tick what a node has sent."""
        if not self._alone:
            self._spoken += [(node, frame) for frame in frames]

    def arriving(
        self, frames: Sequence[Frame], *, everything: bool
    ) -> Iterable[tuple[Participant, Sequence[Frame]]]:
        """Return each node with what it hears now.

        Args:
            frames: what the bus carried since the last tick.
            everything: hands on frames that no node takes, too.

        """
        if self._alone:
            return ((self._nodes[0], frames),)
        return self._shared(frames, everything=everything)

    def leaving(self, now_ns: int, said: Sequence[Frame]) -> list[tuple[int, Sequence[Frame]]]:
        """Return what leaves the nodes at this tick, and when: all that they have said."""
        return [(now_ns, said)] if said else []

    def _shared(
        self, frames: Sequence[Frame], *, everything: bool
    ) -> Iterator[tuple[Participant, Sequence[Frame]]]:
        """Yield each of several nodes with what it hears, from the others, too."""
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
        """Return the frames that some node takes.

        That is all of them if one may let a node listen to others, which may follow it.
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
        said: Spoken = []
        for speaking in spoken:
            taken = self._taken(speaking[1])
            if taken:
                return spoken, frames
            if taken is not None:
                said.append(speaking)
        return said, heard

    def _taken(self, frame: Frame) -> bool | None:
        """Return whether some node may listen to others after a frame; None if no node takes it."""
        can_id, _, remote, extended = frame
        identifier = can_id | EXTENDED if extended else can_id
        if remote:
            return False if identifier in self._asked else None
        return self._hears.get(identifier)

    def _listen(self) -> None:
        """Note what any node takes, and whether that may change what some node takes."""
        self._stale = False
        self._asked = frozenset().union(*(node.asked for node in self._nodes))
        self._hears = {}
        for node in self._nodes:
            for can_id, rerouting in node.hears.items():
                self._hears[can_id] = rerouting or self._hears.get(can_id, False)

    def _rerouted(self) -> None:
        self._stale = True

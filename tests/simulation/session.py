"""A session of a master with the reference machine, for comparison of two runs."""

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rigs import NODE, Bench

from hil_emulator.faults.catalogue import KINDS
from hil_emulator.frame import Frame

SYNC = Frame(0x080)
REQUEST = 0x600 + NODE

Action = tuple[Any, ...]
"""An action in addition to set points and SYNC: its kind and its arguments."""

_BEFALLEN = {"message": "tpdo1", "object": "0x2020"}

FAULTS = [
    (_BEFALLEN.get(kind.targets[0], kind.targets[0]), kind.name)
    for kind in KINDS
    if not getattr(kind, "needs_time", False) and "lines" not in kind.targets
]
"""A target and a kind for each fault of the reference machine, without lines."""


def nmt(command: int) -> Frame:
    """Return an NMT command to the node."""
    return Frame(0x000, bytes([command, NODE]))


def read(index: int, subindex: int = 0) -> Frame:
    """Return an SDO upload request."""
    return Frame(REQUEST, struct.pack("<BHBI", 0x40, index, subindex, 0))


def write(index: int, subindex: int, value: int, size: int) -> Frame:
    """Return an expedited SDO download request."""
    head = 0x23 | (4 - size) << 2
    return Frame(REQUEST, struct.pack("<BHBI", head, index, subindex, value))


def typed(number: int, kind: int, timer_ms: int = 0, inhibit: int = 0) -> list[Frame]:
    """Return the frames that set transmission type, event timer and inhibit time of a TPDO."""
    record, can_id = 0x1800 + number - 1, 0x180 + 0x100 * (number - 1) + NODE
    return [
        write(record, 1, 1 << 31 | can_id, 4), write(record, 2, kind, 1),
        write(record, 3, inhibit, 2), write(record, 5, timer_ms, 2), write(record, 1, can_id, 4),
    ]  # fmt: skip


def remapped(number: int, words: Sequence[int]) -> list[Frame]:
    """Return the frames that map other objects into a TPDO."""
    record, mapping = 0x1800 + number - 1, 0x1A00 + number - 1
    can_id = 0x180 + 0x100 * (number - 1) + NODE
    entries = [write(mapping, place, word, 4) for place, word in enumerate(words, 1)]
    return [
        write(record, 1, 1 << 31 | can_id, 4), write(mapping, 0, 0, 1), *entries,
        write(mapping, 0, len(words), 1), write(record, 1, can_id, 4),
    ]  # fmt: skip


@dataclass
class Session:
    """The results of a run.

    Attributes:
        frames: by tick.
        objects: every value of the dictionary, at each action "look".
        ticks_on_fast_path: number of ticks that ended with the node on the fast path; not compared.
        services: services of the node, by name; not compared.

    """

    frames: list[tuple[int, Frame]] = field(default_factory=list)
    objects: list[list[Any]] = field(default_factory=list)
    ticks_on_fast_path: int = field(default=0, compare=False)
    services: dict[str, object] = field(default_factory=dict, compare=False)

    def run(self, bench: Bench, script: Mapping[int, Iterable[Action]], ticks: int) -> None:
        """Execute ticks with a set point and a SYNC in each, and the actions of a script."""
        waiting: list[Frame] = []
        for tick in range(ticks):
            sent: list[Frame] = []
            frames = [Frame(0x200 + NODE, struct.pack("<i", 4000 * (tick % 300))), SYNC]
            for action in script.get(tick, ()):
                frames = self._act(bench, action, frames, sent, waiting)
            if waiting:  # one request at a time, as a master does
                sent.append(waiting.pop(0))
            answer = bench.tick(*sent, *frames)
            self.frames += [(tick, frame) for frame in answer]
            self.ticks_on_fast_path += bench.rig.nodes[0].fast_path.on
        self.look(bench)

    def look(self, bench: Bench) -> None:
        """Store the value of every object."""
        (node,) = bench.rig.nodes
        self.objects.append([(entry.where, entry.value) for entry in node.dictionary])

    def _act(
        self, bench: Bench, action: Action, frames: list[Frame], sent: list[Frame],
        waiting: list[Frame],
    ) -> list[Frame]:  # fmt: skip
        """Execute an action of the script; return set point and SYNC of this tick."""
        what, *how = action
        if what == "frames":
            sent += how
        elif what == "requests":
            waiting += how
        elif what == "replaced":
            return list(how)
        elif what == "fault":
            target, kind, duration = how
            options = {"channel": "pressure_b"} if kind == "swapped" else {}
            bench.rig.fault(target, kind, duration=duration, **options)
        elif what == "set":
            bench.rig.set(*how)
        elif what == "serve":
            bench.rig.serve(how)
        elif what == "look":
            self.look(bench)
        return frames

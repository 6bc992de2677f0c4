"""A session of a master with the reference machine, for comparing two ways of going through it."""

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
"""What happens besides set points and SYNC: a word for what, and with what."""

_BEFALLEN = {"message": "tpdo1", "object": "0x2020"}

FAULTS = [
    (_BEFALLEN.get(kind.targets[0], kind.targets[0]), kind.name)
    for kind in KINDS
    if not getattr(kind, "needs_time", False) and "lines" not in kind.targets
]
"""A target for each kind of fault that the reference machine can have, without lines, and it."""


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
    """Return what gives a TPDO a transmission type, an event timer and an inhibit time."""
    record, can_id = 0x1800 + number - 1, 0x180 + 0x100 * (number - 1) + NODE
    return [
        write(record, 1, 1 << 31 | can_id, 4), write(record, 2, kind, 1),
        write(record, 3, inhibit, 2), write(record, 5, timer_ms, 2), write(record, 1, can_id, 4),
    ]  # fmt: skip


def remapped(number: int, words: Sequence[int]) -> list[Frame]:
    """Return what lets a TPDO carry other objects."""
    record, mapping = 0x1800 + number - 1, 0x1A00 + number - 1
    can_id = 0x180 + 0x100 * (number - 1) + NODE
    told = [write(mapping, place, word, 4) for place, word in enumerate(words, 1)]
    return [
        write(record, 1, 1 << 31 | can_id, 4), write(mapping, 0, 0, 1), *told,
        write(mapping, 0, len(words), 1), write(record, 1, can_id, 4),
    ]  # fmt: skip


@dataclass
class Session:
    """What was seen of a run.

    Attributes:
        frames: by tick.
        objects: every value of the dictionary, where somebody looked.
        ticks_on_fast_path: how many ticks ended with the node on the fast path; not compared.
        services: those of the node, by name; not compared.

    """

    frames: list[tuple[int, Frame]] = field(default_factory=list)
    objects: list[list[Any]] = field(default_factory=list)
    ticks_on_fast_path: int = field(default=0, compare=False)
    services: dict[str, object] = field(default_factory=dict, compare=False)

    def run(self, bench: Bench, script: Mapping[int, Iterable[Action]], ticks: int) -> None:
        """Let ticks pass, with a set point and a SYNC in each, and what a script adds."""
        waiting: list[Frame] = []
        for tick in range(ticks):
            sent: list[Frame] = []
            said = [Frame(0x200 + NODE, struct.pack("<i", 4000 * (tick % 300))), SYNC]
            for action in script.get(tick, ()):
                said = self._act(bench, action, said, sent, waiting)
            if waiting:  # one request at a time, as a master does
                sent.append(waiting.pop(0))
            answer = bench.tick(*sent, *said)
            self.frames += [(tick, frame) for frame in answer]
            self.ticks_on_fast_path += bench.rig.nodes[0].fast_path.on
        self.look(bench)

    def look(self, bench: Bench) -> None:
        """Note the value of every object."""
        (node,) = bench.rig.nodes
        self.objects.append([(entry.where, entry.value) for entry in node.dictionary])

    def _act(
        self, bench: Bench, action: Action, said: list[Frame], sent: list[Frame],
        waiting: list[Frame],
    ) -> list[Frame]:  # fmt: skip
        """Do what the script says; return what becomes of set point and SYNC in this tick."""
        what, *how = action
        if what == "frames":
            sent += how
        elif what == "requests":
            waiting += how
        elif what == "said":
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
        return said

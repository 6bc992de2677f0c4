"""Bus faults: each kind as what it does to the connection of one node."""

from collections.abc import Callable, Sequence

from hil_emulator.device.emergency import ErrorBit
from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID
from hil_emulator.device.node import Node
from hil_emulator.faults.catalogue import BUS
from hil_emulator.faults.fault import Fault
from hil_emulator.faults.frame_filters import Delayed, FrameFault, PassThrough, Reordered, Rewriting
from hil_emulator.faults.strength import Strength
from hil_emulator.frame import Frame

RECOVERED_FROM_BUS_OFF = 0x8140
"""Emergency error code (CiA 301 table 26)."""

_BITS_PER_BYTE = 8


class Cut(PassThrough):
    """Lets frames pass in neither direction, or only inward.

    Args:
        node: whose connection it is.
        deaf: whether the node hears nothing either.
        recovers: whether the node reports that it is back (bus-off).

    """

    def __init__(self, node: Node, deaf: bool, recovers: bool = False) -> None:
        self._node = node
        self._deaf = deaf
        self._recovers = recovers

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let frames in, or not."""
        return [] if self._deaf and s.hits() else list(frames)

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Let no frame out."""
        return [] if s.hits() else list(frames)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Report the return to the bus."""
        if self._recovers:
            self._node.raise_error("bus-off", RECOVERED_FROM_BUS_OFF, ErrorBit.COMMUNICATION)
            self._node.clear_error("bus-off")
        return [], []


class Babbling(PassThrough):
    """Puts frames of a strange node in front of those that the node sends."""

    def __init__(self, can_id: int, count: int) -> None:
        self._can_id = can_id
        self._count = count

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Babble once a tick."""
        strange = [
            Frame(self._can_id, s.random.randbytes(_BITS_PER_BYTE)) for _ in range(self._count)
        ]
        return [*(strange if s.hits() else []), *frames]


class Restart(PassThrough):
    """Resets the node once, as a dip of its supply does."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._done = False

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Reset the node before it hears anything else."""
        if self._done or not s.hits():
            return list(frames)
        self._done = True
        return [Frame(0x000, bytes([129, self._node.node_id])), *frames]


class Reported(PassThrough):
    """An error that the node itself reports."""

    def __init__(self, node: Node, code: int) -> None:
        self._node = node
        self._key = ("injected", code)
        node.raise_error(self._key, code, ErrorBit.MANUFACTURER)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Report that it is gone."""
        self._node.clear_error(self._key)
        return [], []


def frame_fault(fault: Fault, node: Node) -> FrameFault:
    """Return what a fault does to the frames of one node."""
    v, chosen = fault.values, _selector(fault.thing, node)
    heartbeat = ERROR_CONTROL_COB_ID + node.node_id
    match fault.kind.name:
        case "drop":
            return Rewriting(chosen, lambda s, f: [])
        case "duplicate":
            return Rewriting(chosen, lambda s, f: [f] * (1 + round(v["copies"])))
        case "corrupt":
            return Rewriting(chosen, lambda s, f: [_corrupt(s, f, round(v["bits"]))])
        case "wrong_length":
            return Rewriting(chosen, lambda s, f: [_resized(f, round(v["length"]))])
        case "heartbeat_stop":
            return Rewriting(lambda f: f.can_id == heartbeat and f.data != b"\0", lambda s, f: [])
        case "delay":
            return Delayed(chosen, round(v["time"] * 1e9))
        case "reorder":
            return Reordered(chosen)
        case "silence":
            return Cut(node, deaf=False)
        case "bus_off":
            return Cut(node, deaf=True, recovers=True)
        case "interface_down":
            return Cut(node, deaf=True)
        case "babbling":
            return Babbling(round(v["can_id"]), round(v["frames"]))
        case "reset":
            return Restart(node)
        case "emcy":
            return Reported(node, round(v["code"]))
        case name:
            raise AssertionError(name)


def _corrupt(s: Strength, frame: Frame, bits: int) -> Frame:
    """Return a frame with some bits of its data inverted."""
    size = len(frame.data) * _BITS_PER_BYTE
    mask = sum(1 << bit for bit in s.random.sample(range(size), min(bits, size)))
    data = int.from_bytes(frame.data, "little") ^ mask
    return frame._replace(data=data.to_bytes(len(frame.data), "little"))


def _resized(frame: Frame, length: int) -> Frame:
    return frame._replace(data=frame.data[:length].ljust(length, b"\0"))


def _selector(target: str, node: Node) -> Callable[[Frame], bool]:
    """Return which frames a target means; COB-IDs are those in use at this moment."""
    if target in (BUS, "node"):
        return lambda frame: True
    named = message_ids(node).get(target, set())
    ids = {int(target, 16)} if target.startswith("0x") else named
    return lambda frame: frame.can_id in ids


def message_ids(node: Node) -> dict[str, set[int]]:
    """Return the COB-IDs of a node's messages by name (predefined set: CiA 301 7.3.5)."""
    n = node.node_id
    named = {
        "nmt": {0x000},
        "sync": {0x080},
        "emcy": {0x080 + n},
        "sdo": {0x580 + n, 0x600 + n},
        "heartbeat": {ERROR_CONTROL_COB_ID + n},
    }
    return named | {row.name.lower(): {row.can_id} for row in node.pdo_map() if row.exists}

"""Bus faults: the effect of each kind on the connection of one node."""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass

from hil_emulator.device.emergency import ErrorBit, ErrorCode
from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID
from hil_emulator.device.node import Node
from hil_emulator.faults.connection import BUS, MESSAGE, NODE, NodeConnection
from hil_emulator.faults.declare import FaultKind, FaultParam, Layer
from hil_emulator.faults.frame_filters import (
    Cut,
    Delayed,
    FrameFault,
    PassThrough,
    Reordered,
    Rewriting,
)
from hil_emulator.faults.strength import Strength
from hil_emulator.frame import BUS_OFF, RESTARTED, Frame

_BITS_PER_BYTE = 8


@dataclass(frozen=True)
class BusFaultKind(FaultKind):
    """A kind of fault on the bus.

    Attributes:
        once: whether it acts on one connection only, even with several nodes on the bus.
        needs_time: whether it needs a bus with modelled timing.
        error_classes: of the error frames at its beginning and end, if there are any.

    """

    layer = Layer.BUS
    given = ("connection",)
    begin: Callable[..., FrameFault]
    _: KW_ONLY
    once: bool = False
    needs_time: bool = False
    error_classes: tuple[int, int] | None = None


def bus_fault(
    *targets: str,
    params: tuple[FaultParam, ...] = (),
    probability: float = 1.0,
    once: bool = False,
    needs_time: bool = False,
    error_classes: tuple[int, int] | None = None,
) -> Callable[[Callable[..., FrameFault]], BusFaultKind]:
    """Declare the decorated function, or class, as a fault of the bus, of a node, of messages."""

    def declare(begin: Callable[..., FrameFault]) -> BusFaultKind:
        return BusFaultKind(
            begin, targets, params, probability,
            once=once, needs_time=needs_time, error_classes=error_classes,
        )  # fmt: skip

    return declare


@bus_fault(BUS, MESSAGE)
def drop(connection: NodeConnection) -> FrameFault:
    """Frames vanish."""
    return Rewriting(connection.chosen, lambda s, f: [])


@bus_fault(
    BUS, MESSAGE, params=(FaultParam("time", "s", "delay of each frame", 0.01, 0.0, 10.0, "ms"),)
)  # fmt: skip
def delay(connection: NodeConnection, time: float) -> FrameFault:
    """Frames come late."""
    return Delayed(connection.chosen, round(time * 1e9))


@bus_fault(BUS, MESSAGE, params=(FaultParam("copies", "1", "additional copies", 1.0, 1.0, 100.0),))
def duplicate(connection: NodeConnection, copies: float) -> FrameFault:
    """Frames come several times."""
    return Rewriting(connection.chosen, lambda s, f: [f] * (1 + round(copies)))


@bus_fault(BUS, MESSAGE, params=(FaultParam("bits", "1", "number of wrong bits", 1.0, 1.0, 64.0),))
def corrupt(connection: NodeConnection, bits: float) -> FrameFault:
    """Bits of the data are wrong."""

    def inverted(s: Strength, frame: Frame) -> list[Frame]:
        size = len(frame.data) * _BITS_PER_BYTE
        mask = sum(1 << bit for bit in s.random.sample(range(size), min(round(bits), size)))
        data = int.from_bytes(frame.data, "little") ^ mask
        return [frame._replace(data=data.to_bytes(len(frame.data), "little"))]

    return Rewriting(connection.chosen, inverted)


@bus_fault(BUS, MESSAGE)
def reorder(connection: NodeConnection) -> FrameFault:
    """A frame comes after its successor."""
    return Reordered(connection.chosen)


@bus_fault(
    BUS,
    MESSAGE,
    params=(FaultParam("length", "1", "bytes of data after the fault", 1.0, 0.0, 8.0),),
)
def wrong_length(connection: NodeConnection, length: float) -> FrameFault:
    """Frames have another length."""
    size = round(length)
    return Rewriting(
        connection.chosen, lambda s, f: [f._replace(data=f.data[:size].ljust(size, b"\0"))]
    )


@bus_fault(NODE)
def silence(connection: NodeConnection) -> FrameFault:
    """The node receives frames but does not send."""
    return Cut(deaf=False)


class _Babbling(PassThrough):
    """Adds frames of a foreign node before those that the node sends."""

    def __init__(self, can_id: int, count: int) -> None:
        self._can_id = can_id
        self._count = count

    def leaving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Babble once a tick."""
        strange = [
            Frame(self._can_id, s.random.randbytes(_BITS_PER_BYTE)) for _ in range(self._count)
        ]
        return [*(strange if s.hits() else []), *frames]


@bus_fault(
    BUS,
    params=(
        FaultParam("can_id", "1", "COB-ID of its frames", 1.0, 0.0, 2047.0),
        FaultParam("frames", "1", "frames per tick", 5.0, 1.0, 100.0),
    ),
    once=True,
)
def babbling(connection: NodeConnection, can_id: float, frames: float) -> FrameFault:
    """A node fills the bus."""
    return _Babbling(round(can_id), round(frames))


class _Reported(PassThrough):
    """An error that the node reports."""

    def __init__(self, node: Node, code: int) -> None:
        self._node = node
        self._key = ("injected", code)
        node.raise_error(self._key, code, ErrorBit.MANUFACTURER)

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Report the end of the error."""
        self._node.clear_error(self._key)
        return [], []


@bus_fault(NODE, params=(FaultParam("code", "1", "emergency error code", 0x1000, 1.0, 65535.0),))
def emcy(connection: NodeConnection, code: float) -> FrameFault:
    """The node reports an error, and at the end that it is over."""
    return _Reported(connection.node, round(code))


@bus_fault(NODE)
def heartbeat_stop(connection: NodeConnection) -> FrameFault:
    """The heartbeat stops; other messages continue."""
    can_id = ERROR_CONTROL_COB_ID + connection.node.node_id
    return Rewriting(lambda f: f.identifier == can_id and f.data != b"\0", lambda s, f: [])


class _Restart(PassThrough):
    """Resets the node once, as a dip of its supply voltage does."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._done = False

    def arriving(self, s: Strength, frames: Sequence[Frame]) -> list[Frame]:
        """Reset the node before it receives the frames of the tick."""
        if self._done or not s.hits():
            return list(frames)
        self._done = True
        return [Frame(0x000, bytes([129, self._node.node_id])), *frames]


@bus_fault(NODE)
def reset(connection: NodeConnection) -> FrameFault:
    """The node restarts, once; its supply has failed."""
    return _Restart(connection.node)


class _BusOff(Cut):
    """Takes the node off the bus; at the end the node reports its return."""

    def __init__(self, node: Node) -> None:
        super().__init__(deaf=True)
        self._node = node
        node.bus_off()

    def end(self) -> tuple[list[Frame], list[Frame]]:
        """Report the return to the bus."""
        self._node.raise_error("bus-off", ErrorCode.RECOVERED_FROM_BUS_OFF, ErrorBit.COMMUNICATION)
        self._node.clear_error("bus-off")
        return [], []


@bus_fault(NODE, error_classes=(BUS_OFF, RESTARTED))
def bus_off(connection: NodeConnection) -> FrameFault:
    """The node is off the bus and obeys 0x1029:1; back again it reports EMCY 0x8140."""
    return _BusOff(connection.node)


class _Disturbed(PassThrough):
    """Destroys frames of the node by error frames; its controller repeats them."""

    def destroys(self, s: Strength) -> bool:
        """Draw whether a frame is destroyed."""
        return s.hits()


@bus_fault(BUS, NODE, probability=0.1, needs_time=True)
def error_frames(connection: NodeConnection) -> FrameFault:
    """Frames are destroyed and sent again; 32 in a row are bus-off (bus with modelled timing)."""
    return _Disturbed()


class _Unacknowledged(PassThrough):
    """Lets no other node acknowledge what the node sends."""

    def acknowledged(self, s: Strength) -> bool:
        """Take the chance for a frame."""
        return not s.hits()


@bus_fault(BUS, NODE, needs_time=True)
def no_acknowledge(connection: NodeConnection) -> FrameFault:
    """No other node acknowledges: the node repeats, and reports EMCY 0x8120 (error passive)."""
    return _Unacknowledged()


@bus_fault(BUS)
def interface_down(connection: NodeConnection) -> FrameFault:
    """The cable is unplugged."""
    return Cut(deaf=True)


KINDS = (
    drop, delay, duplicate, corrupt, reorder, wrong_length, silence, babbling, emcy,
    heartbeat_stop, reset, bus_off, error_frames, no_acknowledge,
    interface_down,
)  # fmt: skip

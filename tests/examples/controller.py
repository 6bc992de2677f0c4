"""The controller under test: holds a position through CAN, and gives up safely.

It knows python-can and the node's default PDOs, and nothing of the emulator: the same class would
drive the real actuator. `step` is to be called once per millisecond.
"""

import enum
import struct

import can

HEARTBEAT_MS = 20
"""The producer heartbeat time that the controller asks for."""


class State(enum.Enum):
    """What the controller is about."""

    WAITING = "for the boot-up of the node"
    HOLDING = "the position"
    SAFE = "no current until the node boots again"


class Controller:
    """Position control with supervision.

    Args:
        bus: a python-can bus, or anything with its `recv` and `send`.
        node: the node-ID of the actuator.

    Attributes:
        target: where the rod shall be [m].
        state: what it is about.
        reason: why it went to SAFE.
        missed: samples that never came.
        current: the set point it has sent last [A].

    """

    GAIN = 0.1  # A/m
    DAMPING = 1.0e-10  # A/Pa, against fast changes of the load pressure
    LIMIT = 5e-3  # A
    STUCK_MS = 60  # a rod that does not move under a current this long
    STUCK_CURRENT = 0.4e-3  # A
    MOVES = 20e-6  # m
    LATE_MS = 2 * HEARTBEAT_MS + 10

    def __init__(self, bus: can.BusABC, node: int) -> None:
        self.bus, self.node = bus, node
        self.target = 0.04
        self.state = State.WAITING
        self.reason = ""
        self.missed = 0
        self.current = 0.0
        self.now = 0
        self._counter: int | None = None
        self._position: float | None = None
        self._mean = 0.0
        self._load_pressure = 0.0
        self._heard = 0
        self._moved_at, self._moved_to = 0, 0.0

    def step(self) -> None:
        """Take what has come, decide, and send the set point."""
        self.now += 1
        while (message := self.bus.recv(0)) is not None:
            self.take(message.arbitration_id, bytes(message.data))
        if self.state is State.HOLDING:
            self.supervise()
        if self.state is State.HOLDING and self._position is not None:
            self.send_current(self.law())

    def take(self, can_id: int, data: bytes) -> None:
        """Take one frame."""
        service, node = can_id & 0x780, can_id & 0x7F
        if node != self.node:
            return
        if service == 0x700:
            self.on_heartbeat(data)
        elif service == 0x080:
            self.on_emergency(data)
        elif service == 0x180 and len(data) == 8:
            a, b = struct.unpack_from("<hh", data)
            self._load_pressure = (a - 0.61 * b) * 1e3
        elif service == 0x280:
            self.on_position(data)

    def on_heartbeat(self, data: bytes) -> None:
        """Start a node that has booted; note that it lives."""
        self._heard = self.now
        if data == b"\0":
            self._counter = self._position = None
            heartbeat = struct.pack("<BHBI", 0x2B, 0x1017, 0, HEARTBEAT_MS)
            self.send(0x600 + self.node, heartbeat)
            self.send(0x000, bytes([1, self.node]))
            self.state, self.reason = State.HOLDING, ""

    def on_emergency(self, data: bytes) -> None:
        """Give up on any error that the node reports; the loss of set points heals itself."""
        (code,) = struct.unpack_from("<H", data)
        if code not in (0x0000, 0x8250):
            self.give_up(f"emergency {code:04X}")

    def on_position(self, data: bytes) -> None:
        """Take the position, if the PDO still carries it."""
        if len(data) != 6:
            self.give_up("TPDO2 has another mapping")
            return
        counts, counter = struct.unpack("<iH", data)
        if self._counter is not None:
            self.missed += (counter - self._counter - 1) % 0x10000
        self._counter, self._position = counter, counts * 1e-7
        if abs(self._position - self._moved_to) > self.MOVES:
            self._moved_at, self._moved_to = self.now, self._position

    def supervise(self) -> None:
        """Give up if the node is silent, or the rod does not follow the valve."""
        if self.now - self._heard > self.LATE_MS:
            self.give_up("no heartbeat")
        if abs(self.current) < self.STUCK_CURRENT:
            self._moved_at = self.now
        elif self.now - self._moved_at > self.STUCK_MS:
            self.give_up("the position does not move")

    def law(self) -> float:
        """Return the current that moves the rod towards its target [A]."""
        assert self._position is not None
        self._mean += 0.05 * (self._load_pressure - self._mean)
        damping = self.DAMPING * (self._load_pressure - self._mean)
        wanted = self.GAIN * (self.target - self._position) - damping
        return max(-self.LIMIT, min(self.LIMIT, wanted))

    def give_up(self, reason: str) -> None:
        """Close the valve and stop the node."""
        if self.state is not State.SAFE:
            self.state, self.reason = State.SAFE, reason
            self.send_current(0.0)
            self.send(0x000, bytes([2, self.node]))

    def send_current(self, current: float) -> None:
        """Send the set point."""
        self.current = current
        self.send(0x200 + self.node, struct.pack("<i", round(current * 1e9)))

    def send(self, can_id: int, data: bytes) -> None:
        """Send one frame."""
        self.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

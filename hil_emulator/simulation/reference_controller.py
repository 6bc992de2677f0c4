"""A small actuator controller that uses CAN frames only."""

import math
import struct
from collections import deque
from dataclasses import dataclass

from hil_emulator.frame import Frame
from hil_emulator.simulation.timed_can_port import CanPort

_NMT_START = 1  # CiA 301 7.2.8.2.2
_MA = 1_000_000  # counts of the set point per mA

_AREA_RATIO = 0.61  # of the reference machine

# Gains, tuned by hand on the reference machine with a spring load.
_POSITION_GAIN = 0.13  # A/m
_DAMPING = 1.2e-10  # A/Pa, on the load pressure's changes
_LEAK = 0.05  # share of the load pressure's mean that is renewed each sample
_FORCE_GAIN = 1.2e-6  # A/N
_FORCE_DEADBAND = 20.0  # N, in which the seals hold the rod; without it the loop hunts
_FORCE_BANDWIDTH = 30.0  # rad/s of each of two low passes: noise, and the oil spring at 60 Hz
_LIMIT = 8e-3  # A

# Current across a dead band of the valve: it grows while the rod is slow, or at rest away from its
# target (assumed).
_NEAR = 0.2e-3  # m, within which the target counts as reached
_WINDOW = 50  # samples in which a rod that is not slow covers this
_SHARE = 0.3  # share of the distance from the target
_PUSH = 4e-6  # A per sample
_MOST_PUSH = 2e-3  # A


@dataclass
class Readings:
    """The last value of every channel, SI."""

    pressure_a: float = 0.0
    pressure_b: float = 0.0
    position: float = 0.0
    load_force: float = 0.0


class Controller:
    """Position or force control of one emulated actuator.

    Args:
        bus: the controller's own port on the bus.
        node_id: the actuator's node.

    Attributes:
        readings: last values of the node's PDOs.
        emergencies: received EMCY messages.
        counter: the node's sample counter.
        missed: number of samples without a PDO.

    """

    def __init__(self, bus: CanPort, node_id: int) -> None:
        self._bus = bus
        self._id = node_id
        self._mean_pressure: float | None = None
        self._error = (0.0, 0.0)
        self._positions: deque[float] = deque(maxlen=_WINDOW)
        self._push = 0.0
        self.readings = Readings()
        self.emergencies: list[Frame] = []
        self.counter: int | None = None
        self.missed = 0

    def start_node(self) -> None:
        """Switch the node to OPERATIONAL."""
        self._bus.send([Frame(0x000, bytes([_NMT_START, self._id]))])

    def listen(self) -> None:
        """Read every arrived frame."""
        for frame in self._bus.receive():
            if frame.can_id == 0x180 + self._id:
                a, b, _, counter = struct.unpack("<hhhH", frame.data)
                self.readings.pressure_a, self.readings.pressure_b = a * 1e3, b * 1e3
                if self.counter is not None:
                    self.missed += (counter - self.counter - 1) % 0x10000
                self.counter = counter
            elif frame.can_id == 0x280 + self._id:
                self.readings.position = struct.unpack_from("<i", frame.data)[0] * 1e-7
            elif frame.can_id == 0x380 + self._id:
                self.readings.load_force = struct.unpack_from("<i", frame.data)[0] * 1e-3
            elif frame.can_id == 0x080 + self._id:
                self.emergencies.append(frame)

    def hold_position(self, target: float) -> None:
        """Send the current that moves the rod towards `target` [m].

        A proportional controller, with an additional current if the rod does not move.
        """
        self._error = (0.0, 0.0)
        error = target - self.readings.position
        self._send(_POSITION_GAIN * error + self._pushing(error) - self._damping())

    def hold_force(self, target: float, period: float) -> None:
        """Send the current that brings the load force to `target` [N].

        A proportional controller, because the valve integrates. Against a spring of k and a mass m
        the force follows the current as K (k + m s²)/s, so frequencies above the bandwidth must be
        filtered out.
        """
        share = _FORCE_BANDWIDTH * period
        once, twice = self._error
        once += share * (target - self.readings.load_force - once)
        twice += share * (once - twice)
        self._error = once, twice
        beyond = twice - max(-_FORCE_DEADBAND, min(_FORCE_DEADBAND, twice))
        self._send(_FORCE_GAIN * beyond - self._damping())

    def _pushing(self, error: float) -> float:
        """Return the current that crosses a dead band, for the distance from the target [m]."""
        past = self._positions
        slow = len(past) == _WINDOW and abs(past[-1] - past[0]) < _SHARE * abs(error)
        if abs(error) < _NEAR or error * self._push < 0.0:
            self._push = 0.0
        elif slow and abs(self._push) < _MOST_PUSH:
            self._push += math.copysign(_PUSH, error)
        past.append(self.readings.position)
        return self._push

    def _damping(self) -> float:
        """Return the current against fast changes of the load pressure: it damps the oil spring."""
        load_pressure = self.readings.pressure_a - _AREA_RATIO * self.readings.pressure_b
        if self._mean_pressure is None:
            self._mean_pressure = load_pressure
        self._mean_pressure += _LEAK * (load_pressure - self._mean_pressure)
        return _DAMPING * (load_pressure - self._mean_pressure)

    def _send(self, current: float) -> None:
        counts = round(max(-_LIMIT, min(_LIMIT, current)) * 1e3 * _MA)
        self._bus.send([Frame(0x200 + self._id, struct.pack("<i", counts))])

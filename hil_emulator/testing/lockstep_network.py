"""A stock `canopen.Network` in lock-step: sending a frame lets one tick pass.

`canopen` reads the answer to an SDO request after it has sent the request. By then the tick has
passed and the answer is there. There is no thread, time-out or clock.
"""

from collections.abc import Sequence
from typing import Any

import canopen

from hil_emulator.bus.bus import Bus
from hil_emulator.frame import Frame
from hil_emulator.simulation.emulator import Emulator

_SDO_REQUESTS = range(0x600, 0x680)
_SDO_ANSWER = -0x080
"""Distance from the COB-ID of a request to that of its answer (CiA 301 7.3.5)."""
_PATIENCE = 20
"""Longest time of an answer in ticks on a bus with modelled timing (assumed)."""


class LockStepTask:
    """A frame that is sent periodically, in emulator time.

    Args:
        network: sends it.
        can_id: its COB-ID.
        data: its data.
        period: time between two of them [s].

    """

    def __init__(
        self, network: "LockStepNetwork", can_id: int, data: Sequence[int] | bytes, period: float
    ) -> None:
        self._network = network
        self._can_id = can_id
        self._data = bytes(data)
        self._period_ns = round(period * 1e9)
        self._next_ns = 0

    def update(self, data: Sequence[int] | bytes) -> None:
        """Send other data from now on."""
        self._data = bytes(data)

    def stop(self) -> None:
        """Send no more."""
        self._network.tasks.discard(self)

    def due(self, now_ns: int) -> None:
        """Send it if it is due."""
        if now_ns >= self._next_ns:
            self._next_ns = now_ns + self._period_ns
            self._network.put(Frame(self._can_id, self._data))


class LockStepNetwork(canopen.Network):
    """Carries frames between stock `canopen` nodes and an emulator in this process.

    On a bus with modelled timing an SDO request lets as many ticks pass as its answer takes.
    Functions that wait with a thread's condition, such as `nmt.wait_for_heartbeat`, wait in vain,
    because no time passes. Use `emulator.wait_until` instead.

    Args:
        emulator: on whose bus it is.

    Attributes:
        tasks: the periodic frames.

    """

    def __init__(self, emulator: Emulator) -> None:
        super().__init__()
        self._emulator = emulator
        self._door = Bus(emulator.bus)
        self.tasks: set[LockStepTask] = set()
        self._heard: set[int] = set()  # identifiers, in the last tick
        emulator.every_tick(self._listen)

    def send_message(self, can_id: int, data: Sequence[int] | bytes, remote: bool = False) -> None:
        """Put a frame on the bus and let one tick pass."""
        self.put(Frame(can_id, bytes(data or b""), remote))
        self._emulator.tick()
        if self._emulator.rig.wire and can_id in _SDO_REQUESTS:
            for _ in range(_PATIENCE):
                if can_id + _SDO_ANSWER in self._heard:
                    break
                self._emulator.tick()

    def send_periodic(  # type: ignore[override]  # canopen's own task has a thread
        self, can_id: int, data: Sequence[int] | bytes, period: float, remote: bool = False
    ) -> LockStepTask:
        """Send a frame every `period` [s] of emulator time from now on."""
        task = LockStepTask(self, can_id, data, period)
        self.tasks.add(task)
        task.due(self._emulator.rig.now_ns)
        return task

    def put(self, frame: Frame) -> None:
        """Put a frame on the bus; it arrives with the next tick."""
        self._door.send([frame])

    def disconnect(self) -> None:
        """Leave the bus."""
        self.tasks.clear()
        self._door.close()

    def _listen(self) -> None:
        now_ns = self._emulator.rig.now_ns
        self._heard.clear()
        while frames := self._door.receive():
            for frame in frames:
                self._heard.add(frame.identifier)
                if not frame.remote:
                    self.notify(frame.can_id, bytearray(frame.data), now_ns * 1e-9)
        for task in sorted(self.tasks, key=_order):
            task.due(now_ns)


def _order(task: LockStepTask) -> Any:
    return task._can_id

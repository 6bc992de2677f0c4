"""A node at rest: nothing happens to it but samples, set points and SYNC.

Its services then have nothing to decide. They sleep: event timers, the number of the sample and
the objects that show it stay where they were. They are woken, and find everything as if they had
seen to it themselves, before anything else happens to the node: another frame, an error, a time
that comes, an access to one of those objects.
"""

from collections.abc import Callable, Set

from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.measured import Measured
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.sensor_objects import SensorObjects
from hil_emulator.device.sync import SyncConsumer

Sampled = Callable[[], Measured]
"""Returns the last sample; always the same object until the next."""

Routes = dict[int, Handler]
"""By identifier, what takes a frame."""

Wake = Callable[[], None]
"""Wakes the services; harmless when repeated."""


class Rest:
    """What a node does while its services sleep.

    Args:
        sensors: its objects that show channels.
        pdos: its PDOs.

    Attributes:
        on: whether they do.
        until_ns: when one of them wakes by itself.

    """

    def __init__(self, sensors: SensorObjects, pdos: ProcessData) -> None:
        self.on = False
        self.until_ns = 0
        self._sensors = sensors
        self._pdos = pdos
        self._packed: PackedTpdos
        self._sampled: Sampled

    def packed(self, count: int) -> PackedTpdos | None:
        """Return what sends the TPDOs out of a record; None where they need their services.

        Args:
            count: number of the last sample, as whoever samples counts them.

        """
        return self._pdos.packed(self._sensors, count)

    def begin(
        self,
        packed: PackedTpdos,
        heartbeat: Heartbeat,
        until_ns: int,
        sampled: Sampled,
        wake: Wake,
    ) -> None:
        """Let the services sleep.

        Args:
            packed: sends the TPDOs meanwhile.
            heartbeat: is sent with them, as it is due.
            until_ns: when one of them wakes by itself.
            sampled: returns the last sample.
            wake: wakes them.

        """
        self.on, self.until_ns = True, until_ns
        self._packed, self._sampled = packed, sampled
        packed.begin(heartbeat)
        self._sensors.lag(wake)

    def end(self, *, renewed: bool) -> None:
        """Wake the services.

        Args:
            renewed: whether there is a newer sample than the last that was published.

        """
        self.on = False
        sent = self._packed
        sent.end()
        last = None if renewed or not sent.passed else self._sampled()
        self._sensors.resume(sent.passed, sent.now_ns, last)


def routes_at_rest(
    ordinary: Routes, shared: Set[int], pdos: ProcessData, sync: SyncConsumer, wake: Wake
) -> Routes:
    """Return routes that wake the services first, but for set points and SYNC.

    Args:
        ordinary: the node's routes.
        shared: identifiers that several services listen to.
        pdos: take set points.
        sync: says what SYNC looks like.
        wake: wakes the services.

    """
    routes = waking(ordinary, wake)
    alone = {can_id: routes[can_id] for can_id in routes.keys() - shared}
    routes |= pdos.shortcuts(alone)
    if sync.can_id in alone:
        routes[sync.can_id] = pdos.sync_shortcut(int(sync.counted), alone[sync.can_id])
    return routes


def waking(routes: Routes, wake: Wake) -> Routes:
    """Return routes that wake the services before they take a frame."""

    def first(handler: Handler) -> Handler:
        def handle(now_ns: int, data: bytes) -> None:
            wake()
            handler(now_ns, data)

        return handle

    return {can_id: first(handler) for can_id, handler in routes.items()}

"""The fast path of a node: its services are skipped while they have nothing to do.

On the fast path a node takes samples, set points and SYNC, and sends TPDOs and its heartbeat.
`simulation/fast_path_nodes.py` lists the conditions under which a node enters it. A node leaves it
at the first of these events. Objects and timers are then the same as without the fast path.

1. a frame that is neither SYNC nor of an RPDO that carries set points alone;
2. the time that a service has declared as its `quiet_until_ns`, or the first frame of an RPDO with
   a deadline;
3. an error, or a channel that leaves its measuring range;
4. a fault, or frames outside a tick (`Rig.serve`);
5. a write to the dictionary, or an access to an object that shows the sample.

Every service declares `quiet_until_ns`: the earliest time [ns] at which it may send or decide
something without an event of 1, 3, 4 or 5. `NEVER` is right for a service that acts only on frames
and writes, `NOW` while it has work in each tick. A service without the attribute keeps its node off
the fast path.
"""

from collections.abc import Callable, Set

from hil_emulator.device.deadline import NOW
from hil_emulator.device.measured import Measured
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.services import Services

Sampled = Callable[[], Measured]
"""Returns the last sample; the same object until the next sample."""

Routes = dict[int, Handler]
"""Handler of frames by identifier."""


class FastPath:
    """Whether a node is on the fast path, and until when.

    Args:
        services: the node's services.

    Attributes:
        until_ns: when the services' deadlines must be checked again; `NOW` off the fast path.

    """

    def __init__(self, services: Services) -> None:
        self.until_ns = NOW
        self._services = services
        self._packed: PackedTpdos
        self._sampled: Sampled

    @property
    def on(self) -> bool:
        """Whether the services are skipped."""
        return self.until_ns != NOW

    def enter(
        self, until_ns: int, packed: PackedTpdos, sampled: Sampled, leave: Callable[[], None]
    ) -> None:
        """Skip the services from now on.

        Args:
            until_ns: the earliest deadline that the services declare.
            packed: sends the TPDOs on the fast path.
            sampled: returns the last sample.
            leave: leaves the fast path.

        """
        self.until_ns = until_ns
        self._packed, self._sampled = packed, sampled
        packed.begin(self._services.heartbeat)
        self._services.sensors.lag(leave)

    def still(self, now_ns: int) -> bool:
        """Return whether the services still have nothing to do; a deadline may have moved."""
        until_ns = self._services.quiet_until_ns
        if now_ns < until_ns:
            self.until_ns = until_ns
        return now_ns < until_ns

    def leave(self, *, renewed: bool) -> None:
        """Resume the services.

        Args:
            renewed: whether a newer sample than the last published one exists.

        """
        self.until_ns = NOW
        sent = self._packed
        sent.end()
        last = None if renewed or not sent.passed else self._sampled()
        self._services.sensors.resume(sent.passed, sent.now_ns, last)


def leaving_first(
    routes: Routes, leave: Callable[[], None], kept: Set[int] = frozenset()
) -> Routes:
    """Return routes that leave the fast path before a frame is handled.

    Args:
        routes: of a node off the fast path.
        leave: leaves the fast path.
        kept: identifiers of set points and SYNC, whose routes stay as they are.

    """

    def first(handler: Handler) -> Handler:
        def handle(now_ns: int, data: bytes) -> None:
            leave()
            handler(now_ns, data)

        return handle

    return {i: handler if i in kept else first(handler) for i, handler in routes.items()}

"""A node at rest: nothing happens to it but samples, set points and SYNC.

Its services then have nothing to decide. They sleep: event timers, the number of the sample and
the objects that show it stay where they were. They are woken, and find everything as if they had
seen to it themselves, before anything else happens to the node: another frame, an error, a time
that comes, an access to one of those objects.
"""

from collections.abc import Callable

from hil_emulator.device.binding import SensorObjects
from hil_emulator.device.measured import Measured
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.process_data import ProcessData

Sampled = Callable[[], Measured]
"""Returns the last sample; always the same object until the next."""


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
        self, packed: PackedTpdos, until_ns: int, sampled: Sampled, wake: Callable[[], None]
    ) -> None:
        """Let the services sleep.

        Args:
            packed: sends the TPDOs meanwhile.
            until_ns: when one of them wakes by itself.
            sampled: returns the last sample.
            wake: wakes them.

        """
        self.on, self.until_ns = True, until_ns
        self._packed, self._sampled = packed, sampled
        packed.begin()
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

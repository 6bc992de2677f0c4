"""A node at rest: nothing happens to it but samples, set points and SYNC.

Its services then have nothing to decide. They sleep: event timers, the number of the sample and
the objects that show it stay where they were. They are woken, and find everything as if they had
seen to it themselves, before anything else happens to the node: another frame, an error, a time
that comes, an access to one of those objects.
"""

from collections.abc import Callable, Sequence

from hil_emulator.device.binding import SensorObjects
from hil_emulator.device.measured import Measured
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.repetition import Repetition, Word
from hil_emulator.frame import Frame

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
        place: where in the record the node's words begin.

    """

    def __init__(self, sensors: SensorObjects, pdos: ProcessData) -> None:
        self.on = False
        self.until_ns = 0
        self.place = 0
        self._sensors = sensors
        self._pdos = pdos
        self._passed = 0
        self._now_ns = 0
        self._repetition: Repetition
        self._sampled: Sampled

    def words(self, count: int) -> Sequence[Word] | None:
        """Return what has to be in the record; None where the TPDOs need their services.

        Args:
            count: number of the last sample, as whoever samples counts them.

        """
        found = self._pdos.repetition(self._sensors, count)
        if found is None:
            return None
        self._repetition = found
        return found.words

    def begin(self, until_ns: int, sampled: Sampled, wake: Callable[[], None]) -> None:
        """Let the services sleep.

        Args:
            until_ns: when one of them wakes by itself.
            sampled: returns the last sample.
            wake: wakes them.

        """
        self.on, self.until_ns, self._sampled = True, until_ns, sampled
        self._passed = 0
        self._repetition.begin()
        self._sensors.lag(wake)

    def publish(self, now_ns: int, record: bytes | bytearray) -> list[Frame]:
        """Return the frames due with a new sample, as the services would."""
        self._passed += 1
        self._now_ns = now_ns
        return self._repetition.publish(now_ns, record, self.place)

    def end(self, *, renewed: bool) -> None:
        """Wake the services.

        Args:
            renewed: whether there is a newer sample than the last that was published.

        """
        self.on = False
        self._repetition.end()
        last = None if renewed or not self._passed else self._sampled()
        self._sensors.resume(self._passed, self._now_ns, last)

"""RPDO: set points from the bus into the dictionary (CiA 301 7.2.2)."""

from collections.abc import Callable

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.pdo import SYNC_CYCLIC_MAX, PdoParameters

Handler = Callable[[int, bytes], None]
"""Takes the time in nanoseconds and a frame's data."""

NS_PER_MS = 1_000_000


class Rpdo:
    """One receive PDO with length check, synchronous update and deadline.

    A value beyond its object's limits is saturated to them, as a drive's input stage does; a
    REAL that is not finite leaves its object unchanged.

    Args:
        parameters: the PDO's records.
        emergency: reports wrong lengths and a missed deadline.

    Attributes:
        deadline_ns: latest time of the next frame, `NEVER` before the first frame.

    """

    def __init__(self, parameters: PdoParameters, emergency: Emergency) -> None:
        self.parameters = parameters
        self._emergency = emergency
        self._wrong_length = (parameters.name, "length")
        self._overdue = (parameters.name, "deadline")
        self._held: bytes | None = None
        self.deadline_ns = NEVER
        self.stop()

    def start(self) -> None:
        """Restart, on entering OPERATIONAL and after a change of parameters."""
        self._mapping = self.parameters.mapping
        self._size = self._mapping.size
        self._synchronous = self.parameters.transmission_type <= SYNC_CYCLIC_MAX
        self._timeout_ns = self.parameters.event_timer_ms * NS_PER_MS
        self.deadline_ns = NEVER  # monitoring starts with the first reception
        self._held = None
        self._window_end_ns = NEVER
        self._targets = [(entry, *entry.bounds) for entry in self._mapping.entries]

    def stop(self) -> None:
        """Leave OPERATIONAL: drop a waiting frame, stop monitoring, clear PDO errors."""
        self.start()
        for error in (self._wrong_length, self._overdue):
            self._emergency.clear(error)

    def receive(self, now_ns: int, data: bytes) -> bool:
        """Handle a frame; return whether objects have new values already."""
        erroneous = self._emergency.active  # empty in most ticks
        if (erroneous or len(data) != self._size) and not self._check_length(len(data)):
            return False
        if self._timeout_ns:
            self.deadline_ns = now_ns + self._timeout_ns
            if erroneous:
                self._emergency.clear(self._overdue)
        if self._synchronous:
            if now_ns <= self._window_end_ns:
                self._held = data
            return False
        self._store(data)
        return True

    def handler(self, obey: Callable[[float], None], otherwise: Handler) -> Handler:
        """Return a faster handler of frames with one set point, equivalent to `receive`.

        Args:
            obey: writes a value to the object.
            otherwise: handles all other cases: wrong lengths, the first frame, values beyond the
                limits, and every frame while an error is active.

        """
        emergency, size, timeout_ns = self._emergency, self._size, self._timeout_ns
        unpack, ((_, low, high),) = self._mapping.unpacker, self._targets

        def handle(now_ns: int, data: bytes) -> None:
            started = not timeout_ns or self.deadline_ns != NEVER
            if started and len(data) == size and not emergency.active:
                (value,) = unpack(data)
                if low <= value <= high:
                    if timeout_ns:
                        self.deadline_ns = now_ns + timeout_ns
                    obey(value)
                    return
            otherwise(now_ns, data)

        return handle

    def sync(self, now_ns: int, window_ns: int) -> bool:
        """Apply what was received since the last SYNC; return whether there was anything.

        Args:
            now_ns: time of the SYNC.
            window_ns: length of the synchronous window (CiA 301 7.5.2.7), 0 for no end. A frame
                after the window is dropped.

        """
        self._window_end_ns = now_ns + window_ns if window_ns else NEVER
        if self._held is None:
            return False
        self._store(self._held)
        self._held = None
        return True

    def expired(self, now_ns: int) -> bool:
        """Return True once when the deadline passes without a frame (EMCY 0x8250)."""
        if now_ns < self.deadline_ns:
            return False
        self.deadline_ns = NEVER
        self._emergency.raise_error(self._overdue, ErrorCode.RPDO_TIMEOUT, ErrorBit.COMMUNICATION)
        return True

    def _store(self, data: bytes) -> None:
        for (entry, low, high), value in zip(self._targets, self._mapping.unpack(data)):  # noqa: B905 - as many
            if low <= value <= high:
                entry.value = value
            elif value == value and abs(value) != float("inf"):
                entry.value = low if value < low else high

    def _check_length(self, length: int) -> bool:
        """Raise or clear the length error (7.2.7.1); return whether the data can be used."""
        key, size = self._wrong_length, self._size
        if length == size:
            self._emergency.clear(key)
        elif length < size:
            self._emergency.raise_error(key, ErrorCode.PDO_TOO_SHORT, ErrorBit.COMMUNICATION)
        else:
            self._emergency.raise_error(key, ErrorCode.PDO_TOO_LONG, ErrorBit.COMMUNICATION)
        return length >= size

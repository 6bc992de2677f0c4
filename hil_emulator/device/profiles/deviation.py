"""Monitoring of a valve's control deviation (CiA 408, objects 0x6350 to 0x6354)."""

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.profiles.record_value import FULL_SCALE, VALUE, seconds, share

DEVIATION = 0x6350
MONITORING_TYPE, DELAY_TIME, UPPER_THRESHOLD, LOWER_THRESHOLD = 0x6351, 0x6352, 0x6353, 0x6354

NS_PER_S = 1_000_000_000


class DeviationMonitor:
    """Detects a control deviation beyond its threshold for longer than the delay time.

    Args:
        dictionary: the valve's dictionary, with the parameters.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self._shown = dictionary.number(DEVIATION, VALUE)
        self._since_ns: int | None = None
        self.reload()

    def reload(self) -> None:
        """Take over the parameters."""
        kind = self._dictionary.number(MONITORING_TYPE)
        self._on = kind is not None and kind.value != 0
        self._delay_ns = round(seconds(self._dictionary, DELAY_TIME) * NS_PER_S)
        self._high = share(self._dictionary, UPPER_THRESHOLD, FULL_SCALE)
        self._low = share(self._dictionary, LOWER_THRESHOLD, -FULL_SCALE)

    def exceeded(self, now_ns: int, deviation: int, *, controlled: bool) -> bool:
        """Show a deviation; return whether it has been beyond a threshold for the delay time.

        Args:
            now_ns: time of the sample.
            deviation: demand less actual value, in digits of 1/16384.
            controlled: whether the power stage is on.

        """
        if self._shown is not None:
            within = -0x8000 <= deviation <= 0x7FFF
            self._shown.value = deviation if within else -0x8000 if deviation < 0 else 0x7FFF
        if not (self._on and controlled) or self._low <= deviation <= self._high:
            self._since_ns = None
            return False
        if self._since_ns is None:
            self._since_ns = now_ns
        return now_ns - self._since_ns >= self._delay_ns

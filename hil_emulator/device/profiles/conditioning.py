"""Conditioning of a valve's set point, before and after the ramp (CiA 408).

    before: limits, then scaling and offset
    after:  direction-dependent gain, then dead-band compensation, then zero correction

All values are digits of 1/16384 of the rated value. The coding of gains as numerator and
denominator, and the straight line inside the dead band's threshold, are assumed.
"""

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.profiles.record_value import FULL_SCALE, fraction, share

UPPER_LIMIT, LOWER_LIMIT = 0x6320, 0x6321
SCALING, OFFSET, ZERO_CORRECTION = 0x6322, 0x6323, 0x6324
DIRECTION_GAIN_TYPE, DIRECTION_GAIN = 0x6340, 0x6341
DEAD_BAND_TYPE, DEAD_BAND_A, DEAD_BAND_B, DEAD_BAND_THRESHOLD = 0x6342, 0x6343, 0x6344, 0x6345


class Conditioning:
    """The static functions between set point and demand value.

    Args:
        dictionary: the valve's dictionary, with the parameters.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self.reload()

    def reload(self) -> None:
        """Take over the parameters."""
        values = self._dictionary
        self._low = share(values, LOWER_LIMIT, -FULL_SCALE)
        self._high = share(values, UPPER_LIMIT, FULL_SCALE)
        self._scale = fraction(values.number(SCALING))
        self._offset = share(values, OFFSET, 0)
        self._zero = share(values, ZERO_CORRECTION, 0)
        gain = fraction(values.number(DIRECTION_GAIN))
        self._negative_gain = gain if self._on(DIRECTION_GAIN_TYPE) else 1.0
        on = self._on(DEAD_BAND_TYPE)
        self._positive_band = share(values, DEAD_BAND_A, 0) if on else 0
        self._negative_band = share(values, DEAD_BAND_B, 0) if on else 0
        self._threshold = share(values, DEAD_BAND_THRESHOLD, 0)

    def reference(self, set_point: float) -> float:
        """Return the ramp's target for a set point."""
        limited = _clamp(set_point, self._low, self._high)
        return _clamp(limited * self._scale + self._offset)

    def demand(self, reference: float) -> int:
        """Return the demand value for the ramp's output."""
        if reference < 0.0:
            value = -self._over_band(-reference * self._negative_gain, self._negative_band)
        else:
            value = self._over_band(reference, self._positive_band)
        return round(_clamp(value + self._zero))

    def _over_band(self, size: float, band: float) -> float:
        """Jump over the dead band: band + (1 - band) size, a line to it below the threshold."""
        over = band + (1.0 - band / FULL_SCALE) * size
        if size >= self._threshold:
            return over if size else 0.0
        edge = band + (1.0 - band / FULL_SCALE) * self._threshold
        return edge * size / self._threshold

    def _on(self, index: int) -> bool:
        entry = self._dictionary.number(index)
        return entry is not None and entry.value != 0


def _clamp(value: float, low: float = -FULL_SCALE, high: float = FULL_SCALE) -> float:
    above = low if value < low else value
    return high if above > high else above

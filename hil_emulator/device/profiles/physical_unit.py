"""Physical units as profiles code them in an UNSIGNED32 (CiA 303-2).

From the top byte: the power of ten of the prefix, the numerator, the denominator, and a byte that
is reserved. So 0x004E0000 is bar and 0xFD4E0000 mbar.
"""

NUMERATORS = {
    0x01: ("m", 1.0),
    0x21: ("N", 1.0),
    0x22: ("Pa", 1.0),
    0x4E: ("Pa", 1e5),
}
"""Numerator byte: SI unit and factor, for metre, newton, pascal, bar (CiA 303-2)."""


def si_unit(code: int) -> tuple[str, float] | None:
    """Return SI unit and factor of a coded unit, None for an unknown code."""
    numerator = NUMERATORS.get(code >> 16 & 0xFF)
    if numerator is None or code & 0xFFFF:
        return None
    exponent = (code >> 24 ^ 0x80) - 0x80
    return numerator[0], numerator[1] * 10.0**exponent

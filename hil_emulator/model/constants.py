"""Physical constants."""

ATMOSPHERE = 101_325.0
"""Standard atmosphere [Pa] (ISO 2533)."""

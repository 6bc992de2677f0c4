"""Times at which a service acts without a frame or write: two special values."""

NEVER = 1 << 63
"""A time [ns] later than any run."""

NOW = 0
"""A time [ns] that has passed in every tick."""

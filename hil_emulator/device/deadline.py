"""Times at which a service acts by itself."""

NEVER = 1 << 63
"""A time, in nanoseconds, that does not come."""

NOW = 0
"""A time, in nanoseconds, that has come in every tick."""

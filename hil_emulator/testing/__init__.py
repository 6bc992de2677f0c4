"""Test a controller against the emulator: in process in lock-step, or from another process."""

from hil_emulator.testing.emulator import Emulator, NeverHeldError

__all__ = ["Emulator", "NeverHeldError"]

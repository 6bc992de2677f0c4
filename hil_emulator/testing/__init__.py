"""Tests of a controller against the emulator: in process in lock-step, or from another process."""

"""Measurements of the emulator's speed on this machine, for the command `bench`."""

"""Faults in emulator time: one vocabulary, four layers, each ends as if it had never been."""

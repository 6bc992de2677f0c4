"""Faults in emulator time: kinds, targets, and their effect on a running rig."""

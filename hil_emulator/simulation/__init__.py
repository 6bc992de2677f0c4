"""The running emulator: a rig per actuator, their clock, and the loop that lets time pass."""

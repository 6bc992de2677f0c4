"""The running emulator: a rig per actuator, clocks, and the loop."""

"""Hardware-in-the-loop emulator of hydraulic actuation on CAN."""

__version__ = "0.1.0"

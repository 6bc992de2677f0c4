"""The physics: servo valve, cylinder, oil, friction, load and sensors.

Knows neither CAN nor configuration, files or clocks. What it computes follows from its
arguments alone; random numbers are handed in.
"""

from hil_emulator.platform.supported_numba import require_supported_numba

require_supported_numba()

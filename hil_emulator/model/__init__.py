"""The physics: servo valve, cylinder, oil, friction, load and sensors.

The model imports neither CAN nor configuration, files or clocks. Its results depend on its
arguments only; random numbers are arguments too.
"""

from hil_emulator.platform.supported_numba import require_supported_numba

require_supported_numba()

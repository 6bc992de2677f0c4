"""Captured CAN traffic as recorded channels: decoding of frames, and their assignment to samples.

| source of the frames' meaning | module |
|---|---|
| the nodes of a configuration, an EDS, a DCF | `by_dictionary` |
| a DBC or another database of messages | `by_database` |

A set point acts from the sample before its frame to the sample after it. This is exact for the
emulator: each tick receives the waiting frames, integrates the plant over a whole period, and then
sends the sample. A real device adds a delay of less than a period, from the sample to the frame and
from the frame to the coil; it appears as a property of the device.
"""

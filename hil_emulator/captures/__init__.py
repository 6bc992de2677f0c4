"""Captured CAN traffic as recorded channels: what frames mean, and which belong to one sample.

| what frames mean is told by | module |
|---|---|
| the nodes of a configuration, an EDS, a DCF | `by_dictionary` |
| a DBC or another database of messages | `by_database` |

A capture shows a device as its controller sees it, and so does a configuration. Hence one rule for
the set point: it acts from the sample before its frame to the sample after it. In the emulator
that is exact, as each tick takes the frames that have come, moves the plant for a whole period, and
then sends the sample. In a real device a delay of less than a period remains, from the sample to
the frame and from the frame to the coil: it is a property of that device, and shows as one.
"""

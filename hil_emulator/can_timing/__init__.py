"""A CAN bus that takes time: length of frames, arbitration, queues and errors of controllers.

Without input, output and clock: frames are queued at a time, and the bus computes when each has
passed. All times are integers of nanoseconds, so that the same frames pass at the same times.
"""

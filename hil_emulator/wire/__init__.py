"""A CAN bus that takes time: how long frames are, who may send, what controllers do when they wait.

Without input, output and clock: frames are queued at a time, and the wire tells when each has
passed. All times are integers of nanoseconds, so that the same frames pass at the same times.
"""

"""A conformance suite for CiA 301 devices: cases against any device on any bus.

    pytest --pyargs hil_emulator.conformance --can socketcan:can0 --node 5 --eds device.eds

The suite is a master: it sends frames and judges what comes back against the EDS, which may be any
maker's. It resets the device before each case, restores its defaults, and writes the
values it has read back into the objects: no machine may hang on the device. 127 cases have the
numbers that they have in the CAN in Automation conformance test tool; those from 301 on, LSS and
TIME are our own. What each does is our own reading of CiA 301, 305 and 306.
"""

"""A conformance suite for CiA 301 devices: cases for any device on any bus.

    pytest --pyargs hil_emulator.conformance --can socketcan:can0 --node 5 --eds device.eds

The suite is a master: it sends frames and compares the answers with the EDS, which may be of any
maker. It resets the device before each case, restores its defaults and writes objects, so the
device must not be connected to a machine. 127 cases have the numbers of the CAN in Automation
conformance test tool; cases from 301 on and the chapters LSS and TIME are additional. All cases
are written from CiA 301, 305 and 306.
"""

"""Where the PDOs of a device are in its dictionary (CiA 301 7.5.2.35 to 38)."""

RPDO_COMMUNICATION = 0x1400
RPDO_MAPPING = 0x1600
TPDO_COMMUNICATION = 0x1800
TPDO_MAPPING = 0x1A00
MAX_PDOS = 512

COB_ID, TRANSMISSION_TYPE, INHIBIT_TIME, EVENT_TIMER, SYNC_START = 1, 2, 3, 5, 6
"""Sub-indices of a communication record."""

MAX_BITS = 64
"""A PDO is one classical CAN frame."""

LAST_DUMMY = 0x0007
"""Indices 1 to 7 name data types; an RPDO may map them to skip bytes (CiA 301 7.4.7)."""

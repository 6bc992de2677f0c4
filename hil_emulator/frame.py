"""A CAN frame as the emulator's parts hand it to each other."""

from typing import NamedTuple

EXTENDED = 1 << 29
"""Bit of a COB-ID that tells a 29-bit identifier from an 11-bit one (CiA 301 7.5.2)."""

BUS_OFF, BUS_ERROR, RESTARTED = 0x040, 0x088, 0x100
"""Classes of error frames (Linux, can/error.h): a controller has gone off the bus; a frame was
destroyed, as protocol and bus error; a controller has come back."""


class Frame(NamedTuple):
    """One classical CAN frame.

    Attributes:
        can_id: 11-bit identifier, or 29-bit where `extended` is set.
        data: 0 to 8 bytes; empty for a remote frame.
        remote: a remote transmission request (RTR).
        extended: a 29-bit identifier; of the CANopen services here only PDOs can have one.

    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False

    @property
    def identifier(self) -> int:
        """The identifier as COB-IDs have it (CiA 301 7.5.2): bit 29 set for one of 29 bits."""
        return self.can_id | EXTENDED if self.extended else self.can_id

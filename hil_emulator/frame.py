"""A CAN frame as the emulator's parts hand it to each other."""

from typing import NamedTuple


class Frame(NamedTuple):
    """One classical CAN frame.

    Attributes:
        can_id: 11-bit identifier, or 29-bit where `extended` is set.
        data: 0 to 8 bytes; empty for a remote frame.
        remote: a remote transmission request (RTR).
        extended: a 29-bit identifier; no CANopen service of ours uses one.

    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False

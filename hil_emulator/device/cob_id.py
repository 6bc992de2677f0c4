"""COB-ID parameters: a CAN identifier with flags in bits 29 to 31 (CiA 301 7.5.2)."""

from hil_emulator.device.abort import AbortCode, SdoAbort

CAN_ID_MASK = 0x7FF
INVALID = 1 << 31
"""PDO, EMCY: set while the object does not exist."""
NO_RTR = 1 << 30
"""TPDO: set where remote frames are not answered."""
PRODUCER = 1 << 30
"""SYNC, TIME: set where the device produces the message."""
EXTENDED = 1 << 29
"""Set for a 29-bit identifier, which this device does not support."""

RESTRICTED = (
    range(0x001, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""CAN-IDs no configurable object may use, besides 0x000 (CiA 301 7.3.5)."""


def check_can_id(cob_id: int) -> None:
    """Refuse a 29-bit or restricted identifier (0609 0030)."""
    can_id = cob_id & CAN_ID_MASK
    if cob_id & EXTENDED or can_id == 0 or any(can_id in ids for ids in RESTRICTED):
        raise SdoAbort(AbortCode.INVALID_VALUE)


def check_change(old: int, new: int) -> None:
    """Refuse a bad identifier, and any change but deletion of an existing object (0609 0030).

    An object exists while bit 31 is clear; its bits 0 to 29 are then locked (CiA 301 7.5.2.35).
    An object that is being deleted, or stays so, may carry any identifier.
    """
    if not new & INVALID:
        check_can_id(new)
    if not (old | new) & INVALID and (old ^ new) & ~NO_RTR:
        raise SdoAbort(AbortCode.INVALID_VALUE)

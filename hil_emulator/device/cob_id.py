"""COB-ID parameters: a CAN identifier with flags in bits 29 to 31 (CiA 301 7.5.2).

PDOs may have 29-bit identifiers, unless the configuration excludes them (`extended_ids = false`).
All other services have 11-bit identifiers.
"""

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.frame import EXTENDED

CAN_ID_MASK = 0x7FF
EXTENDED_ID_MASK = 0x1FFF_FFFF
INVALID = 1 << 31
"""PDO, EMCY: set while the object does not exist."""
NO_RTR = 1 << 30
"""TPDO: set where remote frames are not answered."""
PRODUCER = 1 << 30
"""SYNC, TIME: set where the device produces the message."""
RESTRICTED = (
    range(0x001, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""CAN-IDs of 11 bits no configurable object may use, besides 0x000 (CiA 301 7.3.5)."""


def number(cob_id: int) -> int:
    """Return the CAN identifier in a COB-ID, of 11 or 29 bits."""
    return cob_id & (EXTENDED_ID_MASK if cob_id & EXTENDED else CAN_ID_MASK)


def check_can_id(cob_id: int, *, extended: bool = False) -> None:
    """Refuse a restricted identifier, and one of 29 bits unless `extended` (0609 0030)."""
    if cob_id & EXTENDED and extended:
        return
    can_id = cob_id & CAN_ID_MASK
    if cob_id & EXTENDED or can_id == 0 or any(can_id in ids for ids in RESTRICTED):
        raise SdoAbort(AbortCode.INVALID_VALUE)


def check_change(old: int, new: int, *, extended: bool = False) -> None:
    """Refuse a bad identifier, and any change but deletion of an existing object (0609 0030).

    An object exists while bit 31 is clear; its bits 0 to 29 are then locked (CiA 301 7.5.2.35).
    An object that is being deleted, or stays deleted, may carry any identifier. `extended` allows
    29-bit identifiers.
    """
    if not new & INVALID:
        check_can_id(new, extended=extended)
    if not (old | new) & INVALID and (old ^ new) & ~NO_RTR:
        raise SdoAbort(AbortCode.INVALID_VALUE)

"""Frames of J1939, matched by parameter group whatever their priority and source address."""

from collections.abc import Collection, MutableMapping

from hil_emulator.captures.carrier import Carrier
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import KNOWN

_PEER_TO_PEER = 240
"""PDU format below which the next byte is a destination, not part of the group (SAE J1939-21)."""


def group(can_id: int) -> int:
    """Return the parameter group number of a 29-bit identifier (SAE J1939-21, 5.1.2)."""
    number = can_id >> 8 & 0x3FFFF
    return number if number >> 8 & 0xFF >= _PEER_TO_PEER else number & 0x3FF00


def by_parameter_group(
    carriers: MutableMapping[tuple[int, bool], Carrier], ids_in_capture: Collection[int]
) -> list[str]:
    """Add the identifiers of other source addresses for carriers without a frame; return notes.

    If several sources send the group, the carrier's source address decides.

    Args:
        carriers: by identifier and whether it has 29 bits; entries are added.
        ids_in_capture: identifiers of 29 bits in the capture.

    Raises:
        UserError: if several other sources send the group of a carrier.

    """
    notes = []
    free = [can_id for can_id in ids_in_capture if (can_id, True) not in carriers]
    for carrier in [
        c for c in carriers.values() if c.any_source and c.can_id not in ids_in_capture
    ]:
        same = [i for i in free if group(i) == group(carrier.can_id)]
        same = [i for i in same if i & 0xFF == carrier.can_id & 0xFF] or same
        useful = any(s.name in KNOWN for s in carrier.signals)
        if len(same) > 1 and useful:
            sources = ", ".join(f"{i:08X}" for i in sorted(same))
            raise UserError(
                f"{carrier.name}: parameter group {group(carrier.can_id):05X} comes from several "
                f"sources ({sources}); give the message the identifier of one source"
            )
        if len(same) == 1 and useful:
            carriers[same[0], True] = carrier
            notes.append(
                f"{carrier.name}: identifier {carrier.can_id:08X} is read from {same[0]:08X}, the "
                "same J1939 parameter group"
            )
    return notes

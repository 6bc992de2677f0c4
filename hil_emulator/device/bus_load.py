"""Worst-case bus load of a node."""

from collections.abc import Iterable

from hil_emulator.device.pdo import EVENT_MANUFACTURER, RTR_SYNC, SYNC_CYCLIC_MAX, PdoParameters

STUFFABLE_BITS = 34
"""Bits of a base frame without data that are subject to bit stuffing: SOF to CRC."""
STUFFABLE_BITS_EXTENDED = 54
"""The same of a frame with a 29-bit identifier."""
FIXED_BITS = 13
"""CRC delimiter, ACK slot and delimiter, end of frame, and the interframe space of three bits."""

US_PER_S = 1_000_000


def frame_bits(size: int, *, extended: bool = False) -> int:
    """Return the bits a classical data frame takes with worst-case stuffing.

    g + 8 s + 13 + floor((g + 8 s - 1) / 4) with g = 34 for 11-bit and 54 for 29-bit identifiers
    (Davis, Burns, Bril, Lukkien, Controller Area Network (CAN) schedulability analysis, Real-Time
    Systems 35, 2007, eq. 1).

    Args:
        size: number of data bytes, 0 to 8.
        extended: whether its identifier has 29 bits.

    """
    stuffable = (STUFFABLE_BITS_EXTENDED if extended else STUFFABLE_BITS) + 8 * size
    return stuffable + FIXED_BITS + (stuffable - 1) // 4


def worst_case(
    transmit: Iterable[PdoParameters],
    receive: Iterable[PdoParameters],
    heartbeat_ms: int,
    sync_us: int,
    tick_us: int,
) -> float:
    """Return the load in bit/s of periodic traffic to and from the node in OPERATIONAL.

    Counted are TPDOs, RPDOs, SYNC and heartbeat. An event-driven TPDO without event timer is
    assumed to change every tick. An RPDO is assumed to arrive with each SYNC; without SYNC twice
    per deadline; without a deadline every tick. SDO, EMCY and remote frames have no period.

    Args:
        transmit: parameters of the TPDOs.
        receive: parameters of the RPDOs.
        heartbeat_ms: 0x1017.
        sync_us: period of SYNC, 0 without SYNC.
        tick_us: period the node is called with.

    """
    load = 0.0
    if sync_us:
        load += frame_bits(0) * US_PER_S / sync_us
    if heartbeat_ms:
        load += frame_bits(1) * US_PER_S / max(1000 * heartbeat_ms, tick_us)
    for parameters, incoming in [(p, False) for p in transmit] + [(p, True) for p in receive]:
        period_us = _period_us(parameters, incoming, sync_us, tick_us)
        if parameters.active and period_us:
            bits = frame_bits(parameters.mapping.size, extended=parameters.extended)
            load += bits * US_PER_S / period_us
    return load


def _period_us(parameters: PdoParameters, incoming: bool, sync_us: int, tick_us: int) -> float:
    """Return the shortest period of a PDO, 0 for a PDO without a period."""
    kind = parameters.transmission_type
    period_us = 1000 * parameters.event_timer_ms
    if incoming:
        return sync_us or period_us / 2 or tick_us
    if kind <= SYNC_CYCLIC_MAX:
        return sync_us * max(1, kind)
    if RTR_SYNC <= kind < EVENT_MANUFACTURER:
        return 0.0
    return max(period_us, parameters.inhibit_us, tick_us)

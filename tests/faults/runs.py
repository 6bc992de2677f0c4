"""The same 300 ms with and without a fault between 100 ms and 200 ms, tick by tick."""

import math
import struct
from functools import cache
from typing import Any

from rigs import NODE, START, Bench, bench, reference, set_point

from hil_emulator.frame import Frame

BEGIN, END, TICKS = 100, 200, 300
Run = list[list[Frame]]
"""What the controller heard in each tick."""

SYNC = Frame(0x080)


def drive(b: Bench, k: int) -> list[Frame]:
    """Let tick `k` of the script pass: a slow sine of current, and a SYNC each 10 ms."""
    if k == 5:
        return b.tick(START)
    if k < 10:
        return b.tick()
    extra = [SYNC] if k % 10 == 0 else []
    return b.tick(set_point(0.5 * math.sin(2 * math.pi * 5 * k * 1e-3)), *extra)


def run(target: str = "", kind: str = "", **options: Any) -> Run:
    """Return what the controller heard, with a fault where one is named."""
    with bench(reference()) as b:
        heard = [drive(b, k) for k in range(BEGIN)]
        if target:
            with b.rig.fault(target, kind, **options):
                heard += [drive(b, k) for k in range(BEGIN, END)]
        else:
            heard += [drive(b, k) for k in range(BEGIN, END)]
        return heard + [drive(b, k) for k in range(END, TICKS)]


@cache
def sound() -> Run:
    """Return what the controller hears of a sound rig."""
    return run()


PLACES = {
    "pressure_a": (0x180, "<h", 0, 1e3),
    "pressure_b": (0x180, "<h", 2, 1e3),
    "supply_pressure": (0x180, "<h", 4, 1e3),
    "position": (0x280, "<i", 0, 1e-7),
    "load_force": (0x380, "<i", 0, 1e-3),
}
"""Base COB-ID, format, place and factor of each channel in the default PDOs."""


def values(heard: Run, channel: str, first: int = BEGIN, last: int = END) -> list[float]:
    """Return a channel's values from its PDO, one per tick from `first` to before `last`."""
    base, code, place, factor = PLACES[channel]
    return [
        struct.unpack_from(code, frame.data, place)[0] * factor
        for tick in heard[first:last]
        for frame in tick
        if frame.can_id == base + NODE
    ]


def codes(heard: Run, first: int = BEGIN, last: int = TICKS) -> list[int]:
    """Return the emergency error codes that were sent."""
    return [
        struct.unpack_from("<H", frame.data)[0]
        for tick in heard[first:last]
        for frame in tick
        if frame.can_id == 0x080 + NODE
    ]


def count(heard: Run, can_id: int, first: int = BEGIN, last: int = END) -> int:
    """Return how many frames with a COB-ID came."""
    return sum(frame.can_id == can_id for tick in heard[first:last] for frame in tick)

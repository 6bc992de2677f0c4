"""What frames mean by a DBC, or another database of messages that cantools reads."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cantools

from hil_emulator import input_files
from hil_emulator.captures.carrier import COUNTER, Carrier, Signal, channel_of
from hil_emulator.device.pdo import SYNC_CYCLIC_MAX
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import KNOWN, SET_POINT
from hil_emulator.identify.measured.stated import SHARE

NO_UNITS: Mapping[str, str] = {}

_TRANSMISSION = re.compile(r"transmission type (\d+)")
"""How this project's own DBC files state a PDO's transmission type, in a message's comment."""

_SET_POINTS = ("set_point", "set point")
"""What CiA 408 calls the set point of a valve driver, as a DBC signal."""


def from_file(
    file: Path, names: Mapping[str, str], units: Mapping[str, str] = NO_UNITS
) -> list[Carrier]:
    """Return the messages of a database that carry known channels.

    Args:
        file: a DBC, KCD, SYM or ARXML file.
        names: channel by the signal that the database has for it, where they differ.
        units: unit by signal, where the database states none.

    Raises:
        UserError: if it cannot be read, or no signal is known.

    """
    try:
        input_files.check(file, input_files.DATABASE)
        database: Any = cantools.database.load_file(file, strict=False)
        found = [_carrier(message, names, units) for message in database.messages]
    except UserError:
        raise
    except Exception as error:  # cantools answers damage with many kinds of exception
        text = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{file}: is not a usable database of messages: {text}") from None
    useful = [c for c in found if c.signals]
    if not useful:
        known = sorted({s.name for m in database.messages for s in m.signals})
        raise UserError(
            f"{file}: none of its signals is a known channel: {', '.join(known[:20])}; state their "
            'meaning with --channel "position=NAME [mm]"'
        )
    return useful


def _check_places(message: Any) -> None:
    """Raise ValueError where a signal does not lie inside the frame of its message."""
    for signal in message.signals:
        first, bits = signal.start, 8 * message.length
        if signal.byte_order == "big_endian":  # numbered from the highest bit of each byte
            first = 8 * (first // 8) + 7 - first % 8
        if first + signal.length > bits:
            raise ValueError(
                f"signal {signal.name} of message {message.name} ends with bit "
                f"{first + signal.length}, and its frame has {bits} bits; correct its place or "
                "the length of the message"
            )


def _carrier(message: Any, names: Mapping[str, str], units: Mapping[str, str]) -> Carrier:
    signals = []
    modulus = 0
    for signal in message.signals:
        unit = units.get(signal.name) or str(signal.unit or "") or None
        name = names.get(signal.name) or _channel(signal.name, unit or "")
        signals.append(Signal(name, unit, signal.name, _names(signal), _range(signal)))
        if name == COUNTER:
            modulus = 1 << signal.length
    stated = _TRANSMISSION.search(str(message.comment or ""))
    commanded = any(s.name == SET_POINT for s in signals)
    synchronous = commanded and stated is not None and int(stated[1]) <= SYNC_CYCLIC_MAX
    useful = any(s.name in KNOWN for s in signals)
    if useful:
        _check_places(message)
    return Carrier(
        message.name, message.frame_id, bool(message.is_extended_frame), 1,
        tuple(signals) if useful else (), lambda data: _decoded(message, data),
        synchronous=synchronous, counter_modulus=modulus, any_source=message.is_extended_frame,
    )  # fmt: skip


def _names(signal: Any) -> dict[float, str]:
    """Return the words that a value table has for values, by value."""
    scaled = signal.conversion.raw_to_scaled
    choices = signal.choices or {}
    return {_number(scaled(raw, decode_choices=False)): str(n) for raw, n in choices.items()}


def _range(signal: Any) -> tuple[float, float]:
    """Return the stated minimum and maximum, half a digit wider; infinite where there is none."""
    half = 0.5 * abs(_number(signal.scale))
    low = -math.inf if signal.minimum is None else _number(signal.minimum) - half
    high = math.inf if signal.maximum is None else _number(signal.maximum) + half
    return low, high


def _number(value: float) -> float:
    """Return a number; infinity for an integer beyond those."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _channel(name: str, unit: str) -> str:
    if name in _SET_POINTS and unit in ("A", "mA", SHARE):
        return SET_POINT
    return channel_of(name, unit)


def _decoded(message: Any, data: bytes) -> dict[str, float]:
    try:
        values = message.decode(data, decode_choices=False, allow_truncated=True)
        return {name: float(value) for name, value in values.items() if not isinstance(value, str)}
    except (cantools.Error, ValueError, LookupError, OverflowError):  # such as no such multiplexer
        return {}

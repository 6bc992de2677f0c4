"""Carriers of channels from a DBC or another message database that cantools reads."""

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
"""Transmission type of a PDO in a message's comment, as this project's DBC export writes it."""

_SET_POINTS = ("set_point", "set point")
"""DBC signal name of a valve driver's set point by CiA 408."""


def from_file(
    file: Path, names: Mapping[str, str], units: Mapping[str, str] = NO_UNITS
) -> list[Carrier]:
    """Return the messages of a database that carry known channels.

    Args:
        file: a DBC, KCD, SYM or ARXML file.
        names: channel by signal name, where the database uses another name.
        units: unit by signal name, where the database has no unit.

    Raises:
        UserError: if the file cannot be read, or no signal is a known channel.

    """
    try:
        input_files.check(file, input_files.DATABASE)
        database: Any = cantools.database.load_file(file, strict=False)
        carriers = [_carrier(message, names, units) for message in database.messages]
    except UserError:
        raise
    except Exception as error:  # cantools raises many kinds of exception for a damaged file
        text = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{file}: is not a usable database of messages: {text}") from None
    useful = [c for c in carriers if c.signals]
    if not useful:
        names_in_file = sorted({s.name for m in database.messages for s in m.signals})
        raise UserError(
            f"{file}: no signal is a known channel: {', '.join(names_in_file[:20])}; state their "
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
    """Return the names that a signal's value table gives to values, by value."""
    scaled = signal.conversion.raw_to_scaled
    choices = signal.choices or {}
    return {_number(scaled(raw, decode_choices=False)): str(n) for raw, n in choices.items()}


def _range(signal: Any) -> tuple[float, float]:
    """Return the stated minimum and maximum, widened by half a digit; infinite if not stated."""
    half = 0.5 * abs(_number(signal.scale))
    low = -math.inf if signal.minimum is None else _number(signal.minimum) - half
    high = math.inf if signal.maximum is None else _number(signal.maximum) + half
    return low, high


def _number(value: float) -> float:
    """Return a value as float; infinity for an integer beyond the range of float."""
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

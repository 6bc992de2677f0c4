"""A DBC file and the messages in it."""

import math
from collections.abc import Sequence
from pathlib import Path

import cantools
from cantools.database.can import Database, Message
from cantools.database.can.signal import Signal
from cantools.database.errors import Error as CanToolsError

from hil_emulator.errors import UserError


def read(file: Path) -> Database:
    """Return the database in a DBC file.

    Raises:
        UserError: it cannot be read.

    """
    try:
        database = cantools.database.load_file(file)
    except (OSError, UnicodeDecodeError, ValueError, CanToolsError) as error:
        reason = str(error).partition("\n")[0]
        raise UserError(f"cannot read the DBC {file}: {reason}") from None
    if not isinstance(database, Database):
        raise UserError(f"{file} describes no CAN bus")
    return database


def message_of(database: Database, file: Path, name: str) -> Message:
    """Return a message by its name.

    Raises:
        UserError: for an unknown name; the message lists the existing ones.

    """
    for message in database.messages:
        if message.name == name:
            return message
    names = ", ".join(message.name for message in database.messages)
    raise UserError(f"{file} has no message {name!r}; there are {names or 'no messages'}")


def signal_of(message: Message, file: Path, name: str) -> Signal:
    """Return a signal of a message by its name.

    Raises:
        UserError: for an unknown name; the message lists the existing ones.

    """
    for signal in message.signals:
        if signal.name == name:
            return signal
    names = ", ".join(signal.name for signal in message.signals)
    raise UserError(f"{file}: {message.name} has no signal {name!r}; there are {names}")


def sent_by(database: Database, sender: str) -> Sequence[str]:
    """Return the names of the messages of a sender."""
    return [message.name for message in database.messages if sender in message.senders]


def raw(signal: Signal, physical: float | str) -> int | float:
    """Return the raw value of a physical one, saturated to what the signal can carry.

    Args:
        signal: with scale, offset, limits and value table.
        physical: a number in the signal's unit, or a word of its value table.

    """
    if isinstance(physical, str):
        return int(signal.choice_to_number(physical))
    low, high = limits(signal)
    physical = min(max(physical, low), high)
    value = (physical - float(signal.offset)) / float(signal.scale)
    if signal.is_float:
        return value
    bits = signal.length - int(signal.is_signed)
    least = -(1 << bits) if signal.is_signed else 0
    return min(max(round(value), least), (1 << bits) - 1)


def limits(signal: Signal) -> tuple[float, float]:
    """Return the lowest and highest physical value; [0|0] in a DBC means no limits."""
    low = -math.inf if signal.minimum is None else float(signal.minimum)
    high = math.inf if signal.maximum is None else float(signal.maximum)
    return (low, high) if low < high else (-math.inf, math.inf)

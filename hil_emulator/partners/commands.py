"""Messages that a partner obeys: signals that command the plant, with a time-out."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cantools.database.can import Message
from cantools.database.errors import Error as CanToolsError

from hil_emulator.partners.database import limits
from hil_emulator.partners.protection import Protection

OK, TIMEOUT, WRONG_CHECKSUM = "ok", "timeout", "checksum"
"""States of a command: in force, timed out, last message damaged."""


@dataclass(frozen=True)
class CommandSignal:
    """A signal that commands the plant.

    Attributes:
        signal: its name in the message.
        command: input of the plant.
        factor: SI value of one unit of the signal.
        safe: SI value without a controller.

    """

    signal: str
    command: str
    factor: float
    safe: float


class ObeyedMessage:
    """A message with commands.

    Args:
        message: of the DBC.
        commands: its signals that command.
        timeout_ns: after so long without the message the safe values hold; 0 for never.
        protection: how it is protected, None if it is not.

    Attributes:
        state: `OK`, `TIMEOUT` or `WRONG_CHECKSUM`.
        commands: the values in force.

    """

    def __init__(
        self,
        message: Message,
        commands: Sequence[CommandSignal],
        timeout_ns: int,
        protection: Protection | None = None,
    ) -> None:
        self.message = message
        self.state = TIMEOUT
        self._commands = commands
        self._timeout_ns = timeout_ns
        self._protection = protection
        self._due_ns = 0
        self.commands: Mapping[str, float] = self._safe

    @property
    def _safe(self) -> Mapping[str, float]:
        return {c.command: c.safe for c in self._commands}

    @property
    def how(self) -> str:
        """How long it is in force, in words."""
        return f"for {self._timeout_ns / 1e6:g} ms" if self._timeout_ns else "until the next"

    def receive(self, now_ns: int, data: bytes) -> None:
        """Take the message; a shorter, damaged or undecodable one changes no command.

        A value beyond the limits of its signal is saturated; one that is not finite is left out.
        """
        if len(data) < self.message.length:
            return
        if self._protection is not None and not self._protection.accepts(data):
            self.state = WRONG_CHECKSUM
            return
        try:
            values: Any = self.message.decode(data[: self.message.length], decode_choices=False)
        except (CanToolsError, KeyError):  # such as a page that the multiplexer does not have
            return
        self.state = OK
        self._due_ns = now_ns + self._timeout_ns
        self.commands = {**self.commands, **dict(self._obeyed(values))}

    def _obeyed(self, values: Mapping[str, float]) -> Iterator[tuple[str, float]]:
        for command in self._commands:
            value = float(values.get(command.signal, math.nan))
            if math.isfinite(value):
                low, high = limits(self.message.get_signal_by_name(command.signal))
                yield command.command, min(max(value, low), high) * command.factor

    def check(self, now_ns: int) -> None:
        """Let the safe values hold when the time is over."""
        if self._timeout_ns and now_ns >= self._due_ns:
            self.state = TIMEOUT
            self.commands = self._safe

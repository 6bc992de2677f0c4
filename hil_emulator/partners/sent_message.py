"""A message that a partner sends: cyclic, on change, multiplexed, counted, protected."""

import itertools
from collections.abc import Callable, Mapping

from cantools.database.can import Message
from cantools.database.can.signal import Signal

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.measured import Measured
from hil_emulator.partners.database import raw
from hil_emulator.partners.protection import Protection

Source = Callable[[int, Measured], float | str]
"""Returns a signal's physical value, or a word of its value table, at a time [ns]."""


class SentMessage:
    """One message.

    Args:
        message: of the DBC.
        sources: values of its signals; the others have their initial values.
        period_ns: between two transmissions; 0 without cyclic transmission.
        on_change: whether changed data are sent at once.
        counter: signal that counts the transmissions, or None.
        protection: of the message, or None.

    """

    def __init__(
        self,
        message: Message,
        sources: Mapping[str, Source],
        period_ns: int,
        *,
        on_change: bool = False,
        counter: str | None = None,
        protection: Protection | None = None,
    ) -> None:
        self.message = message
        self._sources = sources
        self._period_ns = period_ns
        self._on_change = on_change
        self._counter = counter
        self._protection = protection
        self._sent = 0
        self._header = 0
        self._last: bytes | None = None
        self._next_ns = 0 if period_ns else NEVER
        self._multiplexer = next((s for s in message.signals if s.is_multiplexer), None)
        self._pages = itertools.cycle(_pages(message, self._multiplexer))

    @property
    def how(self) -> str:
        """When it is sent, in words."""
        ways = [f"every {self._period_ns / 1e6:g} ms"] if self._period_ns else []
        ways += ["on change"] if self._on_change else []
        return " and ".join(ways) or "on request"

    def due(self, now_ns: int, measured: Measured) -> bytes | None:
        """Return the data to send now, None if it is not due."""
        if now_ns >= self._next_ns:
            self._next_ns += ((now_ns - self._next_ns) // self._period_ns + 1) * self._period_ns
            return self.data(now_ns, measured)
        if self._on_change and self._payload(now_ns, measured, self._page(now_ns, measured)) != (
            self._last
        ):
            return self.data(now_ns, measured)
        return None

    def data(self, now_ns: int, measured: Measured) -> bytes:
        """Return its data for a transmission, which counts."""
        page = self._page(now_ns, measured, turn=True)
        self._last = payload = self._payload(now_ns, measured, page)
        self._sent += 1
        if self._counter is not None:
            payload = self._payload(now_ns, measured, page, self._sent - 1)
        if self._protection is not None:
            payload, self._header = self._protection.protect(payload, self._header)
        return payload

    def _page(self, now_ns: int, measured: Measured, *, turn: bool = False) -> int:
        """Return the multiplexer's value: what feeds it, or each of its pages in turn."""
        signal = self._multiplexer
        if signal is None:
            return 0
        if signal.name in self._sources:
            return int(raw(signal, self._sources[signal.name](now_ns, measured)))
        if turn:
            self._shown = next(self._pages)
        return getattr(self, "_shown", 0)

    def _payload(self, now_ns: int, measured: Measured, page: int, count: int = 0) -> bytes:
        values: dict[str, int | float] = {}
        for signal in self.message.signals:
            ids = signal.multiplexer_ids
            if ids and page not in ids:
                continue
            if signal is self._multiplexer:
                values[signal.name] = page
            elif signal.name == self._counter:
                values[signal.name] = count % (1 << signal.length)
            elif signal.name in self._sources:
                values[signal.name] = raw(signal, self._sources[signal.name](now_ns, measured))
            else:
                values[signal.name] = _initial(signal)
        return self.message.encode(values, scaling=False, strict=False)


def _initial(signal: Signal) -> int | float:
    """Return the raw value of a signal that nothing feeds: GenSigStartValue, else 0."""
    return 0 if signal.raw_initial is None else signal.raw_initial


def _pages(message: Message, multiplexer: Signal | None) -> list[int]:
    """Return the values of a multiplexer that select signals."""
    if multiplexer is None:
        return [0]
    ids = {n for s in message.signals for n in s.multiplexer_ids or ()}
    return sorted(ids) or [0]

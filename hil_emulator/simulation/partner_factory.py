"""The partners that a configuration describes by DBC files."""

from collections.abc import Mapping, Sequence

from cantools.database.can import Message
from cantools.database.can.signal import Signal

from hil_emulator.config.load import Configuration
from hil_emulator.config.object_map import COMMAND_UNITS, UNITS
from hil_emulator.config.partners import MessageTable, PartnerSettings, SignalSettings
from hil_emulator.device.course import Course
from hil_emulator.device.measured import Measured
from hil_emulator.errors import UserError
from hil_emulator.partners import database
from hil_emulator.partners.commands import OK, CommandSignal, ObeyedMessage
from hil_emulator.partners.j1939 import J1939Partner, Name
from hil_emulator.partners.partner import Partner
from hil_emulator.partners.protection import LIST_LENGTH, PROFILE_2, SAE_J1850, Protection
from hil_emulator.partners.sent_message import SentMessage, Source
from hil_emulator.units import to_si

CLASSICAL_BYTES, TRANSPORT_BYTES = 8, 1785
"""Longest message of a frame, and of the transport protocol (SAE J1939-21)."""
NS_PER_MS = 1_000_000


def partners(config: Configuration, channels: Sequence[str]) -> list[Partner]:
    """Make the partners of a configuration.

    Raises:
        UserError: a DBC cannot be read, or has no message or signal that is named.

    """
    return [_Maker(settings, channels).partner() for settings in config.partners]


class _Maker:
    """Creates one partner."""

    def __init__(self, settings: PartnerSettings, channels: Sequence[str]) -> None:
        self.table, self.file = settings.table, settings.dbc
        self._database = database.read(self.file)
        self._channels = list(channels)
        self._obeyed: list[ObeyedMessage] = []
        sent = self.table.transmits
        self._sent = database.sent_by(self._database, self.table.name) if sent is None else sent
        if not self._sent:
            raise UserError(
                f"{self.file} names no message that {self.table.name} sends; list them in transmits"
            )
        for name in self.table.messages:
            self._message(name)

    def partner(self) -> Partner:
        """Return the partner."""
        commanding = [s for s in self.table.signals if s.source in COMMAND_UNITS]
        for name in dict.fromkeys(s.message for s in commanding):
            self._obeyed.append(self._obeyed_message(name, commanding))
        others = [s for s in self.table.signals if s not in commanding]
        for settings in others:
            if settings.message not in self._sent:
                raise UserError(f"{self.table.name} does not send {settings.message}: {self.file}")
        sent = [self._sent_message(name, others) for name in self._sent]
        j1939 = self.table.j1939
        if j1939 is None:
            return Partner(self.table.name, sent, self._obeyed)
        who = Name(j1939.identity, j1939.manufacturer, j1939.function, j1939.arbitrary_address)
        return J1939Partner(self.table.name, sent, self._obeyed, who, j1939.address)

    def _message(self, name: str) -> Message:
        message = database.message_of(self._database, self.file, name)
        most = CLASSICAL_BYTES if self.table.j1939 is None else TRANSPORT_BYTES
        if message.length > most:
            raise UserError(f"{self.file}: {name} has {message.length} bytes, {most} at most")
        if self.table.j1939 is not None and not message.is_extended_frame:
            raise UserError(f"{self.file}: {name} has an 11-bit identifier, J1939 has 29 bits")
        return message

    def _sent_message(self, name: str, settings: Sequence[SignalSettings]) -> SentMessage:
        message, table = self._message(name), self.table.messages.get(name, MessageTable())
        sources: dict[str, Source] = {
            s.signal: self._source(database.signal_of(message, self.file, s.signal), s)
            for s in settings
            if s.message == name
        }
        if table.counter is not None:
            database.signal_of(message, self.file, table.counter)
        cycle_ns = (
            round(1e9 * table.cycle) if table.cycle else (message.cycle_time or 0) * NS_PER_MS
        )
        return SentMessage(
            message, sources, cycle_ns, on_change=table.on_change, counter=table.counter,
            protection=self._protection(message, table),
        )  # fmt: skip

    def _obeyed_message(self, name: str, settings: Sequence[SignalSettings]) -> ObeyedMessage:
        message, table = self._message(name), self.table.messages.get(name, MessageTable())
        commands = []
        for content in [s for s in settings if s.message == name]:
            signal = database.signal_of(message, self.file, content.signal)
            factor, _ = self._scale(signal, content)
            commands.append(
                CommandSignal(signal.name, content.source, factor, self.table.safe_current)
            )
        timeout_ns = round(1e9 * (table.timeout or 0.0))
        return ObeyedMessage(message, commands, timeout_ns, self._protection(message, table))

    def _protection(self, message: Message, table: MessageTable) -> Protection | None:
        if table.checksum is None:
            return None
        where = f"{self.file}: {message.name}"
        if table.checksum == PROFILE_2 and len(table.data_ids) != LIST_LENGTH:
            raise UserError(f"{where}: {PROFILE_2} needs {LIST_LENGTH} data_ids")
        if message.length < 2:
            raise UserError(f"{where}: a message of one byte has no room for a checksum")
        place = 0
        if table.checksum == SAE_J1850:
            if table.checksum_signal is None:
                raise UserError(f"{where}: {SAE_J1850} needs checksum_signal")
            place = self._byte_of(message, table.checksum_signal)
        return Protection(table.checksum, place, table.data_id, table.data_ids)

    def _byte_of(self, message: Message, name: str) -> int:
        signal = database.signal_of(message, self.file, name)
        first = 0 if signal.byte_order == "little_endian" else 7
        if signal.length != 8 or signal.start % 8 != first:
            raise UserError(f"{self.file}: {message.name}.{name} is not one whole byte")
        return int(signal.start) // 8

    def _source(self, signal: Signal, content: SignalSettings) -> Source:
        if content.states:
            return self._state_source(signal, content)
        if content.constant is not None:
            if isinstance(content.constant, str):
                self._check_word(signal, content, content.constant)
            return _constant(content.constant)
        if content.points:
            return _course(Course(content.points, repeat=content.repeat))
        if content.source not in self._channels:
            raise UserError(
                f"{self.file}: {content.where} shows no sensor channel {content.source!r}"
            )
        factor, offset = self._scale(signal, content)
        return _channel(self._channels.index(content.source), factor, offset)

    def _state_source(self, signal: Signal, content: SignalSettings) -> Source:
        for word in content.states.values():
            self._check_word(signal, content, word)
        return _state(self._obeyed, content.states)

    def _check_word(self, signal: Signal, content: SignalSettings, word: str) -> None:
        words = [str(choice) for choice in (signal.choices or {}).values()]
        if word not in words:
            listed = ", ".join(words) or "no values"
            raise UserError(
                f"{self.file}: {content.where} has no value {word!r}; there are {listed}"
            )

    def _scale(self, signal: Signal, settings: SignalSettings) -> tuple[float, float]:
        """Return the SI value of one unit of a signal, and that of 0."""
        if settings.factor is not None:
            return settings.factor, settings.offset
        unit = UNITS[settings.source]
        try:
            zero, one = (to_si(f"{n} {signal.unit or ''}".strip(), unit) for n in (0, 1))
        except ValueError as error:
            raise UserError(
                f"{self.file}: {settings.where}: the unit {signal.unit!r} of the DBC: {error}; "
                f'write {{ channel = "{settings.source}", unit = "1 {unit}" }}'
            ) from None
        return one - zero, zero


def _constant(value: float | str) -> Source:
    return lambda now_ns, measured: value


def _course(course: Course) -> Source:
    return lambda now_ns, measured: course.value(now_ns)


def _channel(place: int, factor: float, offset: float) -> Source:
    return lambda now_ns, measured: (measured.values[place] - offset) / factor


def _state(obeyed: Sequence[ObeyedMessage], words: Mapping[str, str]) -> Source:
    """Return the word of the first state that is not `OK`, else that of `OK`."""

    def word(now_ns: int, measured: Measured) -> str:
        states = [message.state for message in obeyed if message.state in words]
        return words[next((s for s in states if s != OK), states[0] if states else OK)]

    return word

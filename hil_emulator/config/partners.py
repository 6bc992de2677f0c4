"""`[[partner]]`: a node on the bus that is not CANopen, described by a DBC."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from hil_emulator.config.course_points import Points, column
from hil_emulator.config.nodes import SAFE_CURRENT
from hil_emulator.config.object_map import read_value
from hil_emulator.config.table import DescribedTable, QuantityReader
from hil_emulator.model.declare import Param

CYCLE = Param("cycle", "s", "period of a message", 0.02, 0.001, 3600.0, "ms")
TIMEOUT = Param("timeout", "s", "time without it until safe values", 0.1, 0.001, 60.0, "ms")

Checksum = Literal["sae_j1850", "autosar_e2e_p01", "autosar_e2e_p02"]


@dataclass(frozen=True)
class SignalSettings:
    """What one signal of a DBC shows or commands.

    Attributes:
        message: name of its message.
        signal: its name.
        source: channel or command, "" for neither.
        unit: SI unit of `factor`, "" without one.
        factor: SI value of one unit of the signal; None leaves it to the unit in the DBC.
        offset: SI value of 0 of the signal: that of a gauge pressure.
        constant: a number, or a word of its value table; None without a constant.
        points: corners of its course over time, empty without one.
        repeat: whether the course is repeated.
        column: where the course is in a CSV file: file and name of the column.
        states: words of its value table by the state of the commands, empty without them.

    """

    message: str
    signal: str
    source: str = ""
    unit: str = ""
    factor: float | None = None
    offset: float = 0.0
    constant: float | str | None = None
    points: Points = ()
    repeat: bool = False
    column: tuple[str, str] | None = None
    states: Mapping[str, str] = field(default_factory=dict)

    @property
    def where(self) -> str:
        """Message and signal as a configuration names them."""
        return f"{self.message}.{self.signal}"


OF_OBJECTS = ("points", "digits", "range", "bit")
"""Keys of `[node.map]` that a signal does not have."""

STATES = ("ok", "timeout", "checksum")
"""States of a partner's commands: see `hil_emulator.partners.commands`."""


def read_signals(content: object) -> tuple[SignalSettings, ...]:
    """Return the settings of a table.

    Raises:
        ValueError: names the signal and the mistake.

    """
    if not isinstance(content, Mapping):
        raise ValueError('is a table of signals, such as { "Status.Pressure" = "pressure_a" }')
    return tuple(_signal(str(key), value) for key, value in content.items())


def _signal(key: str, content: object) -> SignalSettings:
    message, dot, signal = key.partition(".")
    if not (message and dot and signal):
        raise ValueError(f'{key!r} is not a signal; write it as "Message.Signal"')
    try:
        if isinstance(content, Mapping) and "state" in content:
            return SignalSettings(message, signal, states=_states(content["state"]))
        if isinstance(content, Mapping) and (scaled := [k for k in OF_OBJECTS if k in content]):
            raise ValueError(f"'{scaled[0]}' is for objects; the DBC has scale and limits")
        values: dict[str, Any] = dict(read_value(content))
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    values["source"] = values.pop("signal", "")
    return SignalSettings(message, signal, **values)


def _states(table: object) -> Mapping[str, str]:
    if not isinstance(table, Mapping) or "ok" not in table or set(table) - set(STATES):
        raise ValueError(f"state is a table of words by {', '.join(STATES)}; ok has to be there")
    return {str(state): str(word) for state, word in table.items()}


class MessageTable(DescribedTable):
    """How a message is sent or obeyed, where the DBC does not state it."""

    cycle: Annotated[float | None, QuantityReader(CYCLE)] = None
    on_change: bool = False
    """whether other data are sent at once"""
    counter: str | None = None
    """signal that counts the transmissions"""
    checksum: Checksum | None = None
    """how the message is protected; a damaged one is not obeyed"""
    checksum_signal: str | None = None
    """signal of eight bits with the checksum of `sae_j1850`"""
    data_id: int = Field(default=0, ge=0, le=0xFFFF)
    """data ID of `autosar_e2e_p01`"""
    data_ids: tuple[Annotated[int, Field(ge=0, le=0xFF)], ...] = ()
    """the 16 data IDs of `autosar_e2e_p02`"""
    timeout: Annotated[float | None, QuantityReader(TIMEOUT)] = None


class J1939Table(DescribedTable):
    """Source address and NAME of a partner that speaks SAE J1939."""

    address: int = Field(ge=0, le=253)
    """preferred source address"""
    identity: int = Field(default=1, ge=0, le=0x1FFFFF)
    """identity number of the NAME"""
    manufacturer: int = Field(default=0, ge=0, le=0x7FF)
    """manufacturer code of the NAME"""
    function: int = Field(default=0, ge=0, le=0xFF)
    """function of the NAME"""
    arbitrary_address: bool = False
    """whether it takes another address when it loses its own"""


class PartnerTable(DescribedTable):
    """A node on the bus that is not CANopen, described by a DBC."""

    name: str
    """name of the node, as in the DBC"""
    dbc: str
    """DBC file; the path is relative to this file"""
    transmits: tuple[str, ...] | None = None
    """messages that it sends; without it those of which the DBC names it as the sender"""
    signals: Annotated[
        tuple[SignalSettings, ...],
        BeforeValidator(read_signals, json_schema_input_type=dict[str, Any]),
    ] = ()
    """what signals show and command, such as `{ "Status.Pressure" = "pressure_a" }`"""
    messages: dict[str, MessageTable] = Field(default_factory=dict)
    """how messages are sent, protected and obeyed"""
    safe_current: Annotated[float, QuantityReader(SAFE_CURRENT)] = SAFE_CURRENT.typical
    j1939: J1939Table | None = None
    """source address and NAME; without it the node does not speak SAE J1939"""


@dataclass(frozen=True)
class PartnerSettings:
    """A partner.

    Attributes:
        table: as it was read, courses in files included.
        dbc: path of its DBC.

    """

    table: PartnerTable
    dbc: Path


def partner_settings(table: PartnerTable, folder: Path) -> PartnerSettings:
    """Return the settings of a table.

    Args:
        table: as it was read.
        folder: that of its file, where the paths in it begin.

    Raises:
        UserError: a CSV file that it names cannot be used.

    """
    signals = tuple(_with_points(settings, folder) for settings in table.signals)
    return PartnerSettings(table.model_copy(update={"signals": signals}), folder / table.dbc)


def _with_points(settings: SignalSettings, folder: Path) -> SignalSettings:
    if settings.column is None:
        return settings
    file, name = settings.column
    return dataclasses.replace(settings, points=column(folder / file, name))

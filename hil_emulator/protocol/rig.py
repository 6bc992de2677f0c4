"""Requests that act on the rig: offered by control port and panel, answered by the loop."""

from typing import Annotated, Literal

from pydantic import Field

from hil_emulator.protocol.base import (
    MOST_OPTIONS,
    Answer,
    Count,
    Declared,
    Name,
    Request,
    WithOptions,
)

MOST_FAULTS = 64
"""Faults at a time: `faults.active.MOST`."""
LONGEST_WORDS = 400
"""Characters of a fault or failure in an answer; of a longer one only the beginning (assumed)."""
MOST_FAILURES = 16
"""Failures in an answer, the newest ones (assumed)."""
Words = Annotated[str, Field(max_length=LONGEST_WORDS)]


class FaultStatus(Declared):
    """A fault that was injected and has not ended."""

    number: Count = Field(description="by which `end` ends it")
    fault: Words = Field(description="in words")
    began: bool = Field(description="false while it waits for its start or condition")
    left: float | None = Field(description="time until it ends [s]; null until it is ended")


class NodeStatus(Declared):
    """A CANopen node of the rig."""

    id: int
    state: Name = Field(description="NMT state")


class BusStatus(Declared):
    """Frames since the start."""

    received: int
    sent: int
    dropped: int


class TimingStatus(Declared):
    """How punctual the loop is."""

    ticks: int
    late: int = Field(description="ticks that began a whole period late or more")


class StatusAnswer(Answer):
    """State of emulator, bus and faults."""

    time: float = Field(description="emulator time [s]")
    slipped: float = Field(description="how far it has fallen behind real time [s]")
    bus_load: float | None = Field(description="share of a bus with modelled timing; else null")
    faults: list[FaultStatus] = Field(max_length=MOST_FAULTS)
    settings: dict[Name, float | None] = Field(
        description="present values in SI; null where the machine has nothing that it acts on"
    )
    nodes: list[NodeStatus] = Field(max_length=127)
    bus: BusStatus | None
    timing: TimingStatus | None
    failures: list[Words] = Field(
        max_length=MOST_FAILURES, description="of helper processes or an FMU"
    )


class StatusRequest(Request):
    """Return time, faults, settings, nodes, bus and timing."""

    answer = StatusAnswer
    do: Literal["status"] = "status"


class Reading(Declared):
    """A signal's present value."""

    value: float | None = Field(description="SI; null while it is not finite")
    unit: Name


class SignalsAnswer(Answer):
    """Present values."""

    signals: dict[Name, Reading]


class SignalsRequest(Request):
    """Return present values of signals."""

    answer = SignalsAnswer
    do: Literal["signals"] = "signals"
    names: list[Name] = Field(default=[], max_length=128, description="all signals without one")


class FaultAnswer(Answer):
    """The fault is injected."""

    number: Count = Field(description="by which `end` ends it")


class FaultRequest(WithOptions):
    """Inject a fault; further fields are its options, as `hil-emulator faults` lists them."""

    answer = FaultAnswer
    do: Literal["fault"] = "fault"
    target: Name = Field(description="what breaks")
    kind: Name = Field(description="how it breaks")


class EndAnswer(Answer):
    """Faults that have ended."""

    ended: list[Count] = Field(max_length=MOST_FAULTS)


class EndRequest(Request):
    """End a fault, or all of them."""

    answer = EndAnswer
    do: Literal["end"] = "end"
    number: Count | None = Field(default=None, description="all faults without one")


class SetAnswer(Answer):
    """Settings in force."""

    set: dict[Name, float] = Field(description="SI")
    waits: list[Annotated[str, Field(max_length=10_000)]] = Field(
        max_length=MOST_OPTIONS, description="what set points wait for before they are in force"
    )


class SetRequest(WithOptions):
    """Set conditions or set points; if one is refused, all are. Fields are settings by name."""

    answer = SetAnswer
    do: Literal["set"] = "set"

"""Requests that concern a single page of the panel: what it shows."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil_emulator.protocol.base import Answer, Request, Time, Word32

MOST_COLUMNS = 128
"""Signals of a view: more than a bench has (assumed)."""
MOST_PIXELS = 4096
"""Width of a view (assumed)."""
LONGEST_S = 600.0
"""How far back a live bench is kept [s] (assumed)."""


class ViewRequest(Request):
    """Send buckets of signals: live, or once those of a time in the past."""

    do: Literal["view"] = "view"
    columns: str = Field(max_length=4096, description=f"names of up to {MOST_COLUMNS} signals")
    pixels: int = Field(ge=1, le=MOST_PIXELS, description="buckets at most")
    generation: Word32 = Field(description="comes back in every message of this view")
    span: Annotated[float, Field(ge=0.01, le=LONGEST_S)] | None = Field(
        default=None, description="live: how much time is shown [s]"
    )
    begin: Time | None = Field(
        default=None, alias="from", description="begin of a time in the past [s]"
    )
    end: Time | None = Field(default=None, alias="to", description="end of that time [s]")

    @property
    def names(self) -> list[str]:
        """The signals."""
        return self.columns.split()

    @model_validator(mode="after")
    def _limit(self) -> Self:
        if len(self.names) > MOST_COLUMNS:
            raise ValueError(f"columns: at most {MOST_COLUMNS} signals")
        if (self.span is None) is (self.begin is None or self.end is None):
            raise ValueError("give span, or from and to")
        if self.begin is not None and self.end is not None and self.begin > self.end:
            raise ValueError("from is after to")
        return self


class WatchRequest(Request):
    """Choose what the messages in words have besides the status."""

    do: Literal["watch"] = "watch"
    what: Literal["", "nodes", "loop", "identifiers", "trace"] = ""
    filter: str = Field(default="", max_length=80, description="text that a line of the trace has")


class LogRequest(Request):
    """Turn to another log of an identification."""

    do: Literal["log"] = "log"
    name: str = Field(max_length=300, description="of `logs` in `hello`")


class RowAnswer(Answer):
    """Values of every column."""

    row: list[float | None] = Field(description="SI; null where nothing is recorded")


class RowRequest(Request):
    """Return the values of all signals at a time."""

    answer = RowAnswer
    do: Literal["row"] = "row"
    time: Time


class PaintedRequest(Request):
    """Say that a message of buckets is on the screen, which measures its age."""

    do: Literal["painted"] = "painted"
    number: Word32 = Field(description="of the message")

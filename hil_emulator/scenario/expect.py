"""Schema of an expectation."""

from typing import Annotated, Any

from pydantic import ConfigDict, Field, field_validator, model_validator

from hil_emulator.config.table import DescribedTable
from hil_emulator.scenario.fields import OptionalSeconds, Seconds, band, pair
from hil_emulator.scenario.names import LARGEST_ID, message_of, object_of

_SUBJECTS = {"signal", "object", "frame"}

Message = Annotated[int, Field(ge=0, le=LARGEST_ID)] | str


class Expect(DescribedTable):
    """An expectation of a signal, of an object, or of the frames on the bus."""

    model_config = ConfigDict(populate_by_name=True)
    signal: str | None = None
    """a column of a recording, such as `position` or `model.velocity`"""
    object: str | None = None
    """an object with the value that an SDO client would read, such as `0x6041`, `node7.0x7130:1`"""
    within: tuple[float | str, float | str] | None = None
    """lowest and highest value, as quantities, such as `["59 mm", "61 mm"]`; an object's as digits,
    or as quantities if it has a unit"""
    after: str = ""
    """name of a step; the times of this expectation are counted from it instead of the start"""
    start: Seconds = Field(0.0, alias="from")
    """time from which on the value has to be within the limits, or the frame is looked for"""
    until: OptionalSeconds = None
    """time until which it has to be within the limits, or the frame is looked for; else the end"""
    by: OptionalSeconds = None
    """latest time at which the value has to enter the limits, or the frame has to come"""
    lasting: OptionalSeconds = Field(None, alias="for")
    """how long it has to stay within the limits after that; without it to the end"""
    frame: Message | None = None
    """a message, such as `tpdo1`, `node5.emcy`, `sync`, or a COB-ID, such as `0x085`"""
    data: str = ""
    """beginning of the frame's data, in hexadecimal"""
    code: int | None = Field(None, ge=0, le=0xFFFF)
    """error code of an EMCY message, such as `0x8250`, instead of `data`"""
    after_each: Message | None = None
    """a message or COB-ID that the frame has to follow each time, at most `by` later"""
    seen: bool = True
    """whether the frame has to be seen; false: it must not be seen"""

    @model_validator(mode="before")
    @classmethod
    def _in_si(cls, given: Any) -> Any:
        """Read the band in the signal's unit, messages by name or in hexadecimal."""
        if not isinstance(given, dict) or len(given.keys() & _SUBJECTS) != 1:
            raise ValueError("name either a signal, an object or a frame")
        given = dict(given)
        for key in ("frame", "after_each"):
            if isinstance(given.get(key), str):
                given[key] = message_of(given[key])
        if isinstance(given.get("code"), str):
            given["code"] = int(given["code"], 16)
        if "signal" in given:
            given["within"] = band(given["signal"], given.get("within"))
        if "object" in given:
            object_of(str(given["object"]))
            pair(given.get("within"))
        if "after_each" in given and not given.keys() >= {"frame", "by"}:
            raise ValueError('after_each needs a frame and its longest delay: by = "20 ms"')
        return given

    @model_validator(mode="after")
    def _one_content(self) -> "Expect":
        if self.code is not None and (self.data or "emcy" not in str(self.frame)):
            raise ValueError('code is for frame = "emcy" without data')
        return self

    @field_validator("data")
    @classmethod
    def _hexadecimal(cls, text: str) -> str:
        bytes.fromhex(text)
        return text

    @property
    def content(self) -> bytes:
        """The first bytes of the frame."""
        if self.code is not None:
            return self.code.to_bytes(2, "little")  # CiA 301 7.2.7.3.1
        return bytes.fromhex(self.data)

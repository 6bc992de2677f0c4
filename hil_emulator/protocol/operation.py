"""Requests of an operator that the panel's process carries out."""

from typing import Annotated, Literal

from pydantic import Field

from hil_emulator.protocol.base import Answer, Request, Text

LONGEST_OBJECT = 10_000
"""Characters of an object in an answer; of a longer one only the beginning is given (assumed)."""


class NmtRequest(Request):
    """Send an NMT command, as another master (CiA 301 7.2.8.2.1)."""

    do: Literal["nmt"] = "nmt"
    command: Literal["start", "stop", "pre-operational", "reset", "reset communication"]
    node: int = Field(ge=0, le=127, description="node-ID; 0 for all nodes")


class SdoAnswer(Answer):
    """The object's name, and its value if it was read."""

    text: str = Field(max_length=LONGEST_OBJECT)


class SdoRequest(Request):
    """Read an object of a node, or write it, as another SDO client."""

    answer = SdoAnswer
    do: Literal["sdo"] = "sdo"
    node: int = Field(ge=1, le=127, description="node-ID")
    index: (
        Annotated[int, Field(ge=0, le=0xFFFF)]
        | Annotated[str, Field(pattern=r"^(0[xX])?[0-9A-Fa-f]{1,4}$")]
    ) = Field(description="0 to FFFF; text is hexadecimal")
    subindex: (
        Annotated[int, Field(ge=0, le=0xFF)]
        | Annotated[
            str, Field(pattern=r"^(0[xX][0-9A-Fa-f]{1,2}|1?[0-9]{1,2}|2[0-4][0-9]|25[0-5])$")
        ]
    ) = Field(description="0 to 255; text is decimal, or 0x00 to 0xFF")
    value: Annotated[str, Field(max_length=1000)] | None = Field(
        default=None,
        description="what to write; bytes in hexadecimal if the EDS does not have the object",
    )

    @property
    def place(self) -> tuple[int, int]:
        """Index and sub-index as numbers."""
        index, subindex = self.index, self.subindex
        if isinstance(index, str):
            index = int(index, 16)
        if isinstance(subindex, str):
            subindex = int(subindex, 16 if subindex[:2] in ("0x", "0X") else 10)
        return index, subindex


class RecordRequest(Request):
    """Begin a recording, or end the one that runs."""

    do: Literal["record"] = "record"
    file: Annotated[str, Field(pattern=r"^[^./\x00-\x1f\x7f][^/\x00-\x1f\x7f]{0,199}$")] | None = (
        Field(
            default=None, description="name of a new file, without a folder, at most 200 characters"
        )
    )


class MarkerRequest(Request):
    """Mark the present moment on the strips and in the recording that runs."""

    do: Literal["marker"] = "marker"
    text: str = Field(default="marker", max_length=80)


class PlayRequest(Request):
    """Play a scenario on an emulator of its own, or end the one that is played."""

    do: Literal["play"] = "play"
    name: Text | None = Field(default=None, description="ends the scenario without one")

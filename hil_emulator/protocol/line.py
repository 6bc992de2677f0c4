"""Requests that only the panel's process sends, to the loop."""

from typing import Any, Literal

from pydantic import Field

from hil_emulator.protocol.base import Answer, Declared, Request


class FrameToSend(Declared):
    """A frame with an identifier of 11 bits."""

    can_id: int = Field(ge=0, le=0x7FF)
    data: str = Field(pattern="^([0-9a-f]{2}){0,8}$")


class SendRequest(Request):
    """Send frames; only from the panel's process to the loop."""

    do: Literal["send"] = "send"
    frames: list[FrameToSend] = Field(max_length=16)


class MessagesAnswer(Answer):
    """PDOs as they are configured now, see `recording.messages`."""

    messages: list[dict[str, Any]]


class MessagesRequest(Request):
    """Return what PDOs mean; only from the panel's process to the loop."""

    answer = MessagesAnswer
    do: Literal["messages"] = "messages"

"""How a request is read and answered, wherever it comes from: checked first, answered always."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from hil_emulator.errors import UserError, brief
from hil_emulator.protocol.base import Request
from hil_emulator.protocol.offered import Requests


class Reply:
    """What a request is answered: its fields, or "error" with the reason."""

    def __init__(self) -> None:
        self.content: Mapping[str, Any] = {}


@contextmanager
def answering() -> Iterator[Reply]:
    """Yield the reply to a request; an exception of the block becomes its reason.

    Refusals are `UserError`s. Any other exception shows a gap in the limits of `protocol`: the
    request gets an error, and the session or loop goes on.
    """
    reply = Reply()
    try:
        yield reply
    except UserError as error:
        reply.content = {"error": str(error)}
    except Exception as error:
        reply.content = {"error": f"cannot be done: {type(error).__name__}: {brief(str(error))}"}


def json_object(data: bytes | str) -> dict[str, Any]:
    """Return the JSON object of a message.

    Raises:
        UserError: if the data are not a JSON object.

    """
    try:
        content = json.loads(data)
    except RecursionError:
        raise UserError("nested too deep: send an object of text and numbers") from None
    except ValueError as error:
        raise UserError(f"not JSON: {brief(str(error))}") from None
    if not isinstance(content, dict):
        raise UserError("send an object")
    return content


def parsed(content: Mapping[str, Any], offered: Requests) -> Request:
    """Return a request, checked.

    Raises:
        UserError: for one that is not offered, and for the first argument that breaks a limit.

    """
    verbs = {verb.verb(): verb for verb in offered}
    do = content.get("do")
    if not isinstance(do, str) or do not in verbs:
        raise UserError(f"cannot do {brief(do)}; there are {', '.join(verbs)}")
    return checked(verbs[do], content)


def checked(verb: type[Request], fields: Mapping[str, Any]) -> Request:
    """Return a request of a kind, with fields from elsewhere; see `parsed`."""
    try:
        return verb.model_validate(fields)
    except ValidationError as error:
        raise UserError(f"{verb.verb()}: {_reason(error, verb)}") from None


def _reason(error: ValidationError, verb: type[Request]) -> str:
    """Return what is wrong with an argument, and what it is for.

    An argument of several types has a mistake for each; that of the type that was given counts.
    """
    mistakes = error.errors(include_url=False)
    mistake = next((m for m in mistakes if not m["type"].endswith("_type")), mistakes[0])
    if mistake["type"] == "value_error":
        return str(mistake["ctx"]["error"])
    name = str(mistake["loc"][0])
    field = next((f for n, f in verb.model_fields.items() if name in (n, f.alias)), None)
    about = f" ({field.description})" if field is not None and field.description else ""
    words = "not understood" if mistake["type"] == "string_pattern_mismatch" else mistake["msg"]
    if mistake["type"] == "missing":
        return f"{name} is missing{about}"
    if mistake["type"].endswith("_type"):
        wanted = dict.fromkeys(m["msg"].removeprefix("Input should be ") for m in mistakes)
        words = f"wanted is {' or '.join(wanted)}"
    return f"{brief(name)}: {brief(mistake['input'])}: {words[:1].lower()}{words[1:]}{about}"

"""Exception for errors that the user can correct, and quotation of the user's input."""

import difflib
import reprlib
from collections.abc import Iterable

_LONGEST = 80  # characters of a quotation (assumed)


class UserError(Exception):
    """An error that the user can correct; the message names fault, place and remedy.

    The command line prints its text without a traceback and ends with `exit_code`.
    """

    exit_code = 2


def brief(given: object) -> str:
    """Return an input shortened for a message; text is not quoted."""
    if isinstance(given, str):
        return given if len(given) <= _LONGEST else f"{given[:_LONGEST]} ..."
    try:
        return reprlib.repr(given)
    except (ValueError, RecursionError):  # Python prints no integer of thousands of digits
        return f"{type(given).__name__} of a size beyond all measure"


def did_you_mean(wrong: str, names: Iterable[str]) -> str:
    """Return the end of a message on an unknown name: a similar name, and all that there are."""
    listed = list(names)
    similar = difflib.get_close_matches(brief(wrong).lower(), listed, 1)
    hint = f", did you mean '{similar[0]}'? There are" if similar else "; there are"
    return f"{hint} {', '.join(listed)}"

"""A channel's error as text: in the unit of its data sheet, with its multiple of the noise."""

from collections.abc import Mapping

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.residuals import shown_as
from hil_emulator.identify.measured.experiment import UNITS

Errors = Mapping[str, float]
"""Numbers of one channel by name, see `Result.gap`."""


def unit_of(channel: str) -> str:
    """Return the unit in which a channel's errors are shown."""
    return shown_as(UNITS[channel])[1]


def titled(channel: str) -> str:
    """Return a channel's name with its unit, as a table's heading."""
    return f"{channel.replace('_', ' ')} [{unit_of(channel)}]"


def number(channel: str, errors: Errors, name: str) -> str:
    """Return an error in the channel's unit, without the unit; "" if it is unknown."""
    if name not in errors:
        return ""
    return three_digits(errors[f"{name}_rms"] * shown_as(UNITS[channel])[0])


def three_digits(value: float) -> str:
    """Return a number with three significant digits: 3058.1 as "3060", not as "3.06e+03"."""
    return f"{float(f'{value:.3g}'):g}"


def in_noise(result: Result) -> bool:
    """Return whether the errors of a result are known as multiples of the noise, too."""
    return "deviation" in result.measure


def cell(result: Result, channel: str, errors: Errors, name: str) -> str:
    """Return an error for a table: the number, and in brackets what `brackets` states."""
    relative = errors.get(name if in_noise(result) else f"{name}_percent")
    text = number(channel, errors, name)
    return f"{text} ({three_digits(relative)})" if text and relative is not None else text


def brackets(result: Result) -> str:
    """Return what the brackets of a table hold."""
    if in_noise(result):
        return "multiple of the channel's noise"
    return "% of the standard deviation of the channel's readings"

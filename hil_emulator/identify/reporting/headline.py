"""Headline of a result: the effect, the fall of the error, and the rest."""

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.channel_errors import (
    Errors,
    in_noise,
    number,
    three_digits,
    unit_of,
)


def headline(result: Result) -> list[str]:
    """Return the sentences that come before all numbers."""
    if not result.effects:
        end = "" if result.reason.endswith("?") else "."
        return [f"{result.reason}{end}", *_left(result)]
    named = "; ".join(f"{f.words}: {f.size}" for f in result.effects)
    doubts = [f"These data do not distinguish {f.name} from {' or '.join(f.group)}."
              for f in result.effects if f.group]  # fmt: skip
    cut = ["The search was interrupted before its end."] if result.interrupted else []
    return [f"{named[:1].upper()}{named[1:]}.", *cut, *_left(result), *doubts, *_too_far(result)]


def _too_far(result: Result) -> list[str]:
    """Return the evidence of another missing effect, in addition to those named."""
    if not result.implausible:
        return []
    far = " and ".join(result.implausible)
    return [f"Implausible: {far}. Another effect is missing as well, or is the true one."]


def _left(result: Result) -> list[str]:
    """Return the fall of the error of the widest channel, and the rest."""
    channel, kind = widest(result)
    if not channel:
        return []
    parts = result.gap[channel]
    values = parts.get("validation") or parts["training"]
    data = "logs not used for the fit" if "validation" in parts else "the logs of the fit"
    error = f"the error of the {channel.replace('_', ' ')}"
    run = f"Predicting 0.5 s ahead on {data}, {error}" if kind else f"On {data}, {error}"
    names = [f"{kind}before", f"{kind}after"] if result.effects else [f"{kind}after"]
    amounts = [_amount(channel, values, name) for name in names]
    multiples = [three_digits(values[name]) for name in names]
    if len(set(amounts)) > 1:
        course = f"falls from {amounts[0]} to {amounts[1]}"
    else:
        course = f"{'stays at' if result.effects else 'is'} {amounts.pop()}"
        multiples = multiples[:1]
    if in_noise(result):
        course += f", {' and '.join(multiples)} times its noise"
    return [f"{run} {course}.{_compared(channel, values, kind)}", *_unexplained(result)]


def widest(result: Result) -> tuple[str, str]:
    """Return the channel of the headline, and the prefix of its error.

    It is the one whose error fell most. If no effect is named, it is the one whose error exceeds
    most that of a perfect model.
    """
    best, chosen = 0.0, ("", "")
    for channel, parts in result.gap.items():
        values = parts.get("validation") or parts["training"]
        kind = "free_" if "free_before" in values else ""
        if f"{kind}after" not in values:
            continue  # no reading where the model predicts
        least = values[f"{kind}after"] if result.effects else values.get(f"{kind}floor", 1.0)
        ratio = values[f"{kind}before"] / max(least, 1e-300)
        if ratio > best:
            best, chosen = ratio, (channel, kind)
    return chosen


def _amount(channel: str, values: Errors, name: str) -> str:
    return f"{number(channel, values, name)} {unit_of(channel)}"


def _compared(channel: str, values: Errors, kind: str) -> str:
    """Return the errors of a perfect model and of plain least squares, as sentences."""
    others = {
        "floor": "A perfect model would reach",
        "least_squares": "Plain least squares reaches",
    }
    return "".join(
        f" {words} {_amount(channel, values, f'{kind}{name}')}."
        for name, words in others.items() if f"{kind}{name}" in values
    )  # fmt: skip


def _unexplained(result: Result) -> list[str]:
    if not result.effects or not result.unknown:
        return []
    u = result.unknown[0]
    where = f"on the {u.balance} over {u.regressor}"
    return [f"No effect explains a part of the rest: {where}, {u.shape}."]

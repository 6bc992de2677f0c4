"""Headline of a result: the effect, the fall of the error, and the rest."""

from collections.abc import Mapping

from hil_emulator.identify.conclusion.result import Result

Errors = Mapping[str, float]


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
    if not result.hardly_believed:
        return []
    far = " and ".join(result.hardly_believed)
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
    before, after = (_amount(result, values, f"{kind}{when}") for when in ("before", "after"))
    course = f"falls from {before} to" if result.effects else "is"
    return [f"{run} {course} {after}.{_compared(values, kind)}", *_unexplained(result)]


def widest(result: Result) -> tuple[str, str]:
    """Return the channel whose error fell most, and the prefix of this error."""
    best, chosen = 0.0, ("", "")
    for channel, parts in result.gap.items():
        values = parts.get("validation") or parts["training"]
        kind = "free_" if "free_before" in values else ""
        if f"{kind}after" not in values:
            continue  # no reading where the model predicts
        fell = values[f"{kind}before"] / max(values[f"{kind}after"], 1e-300)
        if fell > best:
            best, chosen = fell, (channel, kind)
    return chosen


def _amount(result: Result, values: Errors, name: str) -> str:
    if "deviation" in result.measure:
        return f"{values[name]:.3g} times its noise"
    return f"{values[name]:.3g} {result.measure}"


def _compared(values: Errors, kind: str) -> str:
    """Return the errors of a perfect model and of plain least squares, as sentences."""
    floor, plain = values.get(f"{kind}floor"), values.get(f"{kind}least_squares")
    perfect = f" A perfect model would reach {floor:.3g}." if floor else ""
    return perfect + (f" Plain least squares reaches {plain:.3g}." if plain else "")


def _unexplained(result: Result) -> list[str]:
    if not result.effects or not result.unknown:
        return []
    u = result.unknown[0]
    where = f"on the {u.balance} over {u.regressor}"
    return [f"No effect explains a part of the rest: {where}, {u.shape}."]

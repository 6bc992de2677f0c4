"""What was found, in the words of a workshop: the effect, how far the error fell, what remains."""

from collections.abc import Mapping

from hil_emulator.identify.conclusion.result import Result

Errors = Mapping[str, float]


def headline(result: Result) -> list[str]:
    """Return the sentences that come before all numbers."""
    if not result.effects:
        end = "" if result.reason.endswith("?") else "."
        return [f"{result.reason}{end}", *_left(result)]
    found = "; ".join(f"{f.words}: {f.size}" for f in result.effects)
    doubts = [f"These data cannot tell {f.name} from {' or '.join(f.group)}."
              for f in result.effects if f.group]  # fmt: skip
    cut = ["The search was interrupted: this is what it knew."] if result.interrupted else []
    return [f"{found[:1].upper()}{found[1:]}.", *cut, *_left(result), *doubts, *_too_far(result)]


def _too_far(result: Result) -> list[str]:
    """Return what speaks for something else beside the effects that were named."""
    if not result.hardly_believed:
        return []
    far = f"{' and '.join(result.hardly_believed)}, which hardly any machine has"
    return [f"Beside that {far}: something else is missing as well, or stands in for it."]


def _left(result: Result) -> list[str]:
    """Return how the error fell where it was widest, and what remains of it."""
    channel, kind = widest(result)
    if not channel:
        return []
    parts = result.gap[channel]
    values = parts.get("validation") or parts["training"]
    data = "on data that took no part" if "validation" in parts else "on the data of the fit"
    named = channel.replace("_", " ")
    run = f"{named} in free runs of 0.5 s" if kind else named
    before, after = (_amount(result, values, f"{kind}{when}") for when in ("before", "after"))
    if result.effects:
        told = f"The error of the {run} falls from {before} to {after} {data}"
    else:
        told = f"The error of the {run} is {after} {data}"
    return [f"{told}{_beside(values, kind)}.", *_unexplained(result)]


def widest(result: Result) -> tuple[str, str]:
    """Return the channel whose error fell most, and the prefix of the error that tells it."""
    best, found = 0.0, ("", "")
    for channel, parts in result.gap.items():
        values = parts.get("validation") or parts["training"]
        kind = "free_" if "free_before" in values else ""
        if f"{kind}after" not in values:
            continue  # no reading where the model predicts
        fell = values[f"{kind}before"] / max(values[f"{kind}after"], 1e-300)
        if fell > best:
            best, found = fell, (channel, kind)
    return found


def _amount(result: Result, values: Errors, name: str) -> str:
    if "deviation" in result.measure:
        return f"{values[name]:.3g} times its noise"
    return f"{values[name]:.3g} {result.measure}"


def _beside(values: Errors, kind: str) -> str:
    """Return what else the error that remains can be compared with."""
    floor, plain = values.get(f"{kind}floor"), values.get(f"{kind}least_squares")
    told = f"; noise and usual disturbances alone leave {floor:.3g}" if floor else ""
    return told + (f"; plain least squares leaves {plain:.3g}" if plain else "")


def _unexplained(result: Result) -> list[str]:
    if not result.effects or not result.unknown:
        return []
    u = result.unknown[0]
    where = f"on the {u.balance} over {u.regressor}"
    return [f"Part of what remains no effect explains: {where}, {u.shape}."]

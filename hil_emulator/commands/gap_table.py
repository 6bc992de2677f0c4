"""The gap as a table for the terminal: per channel, per balance, per region."""

from collections.abc import Mapping, Sequence

from hil_emulator.commands.text_table import text_table
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.regions import Disagreement

Row = tuple[str, ...]


def gap_lines(result: Result) -> list[str]:
    """Return the lines on the size and place of the gap."""
    lines = [*balances("where", result.where)]
    if result.effects and result.remaining:
        lines += balances("remains", result.remaining)
    if not result.gap:
        return lines
    times = ("before", "after", "floor") if result.effects else ("before", "floor")
    times = (*times[:-1], "least_squares", "floor") if result.plain else times
    free = any("free_before" in v for parts in result.gap.values() for v in parts.values())
    short = "sigma" if "deviation" in result.measure else result.measure
    unit = result.measure if short == result.measure else f"{result.measure} (sigma)"
    lines += ["", f"rms of measured less predicted, in {unit} and in % of the channel's spread"]
    lines += ["free run: 500 ms from filtered states"] * free
    head, rows = ["channel", "data"], []
    kinds = {"": "1 step", "free_": "free run"} if free else {"": "rms"}
    for words in kinds.values():
        head += [f"{words}: {when}" if when == times[0] else when.replace("_", " ")
                 for when in times]  # fmt: skip
    for channel, parts in result.gap.items():
        for part, values in parts.items():
            cells = [_cell(values, f"{k}{when}", short) for k in kinds for when in times]
            rows.append((channel, part, *cells))
    return [*lines, text_table(tuple(head), rows), *_motion(result, times)]


def balances(title: str, gaps: Sequence[Disagreement]) -> list[str]:
    """Return a line per balance, and one per region of it."""
    lines = []
    for d in gaps:
        lines.append(f"{title:9s} {d.place}")
        lines += [f"          {region}" for region in d.regions]
        title = ""
    return lines


def _cell(values: Mapping[str, float], name: str, unit: str) -> str:
    if name not in values:
        return "-"
    percent = values.get(f"{name}_percent")
    text = f"{values[name]:.3g} {unit}" if unit != "sigma" else f"{values[name]:.3g}"
    return text if percent is None else f"{text} ({percent:.3g} %)"


def _motion(result: Result, times: Sequence[str]) -> list[str]:
    """Return the free run by region of motion, for the channels whose gap is widest there."""
    if not result.motion:
        return []
    rows = []
    for channel in widest(result):
        for words, values in result.motion[channel].items():
            rows.append((channel, words, *(f"{values[t]:.3g}" if t in values else "-"
                                           for t in times)))  # fmt: skip
    return ["", "free run by region of motion, in sigma",
            text_table(("channel", "region", *times), rows)]  # fmt: skip


def widest(result: Result, most: int = 2) -> list[str]:
    """Return the channels whose free run exceeds its floor most."""

    def beyond(channel: str) -> float:
        parts = result.gap[channel].values()
        return max(v.get("free_before", 0.0) / max(v.get("free_floor", 1.0), 1e-9) for v in parts)

    return sorted(result.motion, key=beyond, reverse=True)[:most]

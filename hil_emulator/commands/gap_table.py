"""The gap as a table for the terminal: per channel, per balance, per region."""

from collections.abc import Sequence

from hil_emulator.commands.text_table import text_table
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.regions import Disagreement
from hil_emulator.identify.reporting import report_tables
from hil_emulator.identify.reporting.channel_errors import brackets, cell, titled


def gap_lines(result: Result) -> list[str]:
    """Return the lines on the size and place of the gap."""
    lines = [*balances("where", result.where)]
    if result.effects and result.remaining:
        lines += balances("remains", result.remaining)
    if not result.gap:
        return lines
    lines += ["", f"rms of measured less predicted; in brackets: {brackets(result)}"]
    lines += ["free run: 500 ms from filtered states"] * bool(result.motion)
    table = report_tables.gap(result)
    head = list(table.head)
    column = 0
    for title, width in table.groups:
        head[column] = f"{title}: {head[column]}" if title else head[column]
        column += width
    return [*lines, text_table(head, table.rows), *_motion(result)]


def balances(title: str, gaps: Sequence[Disagreement]) -> list[str]:
    """Return a line per balance, and one per region of it."""
    lines = []
    for d in gaps:
        lines.append(f"{title:9s} {d.place}")
        lines += [f"          {region}" for region in d.regions]
        title = ""
    return lines


def _motion(result: Result) -> list[str]:
    """Return the free run by region of motion, for the channels whose gap is widest there."""
    if not result.motion:
        return []
    times = ("before", "after", "floor") if result.effects else ("before", "floor")
    rows = [
        (titled(channel), region, *(cell(result, channel, errors, t) for t in times))
        for channel in widest(result) for region, errors in result.motion[channel].items()
    ]  # fmt: skip
    return ["", "free run by region of motion", text_table(("channel", "region", *times), rows)]


def widest(result: Result, most: int = 2) -> list[str]:
    """Return the channels whose free run exceeds its floor most."""

    def beyond(channel: str) -> float:
        parts = result.gap[channel].values()
        return max(v.get("free_before", 0.0) / max(v.get("free_floor", 1.0), 1e-9) for v in parts)

    return sorted(result.motion, key=beyond, reverse=True)[:most]

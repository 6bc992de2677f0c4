"""The tables of the page of a result."""

import math

from hil_emulator.identify.conclusion.findings import rounded
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.channel_errors import cell, number, titled
from hil_emulator.pages.render import Table

GAINS = ("better fit", "held out")
"""Columns of an effect's gain in chi-square, on training and on held-out data."""

TIMES = ("before", "after", "least_squares", "floor")


def effects(result: Result) -> Table:
    """Return the named effects."""
    rows: list[tuple[object, ...]] = []
    for f in result.effects:
        value, *ends = (rounded(v, f.unit, f.shown) for v in (f.value, *f.interval))
        low, high = map(_number, ends)
        flags = [f"its form differs: {f.form}"] if f.form_differs else []
        flags += [f"or {', '.join(f.group)}"] if f.group else []
        rows.append(
            (f.name, f.knob, _number(value), f"{low} ... {high}", _unit(value), f.share,
             f"{f.delta_chi2:.0f}", _held_out(f.held_out), "; ".join(flags))
        )  # fmt: skip
    head = ("effect", "parameter", "value", "95 % interval", "unit", "share", *GAINS, "caution")
    return _filled(Table(head, rows))


def _number(quantity: str) -> str:
    """Return the number of a quantity."""
    return quantity.partition(" ")[0]


def _unit(quantity: str) -> str:
    """Return the unit of a quantity; "" without one."""
    return quantity.partition(" ")[2]


def _filled(table: Table) -> Table:
    """Return a table without its last column where that is empty."""
    if any(row[-1] for row in table.rows):
        return table
    return Table(table.head[:-1], [row[:-1] for row in table.rows], table.groups)


def gap(result: Result) -> Table:
    """Return the gap by channel and part of the data."""
    free = any("free_before" in v for parts in result.gap.values() for v in parts.values())
    keys = {k for parts in result.gap.values() for v in parts.values() for k in v}
    times = tuple(t for t in TIMES if t in keys and (t != "after" or result.effects))
    kinds = ("", "free_") if free else ("",)
    rows: list[tuple[object, ...]] = [
        (titled(channel), _PARTS[part],
         *(cell(result, channel, values, f"{k}{t}") for k in kinds for t in times))
        for channel, parts in result.gap.items()
        for part, values in parts.items()
    ]  # fmt: skip
    titles = ("one step ahead", "free run") if free else ("root mean square",)
    groups = (("", 2), *((title, len(times)) for title in titles))
    names = tuple(t.replace("_", " ") for t in times)
    return Table(("channel", "data", *(names * len(kinds))), rows, groups)


_PARTS = {"training": "training", "validation": "held out"}


def motion(result: Result) -> Table:
    """Return the free run by region of motion: one row per region, channels side by side.

    Without multiples of the noise, which would make the table wider than the page.
    """
    times = ("before", "after", "floor") if result.effects else ("before", "floor")
    channels = [c for c in result.motion if c != "supply_pressure"]
    regions = list(dict.fromkeys(r for c in channels for r in result.motion[c]))
    rows: list[tuple[object, ...]] = []
    for region in regions:
        cells = [number(c, result.motion[c].get(region, {}), t) for c in channels for t in times]
        rows.append((region, *cells))
    groups = (("", 1), *((titled(c), len(times)) for c in channels))
    return Table(("region", *(times * len(channels))), rows, groups)


def ranking(result: Result) -> Table:
    """Return the candidates of every round, and the reason for or against each."""
    assert result.search is not None
    rows: list[tuple[object, ...]] = []
    named = {f.name for f in result.effects}
    for i, searched in enumerate(result.search.rounds):
        best = searched.trials[0].score.coordinate.name if searched.trials else ""
        for t in searched.trials:
            name, e = t.score.coordinate.name, t.evidence
            if searched.accepted and name == best:
                why = "named" if name in named else result.search.dropped.get(name, "")
            else:
                why = "; ".join(e.objections) or f"explains less than {best}"
                if name == best and not searched.accepted:
                    why = "; ".join(e.objections) or "a term of no catalogued form explains more"
            held = None if e.held_out != e.held_out else e.held_out
            clear = f"{math.sqrt(max(e.wald, 0.0)):.1f}"
            rows.append((i + 1, name, f"{e.delta_chi2:.0f}", clear, _held_out(held), why))
    head = ("round", "effect", GAINS[0], "signal to noise", GAINS[1], "why")
    return Table(head, rows)


def parameters(result: Result) -> Table:
    """Return the ordinary parameters, configured and refitted."""
    rows: list[tuple[object, ...]] = []
    for name, p in result.parameters.items():
        change = f"{100 * p.change:+.1f} %" if p.configured else ""
        configured, refitted, low, high = map(p.words, (p.configured, p.refitted, p.low, p.high))
        interval = f"{_number(low)} ... {_number(high)}"
        caution = "check it" if p.moved else ""
        title = p.called(name).replace("_", " ")
        rows.append((title, _number(configured), _number(refitted), interval,
                     _unit(refitted), change, caution))  # fmt: skip
    head = ("parameter", "configured", "refitted", "95 % interval", "unit", "change", "caution")
    return _filled(Table(head, rows))


def below_floor(result: Result) -> list[str]:
    """Return the channels whose error is below that of noise and disturbances."""
    return [
        channel.replace("_", " ")
        for channel, parts in result.gap.items()
        if any(
            values[f"{kind}{'after' if result.effects else 'before'}"] < values[f"{kind}floor"]
            for values in parts.values()
            for kind in ("", "free_")
            if f"{kind}floor" in values
        )
    ]


def _held_out(delta_chi2: float | None) -> str:
    return "no such data" if delta_chi2 is None else f"{delta_chi2:.0f}"

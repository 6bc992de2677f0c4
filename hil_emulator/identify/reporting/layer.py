"""The result as a layer of configuration that `run` takes after the original files."""

from collections.abc import Sequence
from pathlib import Path

from hil_emulator.identify.conclusion.findings import Finding, Refitted, rounded, shown_unit
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.experiment import FLOWS
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.reporting.channel_errors import Errors, number, titled
from hil_emulator.identify.selection.progress import Search
from hil_emulator.model import quantities
from hil_emulator.units import show

EFFECT_FILE = "unexplained.py"
"""File of an unexplained term, next to the layer that refers to it."""


def layer(result: Result, files: Sequence[Path], date: str) -> str:
    """Return TOML with the missing effects and the refitted ordinary parameters.

    Args:
        result: of the identification.
        files: the configuration that the data were compared with.
        date: of the identification.

    """
    lines = [f"# Identified on {date} against {', '.join(f.name for f in files)}."]
    for name, digest in result.digests.items():
        part = ", held out" if name in result.held_out else ""
        lines.append(f"# data {name} (sha256 {digest}){part}")
    lines += [f"# verdict: {result.verdict}: {line}" for line in result.reason.splitlines()]
    lines += _gaps(result)
    tables: dict[str, list[str]] = {}
    if result.added is not None:
        lines += ["", "[model]", f'effects = ["{EFFECT_FILE}"]']
        row = f"{result.added.name} = {{ factor = 1.0 }}   # {result.added.words}"
        tables.setdefault(result.added.table, []).append(row)
    if result.search is not None and result.search.reported is not None:
        for finding in result.effects:
            coordinate = next(c for c in result.search.effects if c.name == finding.name)
            row = _effect(result.search, coordinate, finding)
            if coordinate.channel in FLOWS:
                lines.append(f"# {coordinate.channel}, which only the bench meters: {row}")
                continue
            tables.setdefault(_table(coordinate), []).append(row)
        for coordinate, value in _refitted(result):
            refitted = None if result.added else result.parameters[coordinate.name]
            entry = _ordinary(coordinate, value, refitted)
            tables.setdefault(_table(coordinate), []).append(entry)
    for table, rows in tables.items():
        lines += ["", f"[{table}]", *rows]
    return "\n".join(lines) + "\n"


def _gaps(result: Result) -> list[str]:
    """Return the gap before and after, by channel and part of the data, as comments."""
    if not result.gap:
        return []
    free = any("free_before" in v for parts in result.gap.values() for v in parts.values())
    kinds = "one step ahead; free run of 500 ms" if free else "before -> after"
    lines = [f"# gap, root mean square: {kinds}"]
    for channel, parts in result.gap.items():
        for part, values in parts.items():
            gaps = [_gap(channel, values, k) for k in ("", "free_") if f"{k}before" in values]
            lines.append(f"# gap {titled(channel)}, {part}: {'; '.join(gaps)}")
    return lines


def _gap(channel: str, values: Errors, kind: str) -> str:
    before, after, floor = (
        number(channel, values, f"{kind}{when}") for when in ("before", "after", "floor")
    )
    return f"{before} -> {after or 'unknown'}" + (f" (floor {floor})" if floor else "")


def _table(coordinate: Coordinate) -> str:
    if coordinate.channel:
        return f"sensors.{coordinate.channel}"
    if coordinate.effect is not None:
        return coordinate.effect.stage.table
    return coordinate.field.partition("_")[0]


def quoted(value: float, unit: str, shown: str) -> str:
    """Return a value as the configuration writes it, in the unit that people use."""
    return f"{value:.6g}" if unit == "1" else f'"{show(value, unit, shown)}"'


def _effect(search: Search, coordinate: Coordinate, finding: Finding) -> str:
    assert coordinate.effect is not None
    assert search.reported is not None
    at = dict(zip([c.name for c in search.reported.coordinates], search.reported.at, strict=True))
    law = [f"{finding.knob} = {quoted(finding.value, finding.unit, finding.shown)}"]
    for shape in search.shapes:
        owner, _, name = shape.name.rpartition(".")
        if owner == coordinate.name:
            value = shape.value(float(at[shape.name]))
            law.append(f"{name} = {quoted(value, shape.unit, shown_unit(shape))}")
    low, high = (rounded(v, finding.unit, finding.shown) for v in finding.interval)
    return (
        f"{coordinate.effect.name} = {{ {', '.join(law)} }}"
        f"   # 95 %: {low} ... {high}; takes {finding.share} of the squared error"
    )


def _refitted(result: Result) -> list[tuple[Coordinate, float]]:
    assert result.search is not None
    pairs = zip(result.search.nuisances, result.final_at, strict=False)
    return [(c, float(c.value(float(a)))) for c, a in pairs if abs(float(a)) > 1e-3]


def _estimate(refitted: Refitted) -> str:
    """Return the configured value, after the estimate if that is shown as a data sheet's."""
    configured = f"configured {refitted.words(refitted.configured)}"
    if refitted.sheet is None:
        return f"ordinary parameter, {configured}"
    return f"{refitted.sheet.name} {refitted.words(refitted.refitted)}, {configured}"


def _ordinary(coordinate: Coordinate, value: float, refitted: Refitted | None) -> str:
    unit, shown = coordinate.unit, shown_unit(coordinate)
    text = f"   # ordinary parameter, configured {show(coordinate.neutral, unit, shown)}"
    if refitted is not None:
        text = f"   # {_estimate(refitted)}, 95 %: {refitted.words(refitted.low)} ... "
        text += refitted.words(refitted.high)
    if coordinate.effect is not None:
        name = coordinate.field.removeprefix(f"{coordinate.effect.name}_")
        return f"{coordinate.effect.name}.{name} = {quoted(value, unit, shown)}{text}"
    table = coordinate.field.partition("_")[0]
    assert table in quantities.PARAMS
    return f"{coordinate.field[len(table) + 1 :]} = {quoted(value, unit, shown)}{text}"

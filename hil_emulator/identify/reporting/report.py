"""One self-contained HTML page of a result: the verdict first, then what supports it."""

from collections.abc import Sequence
from typing import Any

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.regions import Disagreement, Region
from hil_emulator.identify.reporting import charts, pictures, report_tables
from hil_emulator.identify.reporting.channel_errors import brackets
from hil_emulator.identify.reporting.headline import headline
from hil_emulator.identify.reporting.next_steps import next_steps
from hil_emulator.pages.render import render

_WORDS = {
    "missing_effects": "Missing", "nothing_missing": "Nothing is missing",
    "unknown_effect": "Something unknown is missing", "cannot_examine": "Cannot be examined",
    "wrong_value": "A value of the configuration is wrong", "cannot_tell": "The data do not decide",
    "agrees": "Model and measurement agree", "disagrees": "Model and measurement disagree",
}  # fmt: skip

_SETTLED = ("missing_effects", "nothing_missing", "wrong_value", "agrees")
"""Verdicts that leave nothing open."""


def report(result: Result, title: str, made: str = "") -> str:
    """Return the page.

    Args:
        result: of the identification.
        title: of the page.
        made: date and command, for the provenance.

    """
    return render(
        "identify.html",
        title=title,
        made=made,
        result=result,
        verdict=_WORDS[result.verdict],
        settled=result.verdict in _SETTLED,
        sentences=headline(result),
        steps=next_steps(result),
        **_where(result),
        **_found(result),
        **_size(result),
        **_reasons(result),
        **_model(result),
    )


def _where(result: Result) -> dict[str, Any]:
    """Return where the gap is: the widest trace, balances and regions, maps of the balances."""
    if not result.traces:
        return {"trace": b""}
    both = bool(result.effects)
    return {
        "trace": pictures.trace(result, pictures.widest_trace(result)),
        "where": _places(result.where),
        "remaining": _places(result.remaining) if both else [],
        "maps": [(m.balance, m.regressor, pictures.balance(m, both)) for m in result.maps],
    }


def _places(gaps: Sequence[Disagreement]) -> list[tuple[str, tuple[Region, ...]]]:
    """Return the balance and the regions of each gap."""
    return [(d.place, d.regions) for d in gaps]


def _found(result: Result) -> dict[str, Any]:
    """Return the missing effects, and the strongest unexplained term."""
    searched = result.verdict not in ("agrees", "disagrees")
    unknown = sorted(result.unknown, key=lambda u: -u.statistic) if searched else []
    return {
        "effects": report_tables.effects(result),
        "sizes": charts.sizes(result) if any(f.by_experiment for f in result.effects) else b"",
        "unknown": [(u.balance, u.regressor, u.shape, f"{u.statistic:.0f}") for u in unknown],
        "term": pictures.term(unknown[0]) if unknown else b"",
    }


def _size(result: Result) -> dict[str, Any]:
    """Return the gap by channel, and by region of motion where there are free runs."""
    return {
        "gap": report_tables.gap(result),
        "brackets": brackets(result),
        "below_floor": report_tables.below_floor(result),
        "gap_chart": charts.gap(result) if len(result.gap) > 1 else b"",
        "motion": report_tables.motion(result) if result.motion else None,
    }


def _reasons(result: Result) -> dict[str, Any]:
    """Return ranking, rivals and ladder, if effects were compared."""
    search = result.search
    if search is None or not search.rounds or not search.rounds[0].scores:
        return {"ranking_chart": b""}
    return {
        "ranking_chart": charts.ranking(result),
        "ranking": report_tables.ranking(result),
        "ladder": charts.ladder(result) if len(result.ladder) > 1 else b"",
    }


def _model(result: Result) -> dict[str, Any]:
    """Return the ordinary parameters, and the correlations of all fitted parameters."""
    final = result.search.reported if result.search else None
    several = result.parameters and final is not None and len(final.coordinates) > 1
    return {
        "parameters": report_tables.parameters(result),
        "correlations": charts.correlations(result) if several else b"",
    }

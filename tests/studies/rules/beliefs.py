"""Influence of the prior sizes that separate another law from something unknown.

    python -m tests.studies.rules.beliefs --out beliefs.jsonl --each 6
    python -m tests.studies.rules.beliefs --out beliefs.jsonl --each 6 --report

Each case is searched once, and judged with every belief as it is, smaller and larger. Cases are
those of the ablation; answers are kept in the file of `--out`, and the same command goes on where
it was stopped.
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.config.load import load
from hil_emulator.identify import session
from hil_emulator.identify.selection import discrepancies
from hil_emulator.identify.selection.discrepancies import Discrepancies
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.search import Searcher
from tests.identify.rig_data import CACHE
from tests.studies.generator.cases import Case, campaign
from tests.studies.rules.ablation import FAMILIES, PLAIN, drawn
from tests.studies.rules.rules import changed

SIZES = ("LAW_ERROR_SIZES", "VARIANCE_SHARES", "SMOOTH", "LAW_TOLERANCE", "NOTICEABLE")
"""What is tried a tenth and ten times as large."""

AS_IT_IS = "as it is"


def variations() -> dict[str, dict[str, Any]]:
    """Return the tried values of constants, by a name."""
    tried: dict[str, dict[str, Any]] = {AS_IT_IS: {}}
    for name in SIZES:
        for word, factor in (("a tenth of ", 0.1), ("ten times ", 10.0)):
            tried[word + name] = {f"discrepancies.{name}": _times(name, factor)}
    return tried


def _times(name: str, factor: float) -> Any:
    value = getattr(discrepancies, name)
    return tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value


def judged(which: Case) -> dict[str, list[str]]:
    """Return the flags in a case, by variation: effects, and "unknown"."""
    flags: dict[str, list[str]] = {}
    assess = Searcher._assess_discrepancies

    def every(searcher: Searcher, search: Search) -> Discrepancies:
        base = search.rounds[-1].base
        held = searcher._held_out(base)
        elsewhere = None if held is None else searcher.fitter.linearised(base, held)
        for name, values in variations().items():
            with changed(values):
                weighed_there = Discrepancies(searcher.fitter, base, search.effects, elsewhere)
                flags[name] = [
                    *weighed_there.other_laws(),
                    *["unknown"] * bool(weighed_there.unknown()),
                ]
        return assess(searcher, search)

    learn, check = campaign(which)
    with changed({**PLAIN, "search.Searcher._assess_discrepancies": every}):
        session.identify(load([which.bench.config]), learn, check, cache=CACHE)
    return flags


def report(rows: Mapping[str, Mapping[str, list[str]]]) -> str:
    """Return the table, as Markdown."""
    catalogued = [name for name in rows if name.startswith(("none", "medium", "pairs"))]
    outside = [name for name in rows if name.startswith("outside")]
    lines = [
        f"| belief | other verdicts in {len(rows)} | flagged of {len(catalogued)} without reason "
        f"| of {len(outside)} unknown effects flagged |", "|---|---|---|---|",
    ]  # fmt: skip
    for belief in variations():
        other = sum(
            flags_of_case[belief] != flags_of_case[AS_IT_IS] for flags_of_case in rows.values()
        )
        flags, outside_flags = (
            [bool(rows[name][belief]) for name in names] for names in (catalogued, outside)
        )
        lines.append(f"| {belief} | {other} | {sum(flags)} | {sum(outside_flags)} |")
    return "\n".join(lines)


def main() -> None:
    """Judge the cases and print the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path("beliefs.jsonl"))
    options.add_argument("--each", type=int, default=6, help="cases of each family")
    options.add_argument("--families", nargs="*", choices=FAMILIES, default=FAMILIES)
    options.add_argument("--report", action="store_true", help="only print what the file has")
    chosen = options.parse_args()
    lines = chosen.out.read_text().splitlines() if chosen.out.exists() else []
    rows = dict(map(json.loads, lines))
    for which in [] if chosen.report else drawn(chosen.each, chosen.families):
        if which.name not in rows:
            rows[which.name] = judged(which)
            with chosen.out.open("a") as stream:
                stream.write(json.dumps([which.name, rows[which.name]]) + "\n")
            print(which.name, *rows[which.name][AS_IT_IS], flush=True)
    print(report(rows))


if __name__ == "__main__":
    main()

"""What hangs on the beliefs by which another law is told from something unknown.

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

SIZES = ("OWN_SIZES", "SHARES", "SMOOTH", "INEXACT", "NOTICEABLE")
"""What is tried a tenth and ten times as large."""

AS_IT_IS = "as it is"


def variations() -> dict[str, dict[str, Any]]:
    """Return what is tried: values of constants, by a name."""
    found: dict[str, dict[str, Any]] = {AS_IT_IS: {}}
    for name in SIZES:
        for word, factor in (("a tenth of ", 0.1), ("ten times ", 10.0)):
            found[word + name] = {f"discrepancies.{name}": _times(name, factor)}
    return found


def _times(name: str, factor: float) -> Any:
    own = getattr(discrepancies, name)
    return tuple(factor * v for v in own) if isinstance(own, tuple) else factor * own


def judged(which: Case) -> dict[str, list[str]]:
    """Return what is flagged in a case, by variation: effects, and "unknown"."""
    said: dict[str, list[str]] = {}
    weighed = Searcher._weighed

    def every(own: Searcher, search: Search) -> Discrepancies:
        base = search.rounds[-1].base
        held = own._held_out(base)
        elsewhere = None if held is None else own.fitter.elsewhere(base, held)
        for name, values in variations().items():
            with changed(values):
                found = Discrepancies(own.fitter, base, search.effects, elsewhere)
                said[name] = [*found.other_laws(), *["unknown"] * bool(found.unknown())]
        return weighed(own, search)

    learn, check = campaign(which)
    with changed({**PLAIN, "search.Searcher._weighed": every}):
        session.identify(load([which.bench.config]), learn, check, cache=CACHE)
    return said


def report(rows: Mapping[str, Mapping[str, list[str]]]) -> str:
    """Return the table, as Markdown."""
    own = [name for name in rows if name.startswith(("none", "medium", "pairs"))]
    outside = [name for name in rows if name.startswith("outside")]
    lines = [
        f"| belief | other verdicts in {len(rows)} | flagged of {len(own)} without reason "
        f"| of {len(outside)} unknown effects flagged |", "|---|---|---|---|",
    ]  # fmt: skip
    for belief in variations():
        other = sum(said[belief] != said[AS_IT_IS] for said in rows.values())
        flags, seen = ([bool(rows[name][belief]) for name in names] for names in (own, outside))
        lines.append(f"| {belief} | {other} | {sum(flags)} | {sum(seen)} |")
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

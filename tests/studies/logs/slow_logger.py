"""A logger slower than the controller: `python -m tests.studies.logs.slow_logger [CASE ...]`.

A controller sets the current at 1 kHz, and a logger keeps some of the rows; with `--held`, the
controller is as slow as the logger. A healthy machine and one with an effect hidden in it.
"""

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, PERIOD, campaign, knee, thinned

RATES = (50, 100, 200, 500, 1000)


@dataclass(frozen=True)
class Case:
    """A machine.

    Attributes:
        effect: the name of what it has and its configuration lacks; "" for nothing.
        changes: of the plant's parameters.
        seed: of the campaign.

    """

    effect: str = ""
    changes: Mapping[str, float] | None = None
    seed: int = 1


CASES = {
    "healthy-1": Case(),
    "healthy-2": Case(seed=11),
    "leakage": Case("internal_leakage", {"internal_leakage_conductance": 1e-13}),
    "stribeck": Case("stribeck_friction", {"stribeck_friction_excess": 40.0}),
    "delay": Case("transport_delay", {"transport_delay_time": 1.5e-3}),
}


def logged(case: Case, rate: int, held: bool = False) -> Result:
    """Identify a machine from logs at a rate [Hz]."""
    every = round(1.0 / (PERIOD * rate))
    made = campaign(case.changes or {}, case.seed, ticks=every if held else 1)
    learn, check = ([thinned(e, every) for e in part] for part in made)
    return identify(knee(), learn, check, cache=CACHE)


def sort_of(result: Result, effect: str) -> str:
    """Return whether an answer is right, undecided, or wrong."""
    if result.verdict in ("cannot_tell", "cannot_examine"):
        return "open"
    right = [f.name for f in result.effects] == [effect] * bool(effect) and not result.unknown
    return "right" if right and result.verdict != "unknown_effect" else "WRONG"


def main() -> None:
    """Print a line per machine and rate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES))
    parser.add_argument("--rate", type=int, nargs="+", default=RATES)
    parser.add_argument("--held", action="store_true")
    chosen = parser.parse_args()
    for name in chosen.cases:
        for rate in chosen.rate:
            begun = time.monotonic()
            result = logged(CASES[name], rate, chosen.held)
            words = "; ".join(str(f) for f in result.effects) or result.reason
            print(
                f"{name:10s} {rate:5d} Hz  {sort_of(result, CASES[name].effect):6s} "
                f"{result.verdict:16s} {time.monotonic() - begun:4.0f} s  {words}",
                flush=True,
            )


if __name__ == "__main__":
    main()

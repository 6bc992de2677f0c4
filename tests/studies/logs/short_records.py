"""Short records of healthy machines: `python -m tests.studies.logs.short_records [SECONDS ...]`.

Nothing is hidden in them, but a null that drifts as usual: whatever is missing is chance. Some lack
their beginning,
as where a logger is switched on while the rod moves.
"""

import argparse
from dataclasses import replace
from unittest.mock import patch

from hil_emulator.identify.conclusion import record_limits
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, knee, recorded

KINDS = ("steps", "multisine", "triangles")
CUT = 0.15
"""Seconds that the logger misses in every other record."""


def short(kind: str, seed: int, seconds: float) -> Experiment:
    """Return a record that begins at rest, or in motion where the seed is odd."""
    first = round(CUT / 1e-3) if seed % 2 else 0
    e = recorded({}, kind, seed, seconds + first * 1e-3)
    readings = {n: v[first:] for n, v in e.readings.items()}
    return replace(e, current=e.current[first:], readings=readings)


def main() -> None:
    """Print what each machine would be reported to lack without the rule."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seconds", nargs="*", type=float, default=[0.5, 1.0, 1.5, 2.0, 4.0])
    parser.add_argument("--seeds", type=int, default=4)
    given = parser.parse_args()
    for seconds in given.seconds:
        wrong = []
        for kind in KINDS:
            for seed in range(given.seeds):
                with patch.object(record_limits, "SHORTEST", 0.0):
                    result = identify(knee(), [short(kind, seed, seconds)], cache=CACHE)
                if result.verdict in ("missing_effects", "unknown_effect"):
                    wrong.append(f"{kind} {seed}: {result.reason[:90]}")
        count = len(KINDS) * given.seeds
        print(f"{seconds:g} s: {len(wrong)} of {count} wrong", *wrong, sep="\n  ", flush=True)


if __name__ == "__main__":
    main()

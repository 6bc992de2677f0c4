"""A healthy machine's logs after accidents: `python -m tests.studies.logs.accidents --count 1000`.

Each is read and checked; of those that are accepted every so many is identified. Nothing is hidden
in them: a name is a wrong one.
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.identify.data_checks.consistency import DRIVEN, travel, without_contradictions
from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.data_checks.shared_noise import counted
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, knee, knee_model
from tests.studies.logs.mutations import mutated


def judged(file: Path) -> str:
    """Read a log and check it; return how far it came."""
    try:
        read = load_experiments([file])
    except UserError as error:
        return "refused" if file.name in str(error) else str(error)
    assert all(len(v) in (0, e.samples) for e in read for v in (e.current, *e.readings.values()))
    sound = without_contradictions(*counted(read, []), knee_model().plant_values)
    assert all(note.startswith("left out: ") for note in sound.left_out)
    moving = [e for e in sound.training if travel(e) >= DRIVEN]
    return "contradicts" if contradictions(moving, knee_model().plant_values) else "accepted"


def main() -> None:
    """Print the fates, and every name."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--identify-every", type=int, default=10, help="of the accepted")
    given = parser.parse_args()
    fates: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.first, given.first + given.count):
            file = mutated(Path(folder) / f"log{seed}.csv", seed)
            fate = judged(file)
            fates[fate] += 1
            if fate == "accepted" and fates[fate] % given.identify_every == 0:
                result = identify(knee(), load_experiments([file]), cache=CACHE)
                names = ", ".join(f.name for f in result.effects)
                fates[f"identified: {result.verdict}"] += 1
                print(f"{file.name}: {result.verdict} {names}", flush=True)
            file.unlink()
    for fate, count in sorted(fates.items()):
        print(f"{count:6d}  {fate}")


if __name__ == "__main__":
    main()

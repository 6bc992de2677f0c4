"""The cases of the blind test: which machine, which effects, how dirty, how long.

A case is drawn from its name alone, so that any subset of the study repeats the whole.
"""

import math
import zlib
from argparse import ArgumentTypeError
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Experiment
from tests.studies.generator.bench import TRAINING, VALIDATION, record
from tests.studies.generator.benches import BENCHES, FIRST, Bench
from tests.studies.generator.effects import EFFECTS, OUTSIDE, size_on
from tests.studies.generator.plant import Machine

SPREAD = {
    "kv": 0.1, "wv": 0.1, "zv": 0.15, "va": 0.1, "vb": 0.1, "beta": 0.15, "mass": 0.02,
    "viscous": 0.4, "coulomb": 0.4, "load_viscous": 0.4, "clearance": 0.3, "air": 0.3,
}  # fmt: skip
"""Relative deviation of a real machine from its data sheet, one standard deviation."""

FARTHEST = 0.5
"""Largest relative deviation."""

RIPPLE = 0.03
"""Share of the friction that changes along the stroke with the seals' lay."""

WIDE = 10
"""One case of so many has ordinary parameters up to four deviations off."""

UNSTATED = {"creep": (0.15, 7.0), "shear": (2e-6, 2e-4), "slip_speed": (2e-4, 1e-2)}
"""From where to where strangers have what no sheet states, evenly in the logarithm: as slots of
0.1 to 0.5 mm and oils VG 15 to 100 at 20 to 60 °C, and as seals from PTFE to rubber."""

LONG = 60.0
"""Time within which a machine has been running when an experiment begins [s]."""

KINDS = (*TRAINING, *VALIDATION)
"""Of the experiments, in their order."""

DIRTY = 3
"""One case of so many is recorded on a dirty bench."""

GROUPS = {
    "medium": 42, "small": 42, "tiny": 21, "foreign": 42, "pairs": 21, "triples": 12,
    "foreign-pairs": 14, "none": 20, "outside": 18,
}  # fmt: skip
"""Cases of each kind in the whole study."""


@dataclass(frozen=True)
class Case:
    """One machine with what is hidden in it.

    Attributes:
        name: group and number, and the bench where it is not the first one: "medium-07@axis".
        effects: sizes by key, SI.
        wide: ordinary parameters up to four deviations off.
        dirty: recorded on a dirty bench.
        duration: of each experiment [s], over the slowness of its bench.

    """

    name: str
    effects: Mapping[str, float]
    wide: bool
    dirty: bool
    duration: float

    @property
    def group(self) -> str:
        """Kind of question."""
        return self.name.rpartition("-")[0]

    @property
    def bench(self) -> Bench:
        """The bench on which it is recorded."""
        return BENCHES[self.name.partition("@")[2]]

    @property
    def foreign(self) -> bool:
        """Whether the effects follow foreign laws."""
        return self.group.startswith("foreign")


def seed(name: str) -> int:
    """Return the seed that belongs to a name."""
    return zlib.crc32(name.encode())


def case(group: str, number: int, duration: float | None = None, bench: Bench = FIRST) -> Case:
    """Return one case.

    Args:
        group: a key of `GROUPS`.
        number: from 0.
        duration: of each experiment [s]; drawn between 2 and 4 s if None.
        bench: on which it is recorded.

    """
    name = f"{group}-{number:02d}" + (f"@{bench.name}" if bench.name else "")
    random = np.random.default_rng(seed(name))
    drawn = round(float(random.uniform(2.0, 4.0)), 1)
    scales = bench.over(FIRST)
    effects = {key: _size(group, key, random) * size_on(key, scales)
               for key in _keys(group, number)}  # fmt: skip
    return Case(name, effects, number % WIDE == 7, number % DIRTY == 2, duration or drawn)


def _keys(group: str, number: int) -> list[str]:
    """Return what is hidden: every effect in turn, companions at changing distances."""
    catalogued, foreign = list(EFFECTS), list(OUTSIDE)
    if group == "none":
        return []
    if group == "outside":
        return [foreign[number % len(foreign)]]
    count = {"pairs": 2, "triples": 3, "foreign-pairs": 2}.get(group, 1)
    stride = 1 if count == 1 else 5 + 3 * (number // len(catalogued))
    first = number * (3 if group == "foreign-pairs" else 1)
    return [catalogued[(first + i * stride) % len(catalogued)] for i in range(count)]


def _size(group: str, key: str, random: np.random.Generator) -> float:
    about, sense = random.uniform(0.8, 1.25), random.choice([-1.0, 1.0])
    if key in OUTSIDE:
        return float(OUTSIDE[key] * about)
    share = {"small": 1 / 3, "tiny": math.exp(random.uniform(math.log(1 / 30), math.log(1 / 9)))}
    size = EFFECTS[key].medium * about * share.get(group, 1.0)
    return float(size * sense if EFFECTS[key].signed else size)


def machine(which: Case) -> Machine:
    """Return the real machine of a case."""
    random = np.random.default_rng(seed(which.name) + 1)
    reach = 4.0 if which.wide else 1.05
    off = {n: np.clip(s * reach * random.uniform(-1.0, 1.0), -FARTHEST, FARTHEST)
           for n, s in SPREAD.items()}  # fmt: skip
    sheet = which.bench.sheet
    ordinary = {n: float(v * (1.0 + off.get(n, 0.0))) for n, v in sheet.items()}
    if which.bench.strange:
        ordinary |= stranger(np.random.default_rng(seed(which.name) + 3))
    ripple = RIPPLE * (3.0 if which.dirty else 1.0)
    hidden = {k: v for k, v in which.effects.items() if k in Machine._fields}
    return Machine(**ordinary, ripple=ripple, foreign=which.foreign, **hidden)


def stranger(random: np.random.Generator) -> dict[str, float]:
    """Return the forms of a maker's base laws, and numbers that its sheets do not state."""
    forms = {name: int(random.integers(3)) for name in ("edge_form", "oil_form", "dry_form")}
    numbers = {name: float(np.exp(random.uniform(np.log(low), np.log(high))))
               for name, (low, high) in UNSTATED.items()}  # fmt: skip
    lag = float(random.choice([0.0, 0.0, random.uniform(1e-4, 4e-4)]))
    return forms | numbers | {"motor_lag": lag}


def recording(which: Case, kind: str) -> Experiment:
    """Return one experiment, of some kind."""
    at, effects = KINDS.index(kind), dict(which.effects)
    since = np.random.default_rng(seed(which.name) + 2).uniform(0.0, LONG, len(KINDS))
    real = machine(which)._replace(since=float(since[at]))
    duration = which.duration * which.bench.slowness
    return record(
        real, effects, kind, (seed(which.name), at), duration, which.dirty, bench=which.bench
    )


def campaign(which: Case) -> tuple[list[Experiment], list[Experiment]]:
    """Return four experiments for training and three of other kinds for validation."""
    learn, check = ([recording(which, kind) for kind in kinds] for kinds in (TRAINING, VALIDATION))
    return learn, check


def cases(
    counts: Mapping[str, int], duration: float | None = None, bench: Bench = FIRST
) -> Iterator[Case]:  # fmt: skip
    """Yield so many cases of each group."""
    for group, count in counts.items():
        for number in range(count):
            yield case(group, number, duration, bench)


def short_cases(name: str) -> list[Case]:
    """Return the cases of a word of the command line, with experiments of 2 s."""
    return list(cases_called(name, 2.0))


def cases_called(name: str, duration: float | None = None) -> Iterator[Case]:
    """Yield the case of a name, or several: "none-600:20@axis" are twenty from number 600 on.

    Raises:
        ArgumentTypeError: if there is no such group or bench, or a number is wrong.

    """
    case_name, _, bench = name.partition("@")
    group, _, numbers = case_name.rpartition("-")
    first, _, count = numbers.partition(":")
    if group not in GROUPS or bench not in BENCHES:
        available = f"groups are {', '.join(GROUPS)}; benches {', '.join(filter(None, BENCHES))}"
        raise ArgumentTypeError(f"{name}: no such cases; {available}")
    if not first.isdigit() or not (count or "1").isdigit():
        raise ArgumentTypeError(
            f"{name}: wrong number; write 600, or a first one and how many: 600:20"
        )
    for number in range(int(first), int(first) + int(count or 1)):
        yield case(group, number, duration, BENCHES[bench])

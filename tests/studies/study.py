"""Hide effects in the independent plant, identify them, and count the right answers.

    python -m tests.studies.study --out study.jsonl --jobs 2
    python -m tests.studies.study --out study.jsonl --cases none:6,medium:20 --duration 2
    python -m tests.studies.study --out study.jsonl --cases medium:20 --method open-loop
    python -m tests.studies.study --out study.jsonl --cases medium:20 --bench axis
    python -m tests.studies.study --out study.jsonl --report
    python -m tests.studies.study --out study.jsonl --against tests/studies/kept/knee.jsonl.xz

Finished cases are kept in the file of `--out`; the same command goes on where it was stopped.
"""

import argparse
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from hil_emulator.config.load import load
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import Question, identify
from tests.identify.rig_data import CACHE
from tests.studies.answer import Answer, from_dict, from_result
from tests.studies.answer_file import append, rows
from tests.studies.baselines import methods
from tests.studies.generator.benches import BENCHES, FIRST
from tests.studies.generator.cases import GROUPS, Case, campaign, case, cases
from tests.studies.generator.effects import EFFECTS
from tests.studies.scoring import Outcome, judge
from tests.studies.tables import changed, compared, described, failed, report


def examine(
    which: Case, exclude: Sequence[str] = (), backwards: bool = False,
    set_points: SetPoints = "unknown",
) -> Answer:  # fmt: skip
    """Examine one case with the product.

    Args:
        which: the case.
        exclude: entries that are deleted from the catalogue.
        backwards: whether the held-out data run backwards in time.
        set_points: stated course of the current between the rows.

    """
    train, other = campaign(which)
    if backwards:
        other = [turned(e) for e in other]
    start = time.monotonic()
    machine = load([which.bench.config])
    question = Question(exclude=exclude, set_points=set_points)
    result = identify(machine, train, other, question, cache=CACHE)
    return from_result(result, time.monotonic() - start)


def deleted(which: Case) -> Answer:
    """Ask with the true entries deleted from the catalogue: a negative control."""
    return examine(which, exclude=[EFFECTS[k].name for k in which.effects if k in EFFECTS])


def reversed_time(which: Case) -> Answer:
    """Ask with held-out data that run backwards, which no law survives: a negative control."""
    return examine(which, backwards=True)


def turned(e: Experiment) -> Experiment:
    """Return an experiment backwards in time."""
    readings = {name: values[::-1].copy() for name, values in e.readings.items()}
    return replace(e, current=e.current[::-1].copy(), readings=readings)


METHODS: dict[str, Callable[[Case], Answer]] = {
    "product": examine, "deleted": deleted, "reversed": reversed_time,
    "open-loop": methods.open_loop, "shooting": methods.multiple_shooting,
    "equation-error": methods.equation_error, "stlsq": methods.stlsq,
}  # fmt: skip
"""What can be asked, by name: the product, two negative controls, and the baselines."""


def asked(which: Case, method: str) -> tuple[Case, Answer]:
    """Ask one method about one case; for a process of a pool."""
    return which, METHODS[method](which)


def kept(file: Path, method: str, duration: float | None) -> dict[str, Answer]:
    """Return the answers that a file has already."""
    return {r["case"]: from_dict(r["answer"]) for r in rows(file)
            if r["method"] == method and r["duration"] == duration}  # fmt: skip


def keep(file: Path, method: str, duration: float | None, name: str, answer: Answer) -> None:
    """Append one answer to a file."""
    append(file, {"case": name, "method": method, "duration": duration, "answer": answer.to_dict()})


def counts(text: str) -> Mapping[str, int]:
    """Return the numbers of cases in `none:20,medium:40`; the whole study if empty."""
    if not text:
        return GROUPS
    parts = [part.partition(":") for part in text.split(",")]
    unknown = [group for group, _, _ in parts if group not in GROUPS]
    if unknown:
        raise SystemExit(f"no such group: {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    return {group: int(number) if number else GROUPS[group] for group, _, number in parts}


def answered(wanted: Iterable[Case], method: str, jobs: int) -> Iterator[tuple[Case, Answer]]:
    """Yield cases with their answers as they come."""
    if jobs <= 1:
        for which in wanted:
            yield asked(which, method)
        return
    with ProcessPoolExecutor(jobs) as pool:
        for future in as_completed([pool.submit(asked, which, method) for which in wanted]):
            yield future.result()


def line(outcome: Outcome) -> str:
    """Return one case in a line."""
    names = [n.name + ("*" if n.form_differs else "") for n in outcome.answer.named]
    places = [f"?{balance} by {regressor}" for balance, regressor in outcome.answer.unknown[:1]]
    return (
        f"{outcome.case.name:17s} {', '.join(outcome.case.effects) or 'nothing':44s} "
        f"{'FAILED' if failed(outcome) else 'good':7s} {', '.join(names + places) or 'nothing'} "
        f"({outcome.answer.seconds:.0f} s)"
    )


def run(file: Path, chosen: list[Case], method: str, jobs: int, duration: float | None) -> None:
    """Ask about every case that is not in the file."""
    done = kept(file, method, duration)
    rest = [c for c in chosen if c.name not in done]
    rest.sort(key=lambda c: c.name.partition("@")[0][-2:])
    for which, answer in answered(rest, method, jobs):
        keep(file, method, duration, which.name, answer)
        print(line(judge(which, answer)), flush=True)


def main() -> None:
    """Run the study and print its tables."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path("study.jsonl"))
    options.add_argument("--cases", default="", help="none:20,medium:40; empty for the whole")
    options.add_argument("--case", nargs="*", default=[], help="single cases, like medium-07")
    options.add_argument("--bench", choices=BENCHES, default=FIRST.name, help="'' is the knee")
    options.add_argument("--method", choices=METHODS, default="product")
    options.add_argument("--duration", type=float, default=None, help="of each experiment [s]")
    options.add_argument("--jobs", type=int, default=1, help="processes")
    options.add_argument("--report", action="store_true", help="only print what the file has")
    options.add_argument("--against", type=Path, help="list cases that another file has otherwise")
    chosen = options.parse_args()
    bench = BENCHES[chosen.bench]
    if chosen.case:
        named = [name.rpartition("-") for name in chosen.case]
        wanted = [case(group, int(number), chosen.duration, bench) for group, _, number in named]
    else:
        wanted = list(cases(counts(chosen.cases), chosen.duration, bench))
    if not chosen.report:
        run(chosen.out, wanted, chosen.method, chosen.jobs, chosen.duration)
    done = kept(chosen.out, chosen.method, chosen.duration)
    outcomes = [judge(c, done[c.name]) for c in wanted if c.name in done]
    if chosen.case:
        print("\n".join(line for o in outcomes for line in described(o)))
    if outcomes:
        print(report(outcomes, chosen.method))
    if chosen.against:
        before = kept(chosen.against, chosen.method, chosen.duration)
        print(changed([(o, judge(o.case, before[o.case.name]))
                       for o in outcomes if o.case.name in before]))  # fmt: skip
    by_method = {m: answers for m in METHODS if (answers := kept(chosen.out, m, chosen.duration))}
    if len(by_method) > 1:
        judged = {m: [judge(c, answers[c.name]) for c in wanted if c.name in answers]
                  for m, answers in by_method.items()}  # fmt: skip
        print(compared(judged))


if __name__ == "__main__":
    main()

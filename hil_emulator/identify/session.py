"""The whole workflow as one function: experiments and a configuration in, a result out."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.identify import account, parameters, plausible, static
from hil_emulator.identify.confusion import confirmed, rivals_of, weighed
from hil_emulator.identify.contest import Trial
from hil_emulator.identify.copies import counted
from hil_emulator.identify.experiment import FLOW, Experiment
from hil_emulator.identify.flow_bench import PRIORS as FLOW_PRIORS
from hil_emulator.identify.flow_bench import FlowBench, flow_bench
from hil_emulator.identify.flow_bench import examinable as flow_examinable
from hil_emulator.identify.next_experiment import recommend
from hil_emulator.identify.observer import Observer
from hil_emulator.identify.predictor import Predictor
from hil_emulator.identify.result import Finding, Result, Rival, Unexplained, in_words
from hil_emulator.identify.search import Search, Searcher
from hil_emulator.identify.twin import Coordinate, Twin
from hil_emulator.identify.valve_bench import VOLUME_PRIORS, ValveBench, bench
from hil_emulator.model.sensors import CHANNELS

DRIVEN = 0.2e-3
"""Least travel of a rod that was moved at all [m] (assumed)."""

SLOWEST = 5e-3
"""Longest sample period that shows a hydraulic mode of some 50 Hz [s]."""

Tell = Callable[[str], None]


def identify(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment] = (),
    only: Sequence[str] = (), exclude: Sequence[str] = (), jobs: int = 1,
    tell: Tell = lambda _: None, cache: Path | None = None, search: bool = True,
) -> Result:  # fmt: skip
    """Find what a configuration lacks.

    Args:
        config: what should describe the machine.
        training: experiments for the fit.
        validation: experiments for the gate; without any, the last third of the training
            experiments is held out if there are at least three.
        only: effects that may be named; empty for all.
        exclude: effects that may not.
        jobs: threads.
        tell: takes progress in words.
        cache: folder for compiled models.
        search: False measures the gap after refitting ordinary parameters, and names nothing.

    Raises:
        UserError: if an effect is unknown.

    """
    twin = Twin(config, cache)
    learn, check = counted(*_split(training, validation))
    notes = [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    predictor, learn, check, why = _predictor(twin, learn, check)
    if predictor is None:
        return Result("cannot_examine", why, notes=notes)
    notes = [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    twin = predictor.twin
    candidates = _chosen(_candidates(twin, predictor), only, exclude)
    nuisances = parameters.ordinary(twin, _priors(predictor))
    searcher = Searcher(predictor, learn, check, candidates, nuisances, jobs, tell)
    try:
        found = searcher.run() if search else searcher.look()
    except KeyboardInterrupt:
        tell("interrupted: concluding from what is known so far")
        return _so_far(searcher, notes, {e.name: e.digest for e in (*learn, *check)})
    result = conclude(searcher, found)
    if not search:
        account.judge(result)
    result.notes = notes
    result.digests = {e.name: e.digest for e in (*learn, *check)}
    hidden = {c.name for c in parameters.candidates(twin, twin.names)}
    result.unseen = sorted(result.unseen + list(hidden - {c.name for c in candidates}))
    if only or exclude:
        barred = hidden - {c.name for c in candidates}
        result.unseen = [name for name in result.unseen if name not in barred]
    return result


def _so_far(searcher: Searcher, notes: list[str], digests: dict[str, str]) -> Result:
    """Return the result of a search that the user ended."""
    found = searcher.stopped()
    if not found.rounds:
        why = "interrupted before the first screening of the effects was complete"
        return Result("cannot_examine", why, notes=notes, digests=digests, interrupted=True)
    result = conclude(searcher, found, forecast=False)
    result.reason = f"interrupted; so far {result.reason}"
    result.notes, result.digests, result.interrupted = notes, digests, True
    return result


def _split(
    training: Sequence[Experiment], validation: Sequence[Experiment]
) -> tuple[list[Experiment], list[Experiment]]:
    if validation or len(training) < 3:
        return list(training), list(validation)
    held = max(1, len(training) // 3)
    return list(training[:-held]), list(training[-held:])


def _predictor(
    twin: Twin, learn: list[Experiment], check: list[Experiment]
) -> tuple[Predictor | None, list[Experiment], list[Experiment], str]:
    """Choose what predicts by the channels that are there."""
    everything = [*learn, *check]
    names = tuple(
        c.name for c in CHANNELS
        if not c.differenced and all(c.name in e.readings for e in everything)
    )  # fmt: skip
    travels = [float(np.ptp(x[np.isfinite(x)])) for x in
               (e.readings.get("position", np.zeros(1)) for e in everything)]  # fmt: skip
    if any(FLOW in e.readings for e in everything) and max(travels) < DRIVEN:
        metered, why = flow_bench(twin, everything)
        return metered, learn, check, why
    if max(travels) < DRIVEN:
        valve, why = bench(twin, everything)
        still = "the rod hardly moves; move it by some millimetres" if max(travels) > 0.0 else (
            "no experiment shows a moving position"
        )  # fmt: skip
        why = f"{still}; {why}" if why else _slow(everything)
        return None if why else valve, learn, check, why
    if min(travels) < DRIVEN:
        return None, learn, check, "the rod hardly moves in some; move it by some millimetres"
    contrary = plausible.contradictions(everything, twin)
    if contrary:
        return None, learn, check, "; ".join(contrary)
    if all(len(e.current) for e in everything):
        why = _slow(everything)
        return None if why else Observer(twin, names), learn, check, why
    if "load_force" in names and {"pressure_a", "pressure_b"} & set(names):
        turned = plausible.dissipative(everything, twin)
        return (
            static.StaticObserver(twin), turned[: len(learn)], turned[len(learn) :], ""
        )  # fmt: skip
    why = (
        f"with {', '.join(names)} alone no balance can be examined; add valve_current, or a "
        "chamber pressure and load_force"
    )
    return None, learn, check, why


def _priors(predictor: Predictor) -> Mapping[str, float]:
    """Return how well ordinary parameters are known."""
    if isinstance(predictor, ValveBench):
        return VOLUME_PRIORS
    if isinstance(predictor, FlowBench):
        return FLOW_PRIORS
    return parameters.PRIORS if isinstance(predictor, Observer) else parameters.STATIC_PRIORS


def _slow(experiments: Sequence[Experiment]) -> str:
    """Return why experiments are sampled too slowly, or ""."""
    slowest = max(e.period for e in experiments)
    if slowest <= SLOWEST:
        return ""
    return (
        f"sampled every {slowest * 1e3:.3g} ms: pressures move within that time; record at "
        f"{SLOWEST * 1e3:g} ms or faster"
    )


def _candidates(twin: Twin, predictor: Predictor) -> list[Coordinate]:
    sensors = tuple(c for c in predictor.channels if c in twin.names)
    found = parameters.candidates(twin, sensors)
    if isinstance(predictor, FlowBench):
        return [c for c in found if flow_examinable(c)]
    if isinstance(predictor, Observer):
        return found
    return [c for c in found if static.examinable(c)]


def _chosen(
    candidates: list[Coordinate], only: Sequence[str], exclude: Sequence[str]
) -> list[Coordinate]:
    known = {c.name for c in candidates} | {c.name.rpartition(".")[2] for c in candidates}
    for name in (*only, *exclude):
        if name not in known:
            raise UserError(
                f"{name}: no such effect among those that these data could show; "
                f"they are {', '.join(sorted(c.name for c in candidates))}"
            )

    def named(c: Coordinate, names: Sequence[str]) -> bool:
        return c.name in names or c.name.rpartition(".")[2] in names

    return [c for c in candidates if (not only or named(c, only)) and not named(c, exclude)]


def conclude(searcher: Searcher, search: Search, forecast: bool = True) -> Result:
    """Turn a finished search into a result, with or without a forecast of the next experiment."""
    findings = [_found(searcher, search, c) for c in search.effects]
    parts = account.shares(searcher, search)
    findings = [_with_share(f, parts.get(f.name, 0.0)) for f in findings]
    last = search.rounds[-1]
    unknown = []
    if last.unknown:
        unknown = [
            Unexplained(
                b.balance.name, b.driver, b.balance.unit, tuple(b.knots.tolist()),
                tuple(b.curve.tolist()), in_words(b.driver, b.knots, b.curve, b.balance.unit),
                b.statistic,
            )
            for b in [b for b in last.blocks[:3] if b.significant]
        ]  # fmt: skip
    unseen = [s.coordinate.name for s in search.rounds[0].scores if not s.visible]
    result = Result("nothing_missing", "the model explains the data within their noise")
    result.effects, result.unknown, result.search = findings, unknown, search
    result.unseen = [n for n in unseen if n not in {f.name for f in findings}]
    if findings:
        result.verdict = "missing_effects"
        result.reason = "missing: " + "; ".join(str(f) for f in findings)
    elif unknown:
        result.verdict = "unknown_effect"
        u = unknown[0]
        result.reason = f"something acts on the {u.balance}, depending on {u.driver}: {u.shape}"
    ambiguous = [f for f in findings if f.group]
    if ambiguous:
        f = ambiguous[0]
        if forecast:
            result.plan = recommend(searcher, search, f.name, f.group, searcher.tell)
        result.next_experiment = str(result.plan or "") or (
            f"{f.name} and {', '.join(f.group)} look alike here; record other motions: slower, "
            "faster, over the whole stroke"
        )
    _measure(searcher, search, result)
    return result


def _measure(searcher: Searcher, search: Search, result: Result) -> None:
    """Fill gap, ladder, parameters and traces."""
    final = search.final
    if final is None:
        return
    account.fill(searcher, search, result)
    deviations = np.sqrt(np.diag(final.covariance()))
    result.parameters = {
        c.name: {
            "configured": c.neutral, "refitted": float(c.value(float(a))),
            "low": float(c.value(float(a - 1.96 * d))), "high": float(c.value(float(a + 1.96 * d))),
        }
        for c, a, d in zip(search.ordinary, final.at, deviations, strict=False)
    }  # fmt: skip
    for found in search.rounds:
        if found.accepted:
            t = found.trials[0]
            result.ladder.append(
                {
                    "effect": t.score.coordinate.name,
                    "training": t.evidence.gain,
                    "validation": _or_none(t.evidence.held_out),
                }
            )


def _found(searcher: Searcher, search: Search, coordinate: Coordinate) -> Finding:
    round_ = next(
        r for r in search.rounds if r.accepted and r.trials[0].score.coordinate is coordinate
    )
    best = round_.trials[0]
    final = search.final
    assert final is not None
    i = [c.name for c in final.coordinates].index(coordinate.name)
    at, spread = float(final.at[i]), float(np.sqrt(final.covariance()[i, i]))
    spread = max(spread, best.deviation)
    ends = sorted(coordinate.value(at + k * spread) for k in (-1.96, 1.96))
    group, size = rivals_of(best, round_.scores, round_.trials, searcher.fitter.stretch)
    alike = [weighed(round_, name) for name in group]
    group = confirmed(searcher.fitter, final, coordinate.name, alike) if alike else []
    weaker = [t for t in round_.trials[1:] if t.score.coordinate.name not in group]
    return Finding(
        name=coordinate.name,
        knob=coordinate.effect.knob.name if coordinate.effect else coordinate.name,
        value=float(coordinate.value(at)), unit=coordinate.unit, shown=coordinate.shown,
        interval=(float(ends[0]), float(ends[1])), explained=0.0, gain=best.evidence.gain,
        held_out=_or_none(best.evidence.held_out), group=tuple(group),
        form_differs=coordinate.name in search.form_differs,
        rivals=tuple(_rival(t, best) for t in weaker), separating_size=size,
    )  # fmt: skip


def _rival(trial: Trial, best: Trial) -> Rival:
    reasons = trial.evidence.objections or [
        f"gains {trial.evidence.gain:.0f}, {best.score.coordinate.name} {best.evidence.gain:.0f}"
    ]
    return Rival(
        trial.score.coordinate.name, trial.evidence.gain, _or_none(trial.evidence.held_out),
        "; ".join(reasons),
    )  # fmt: skip


def _with_share(finding: Finding, share: float) -> Finding:
    return Finding(**{**vars(finding), "explained": share})


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None

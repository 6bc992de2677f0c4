"""Choice of the experiment that would separate effects which the data do not distinguish.

Every experiment of the library is forecast at a few amplitudes. The best ones are verified: their
recordings are simulated with noise, and every explanation is refitted to old and new data.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design.forecast import Explanation, Forecaster
from hil_emulator.identify.experiment_design.library import LIBRARY, Target, limits, target
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.rivals import rival_start
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.units import show

AMPLITUDES = (0.5, 1.0, 2.0)
"""Amplitudes of a forecast, over the usual one."""

BOTH_WAYS = 8
"""Number of candidates that are also forecast with each rival as the truth."""

VERIFIED = 3
"""Number of candidates that are verified."""

SEEDS = (11, 12)
"""Seeds of the noise in verified recordings; forecasts use others."""

MEMBERS = 3
"""Largest number of explanations to distinguish: the nearest ones."""

SEPARATED = 25.0
"""Difference in chi-square that separates two effects beyond doubt (assumed)."""


@dataclass(frozen=True)
class Candidate:
    """An experiment that could be recorded.

    Attributes:
        experiment: its name in the library.
        amplitude: largest deviation [m].
        duration: how long it lasts [s].
        predicted: smallest separability of two of them with this experiment and the present data.
        verified: median difference in chi-square between the named effect and the best rival after
            refits to simulated recordings; null if that was not tried.

    """

    experiment: str
    amplitude: float
    duration: float
    predicted: float
    verified: float | None = None

    @property
    def merit(self) -> float:
        """The verified separability, or the predicted one."""
        return self.predicted if self.verified is None else self.verified


@dataclass(frozen=True)
class NextExperiment:
    """The next experiment to record.

    Attributes:
        members: the effects that are not distinguished, the named one first.
        now: smallest separability of two of them with the present data.
        best: the experiment to record.
        others: further experiments of the library, the better ones first.
        command: command line that writes the stimulus file.

    """

    members: tuple[str, ...]
    now: float
    best: Candidate
    others: tuple[Candidate, ...]
    command: str

    def __str__(self) -> str:
        first, *rest = self.members
        alike = f"{first} and {', '.join(rest)} look alike here (separability {self.now:.0f})"
        if self.now >= SEPARATED:
            alike = f"the machine's law is not exactly that of {' or '.join(self.members)}"
        b = self.best
        size = show(float(f"{b.amplitude:.3g}"), "m", "mm")
        if b.merit < SEPARATED:
            return (
                f"{alike}, and no experiment of the library would separate them: the best, "
                f"{b.experiment} at {size}, reaches {b.merit:.0f} of {SEPARATED:.0f}"
            )
        return (
            f"{alike}; record {b.experiment} at {size} for {b.duration:g} s, which would separate "
            f"them by {b.merit:.0f}: {self.command}"
        )


def recommend(
    searcher: Searcher, search: Search, named: str, group: Sequence[str],
    report: Callable[[str], None] = lambda _: None,
) -> NextExperiment | None:  # fmt: skip
    """Return the experiment that would separate a named effect from its group.

    Args:
        searcher: with the data and the predictor.
        search: finished, its model fitted.
        named: the effect.
        group: the effects that are not distinguished from it, the nearest first.
        report: receives progress as text.

    Returns:
        None without a forecast: no valve drives the rod, there is no fit, or the user interrupts
        it.

    """
    predictor, final = searcher.fitter.predictor, search.final
    if not isinstance(predictor, Observer) or "position" not in predictor.channels:
        return None
    if final is None:
        return None
    if named not in [c.name for c in final.coordinates]:
        return None
    report(f"looking for an experiment that separates {named} from {', '.join(group)}")
    try:
        searcher.fitter.freeze(final.coordinates, final.at)
        alike = explanations(searcher.fitter, search, named, group)
        return _planned(searcher.fitter, predictor, alike)
    except KeyboardInterrupt:
        report("interrupted: no experiment is recommended")
        return None


def _planned(
    fitter: Fitter, predictor: Observer, explained: Sequence[Explanation]
) -> NextExperiment:
    forecaster = Forecaster(fitter, predictor, explained)
    targets = possible(predictor.model.plant_values, fitter.experiments[0].period)
    ranked = _ranked(forecaster, targets)
    checked = [_verified(forecaster, c, t) for c, t in ranked[:VERIFIED]]
    rest = [c for c, _ in ranked[VERIFIED:]]
    order = [c for part in (checked, rest) for c in sorted(part, key=lambda c: -c.merit)]
    files = [str(f) for f in predictor.model.config.files]
    return NextExperiment(
        tuple(e.name for e in explained), forecaster.now, order[0], tuple(order[1:]),
        command(order[0], files),
    )  # fmt: skip


def command(chosen: Candidate, configs: Sequence[str]) -> str:
    """Return the command that writes an experiment's stimulus file."""
    words = [
        f"hil-emulator experiment {chosen.experiment}",
        f'--amplitude "{1e3 * chosen.amplitude:.4g} mm"', f'--duration "{chosen.duration:g} s"',
        *(f"--config {c}" for c in configs), f"--out {chosen.experiment}.csv",
    ]  # fmt: skip
    return " ".join(words)


def possible(plant: Mapping[str, float], period: float) -> list[Target]:
    """Return every experiment of the library, at the amplitudes that fit."""
    allowed, targets = limits(plant), []
    for entry in LIBRARY:
        usual = target(entry, allowed, period=period)
        for factor in AMPLITUDES:
            try:
                targets.append(target(entry, allowed, factor * usual.amplitude, period=period))
            except UserError:
                continue
    return targets


def explanations(
    fitter: Fitter, search: Search, named: str, group: Sequence[str]
) -> list[Explanation]:
    """Return the fitted model, and with each rival in the place of the named effect."""
    final = search.final
    assert final is not None
    knobs = [i for i, c in enumerate(final.coordinates) if c.belongs_to(named)]
    stays = [i for i in range(len(final.at)) if i not in knobs]
    shared = [final.coordinates[i] for i in stays]
    at, values = final.at[stays], final.at[knobs]
    mine = [*shared, *(final.coordinates[i] for i in knobs)]
    fits = {named: fitter.fit(mine, np.concatenate([at, values]), 2)}
    for name in group[: MEMBERS - 1]:
        brought, start = rival_start(search.selected_in(named), name)
        fits[name] = fitter.fit([*shared, *brought], np.concatenate([at, start]), 4)
    return [Explanation(n, f.coordinates, f.at, f.chi2) for n, f in fits.items()]


def _ranked(forecaster: Forecaster, targets: Sequence[Target]) -> list[tuple[Candidate, Target]]:
    """Return every experiment with its forecast, the better ones first."""
    named, *rivals = forecaster.explanations
    forecasts = [(forecaster.separability_of(named, t), t) for t in targets]
    forecasts.sort(key=lambda f: -f[0])
    for i, (d, t) in enumerate(forecasts[:BOTH_WAYS]):
        forecasts[i] = min(d, *(forecaster.separability_of(r, t) for r in rivals)), t
    forecasts[:BOTH_WAYS] = sorted(forecasts[:BOTH_WAYS], key=lambda f: -f[0])
    return [(_candidate(t, d), t) for d, t in forecasts]


def _candidate(played: Target, predicted: float) -> Candidate:
    duration = len(played.time) * float(played.time[1] - played.time[0])
    return Candidate(played.stimulus.name, played.amplitude, round(duration, 6), predicted)


def _verified(forecaster: Forecaster, chosen: Candidate, played: Target) -> Candidate:
    truth = forecaster.explanations[0]
    margins = [forecaster.realised(played, truth, seed) for seed in SEEDS]
    return Candidate(**{**vars(chosen), "verified": float(np.median(margins))})

"""Missing term of each balance over time, and its map over a regressor.

The term is estimated by a smoother. The smoother reduces terms that change within 10 ms, so a map
shows slightly less than the whole term. Each balance is examined as if only this balance had an
error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, prior_rows
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.benches.force_balance import MeasuredStates
from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.free_terms.regressors import REGRESSORS
from hil_emulator.identify.prediction.model_run.records import Entries
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import side_by_side
from hil_emulator.units import factor, read_as

TERM_STRENGTH = 0.03
"""Deviation of a term relative to the largest force, flow, current or pressure (assumed)."""

TERM_CORRELATION_TIME = 0.01
"""Time over which a term is correlated [s] (assumed)."""

LEAST_DIRECTION = 0.01
"""Smallest eigenvalue of a curve's direction that ordinary parameters do not explain, relative to
the largest."""

MAPPED_SAMPLES = 20_000
"""Largest number of samples in a map."""

BINS = 25

FEWEST_IN_BIN = 10
"""Smallest number of samples in a bin that is drawn."""

SHOWN = {"m^3/s": (6e4, "l/min"), "m/s": (1e3, "mm/s"), "m": (1e3, "mm"), "Pa": (1e-5, "bar"),
         "A": (1e3, "mA"), "N": (1.0, "N"), "s": (1.0, "s"), "A/s": (1e3, "mA/s"),
         "Pa/s": (1e-5, "bar/s"), "Pa/s^2": (1e-5, "bar/s^2"), "Pa*m": (1e-2, "bar*mm"),
         "m/s^2": (1.0, "m/s^2")}  # fmt: skip
"""Factor and unit of data sheets, by SI unit; every regressor has one."""


def shown_as(unit: str) -> tuple[float, str]:
    """Return factor and unit in which reports show a quantity of an SI unit."""
    times, linear = SHOWN.get(unit, (1.0, unit))
    shown = read_as(unit, linear)
    return (times, linear) if shown == linear else (1.0 / factor(unit, shown), shown)


@dataclass(frozen=True)
class Binned:
    """A residual over a regressor: median, and quantiles of 16 and 84 % in each bin."""

    middle: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Map:
    """Missing term of one balance over one regressor, in units of data sheets.

    Attributes:
        balance: its name.
        regressor: its name.
        unit: of the residual.
        regressor_unit: of the regressor.
        centres: of the bins.
        before: with the configured model.
        after: with the final model.
        frequency: of the spectra [Hz]; empty if samples are irregular.
        spectra: density before and after [unit/Hz^0.5].
        loop: difference of the residual before between a rising and a falling regressor, relative
            to its size; near 1 for hysteresis.

    """

    balance: str
    regressor: str
    unit: str
    regressor_unit: str
    centres: Array
    before: Binned
    after: Binned
    frequency: Array
    spectra: tuple[Array, Array]
    loop: float


def lacking(predictor: Predictor, frozen: object, par: Array, chan: Array, what: Balance) -> Array:
    """Return the missing term of a balance along one experiment, in the balance's unit.

    Args:
        predictor: of the experiment.
        frozen: result of the predictor's `freeze`.
        par: the plant's parameters.
        chan: the transducers' parameters.
        what: a balance with probes, or the supply pressure.

    """
    residual, _ = predictor.innovations(frozen, par, chan)
    if isinstance(frozen, MeasuredStates):
        made = predictor.through(frozen, what, np.ones((len(residual), 1))).reshape(residual.shape)
        size = np.sum(made**2, axis=1)
        shown = frozen.present & (size > 0.0)
        term = -np.sum(residual * made, axis=1) / np.where(shown, size, 1.0)
        return np.asarray(np.where(shown, term, np.nan))
    assert isinstance(frozen, Frozen)
    assert isinstance(predictor, Observer)
    drives, feeds = predictor.entry(frozen, what)
    entries = Entries(drives, np.where(np.isfinite(frozen.data.measured), feeds, 0.0))
    decay = float(np.exp(-frozen.experiment.period / TERM_CORRELATION_TIME))
    size = TERM_STRENGTH * _largest(predictor, frozen, par, what)
    term = np.zeros(len(residual))
    if not (np.isfinite(residual).all() and np.isfinite(frozen.jacobians.maps).all()):
        return np.full(len(residual), np.nan)
    predictor.model.loops.smooth(
        frozen.gains, frozen.jacobians, entries, frozen.weights, residual, decay, size**2, term
    )
    return term


def _largest(observer: Observer, frozen: Frozen, par: Array, what: Balance) -> float:
    """Return the largest force, flow, current or pressure in a balance."""
    p = dict(zip(observer.model.kernel.parameters.names or (), par.tolist(), strict=True))
    top = float(np.nanmax(np.abs(frozen.experiment.current), initial=1e-6))
    largest: dict[str, float] = {
        "N": p["cylinder_piston_area"] * p["supply_pressure"],
        "m^3/s": p["valve_gain"] * top * float(np.sqrt(p["supply_pressure"] / 2.0)),
        "A": top, "Pa": p["supply_pressure"],
    }  # fmt: skip
    return largest[what.unit]


def simplest(fit: Fit, term: DiscrepancyTerm) -> Array:
    """Return the smallest curve with the gain of a term, in the balance's unit.

    An ordinary parameter may explain a part of the curve, such as constant friction. This part is
    left to the parameter.
    """
    project = Projection(fit)
    columns = np.column_stack([project(c) for c in term.columns.T])
    values, vectors = np.linalg.eigh(columns.T @ columns)
    keep = values > LEAST_DIRECTION * max(values[-1], 1e-30)
    gradient = vectors[:, keep].T @ (columns.T @ project.residual)
    return np.asarray(-vectors[:, keep] @ (gradient / values[keep]) * term.balance.scale)


def with_term(fit: Fit, term: DiscrepancyTerm) -> Fit:
    """Return a fit whose parameters have the values of a joint fit with a term.

    Without the term the parameters explain a part of it, and its map would be too small.
    """
    weights = prior_rows(fit.coordinates)
    normal = fit.jacobian.T @ fit.jacobian + np.diag(weights**2)
    pull = fit.jacobian.T @ (term.columns @ (simplest(fit, term) / term.balance.scale))
    moved = fit.at - np.linalg.pinv(normal, rcond=1e-10, hermitian=True) @ pull
    bounds = np.array([c.bounds for c in fit.coordinates]).reshape(-1, 2)
    return replace(fit, at=np.clip(moved, bounds[:, 0], bounds[:, 1]))


def draw(
    predictor: Predictor, before: Fit, after: Fit, term: DiscrepancyTerm,
    experiments: Sequence[Experiment], jobs: int = 1,
) -> Map:  # fmt: skip
    """Return the map of a term with two models.

    Args:
        predictor: of the experiments.
        before: the final model without the named effects.
        after: the final model.
        term: balance and regressor.
        experiments: the first ones are drawn.
        jobs: threads; each takes one experiment at a time.

    """
    chosen = _first(experiments)
    wanted = [(fit, experiment) for fit in (before, after) for experiment in chosen]
    values = list(side_by_side(lambda one: _along(predictor, *one, term), wanted, jobs))
    old, new = (
        (np.concatenate([value for value, _ in part]), np.concatenate([left for _, left in part]))
        for part in (values[: len(chosen)], values[len(chosen) :])
    )
    return _map(term, chosen[0].period, old, new)


def _first(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Return the first experiments, up to the samples of a map."""
    ends = np.cumsum([e.samples for e in experiments])
    return [
        e for e, end in zip(experiments, ends, strict=True) if end <= max(MAPPED_SAMPLES, ends[0])
    ]


def _along(
    predictor: Predictor, fit: Fit, experiment: Experiment, term: DiscrepancyTerm
) -> tuple[Array, Array]:
    """Return regressor and residual along an experiment."""
    par, chan = predictor.model.memory(fit.coordinates, fit.at)
    frozen = predictor.freeze(experiment, par, chan)
    predictor.weigh(frozen, par, chan)
    track = predictor.innovations(frozen, par, chan, track=True)[1]
    values = predictor.regressors(frozen, track)[term.regressor]
    return values, lacking(predictor, frozen, par, chan, term.balance)


def _map(
    term: DiscrepancyTerm, period: float, before: tuple[Array, Array], after: tuple[Array, Array]
) -> Map:
    balance, regressor = term.balance, term.regressor
    scale, unit = shown_as(balance.unit)
    regressor_scale, regressor_unit = shown_as(REGRESSORS[regressor].unit)
    ends = np.quantile(before[0], (0.005, 0.995))
    edges = np.linspace(ends[0], ends[1], BINS + 1)
    centres = 0.5 * (edges[:-1] + edges[1:]) * regressor_scale
    one, two = (_binned(d, r * scale, edges) for d, r in (before, after))
    frequency, spectrum = _spectrum(before[1] * scale, period)
    spectra = (spectrum, _spectrum(after[1] * scale, period)[1])
    loop = _loop(*before, edges)
    return Map(
        balance.name, regressor, unit, regressor_unit, centres, one, two, frequency, spectra, loop
    )  # fmt: skip


def _loop(regressor: Array, residual: Array, edges: Array) -> float:
    """Return the width of the loop of a residual over its regressor, relative to its size."""
    rising = np.gradient(regressor) > 0.0
    up, down = (_binned(regressor[m], residual[m], edges).middle for m in (rising, ~rising))
    both = np.isfinite(up) & np.isfinite(down)
    if not both.any():
        return 0.0
    size = float(np.sqrt(np.mean((0.5 * (up + down)[both]) ** 2)))
    return float(np.sqrt(np.mean((0.5 * (up - down)[both]) ** 2))) / max(size, 1e-300)


def _binned(regressor: Array, residual: Array, edges: Array) -> Binned:
    inside = np.digitize(regressor, edges) - 1
    quantiles = np.full((3, BINS), np.nan)
    for b in range(BINS):
        here = residual[(inside == b) & np.isfinite(residual)]
        if len(here) >= FEWEST_IN_BIN:
            quantiles[:, b] = np.quantile(here, (0.5, 0.16, 0.84))
    return Binned(*quantiles)


def _spectrum(residual: Array, period: float) -> tuple[Array, Array]:
    """Return frequencies and the density of a residual, averaged over half-second pieces."""
    from scipy.signal import welch

    good = np.nan_to_num(residual)
    frequency, power = welch(good, 1.0 / period, nperseg=min(len(good), round(0.5 / period)))
    return np.asarray(frequency[1:]), np.asarray(np.sqrt(power[1:]))

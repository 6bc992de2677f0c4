"""Transition matrix from one sample to the next."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.filter.transition import Slopes, map_part, slopes_of
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.tuning import SLIP
from hil_emulator.identify.prediction.plant.probes import PROBES
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

WIDTH, STEPS = 5e-4, 2


def even(a: Array, b: Array) -> Slopes:
    """Return slopes that do not change: dx'/dx = A, dx'/dp = B."""
    n, places = len(a), np.arange(b.shape[1])
    start: Any = SimpleNamespace(active=np.arange(n), state=np.zeros(n), decay=())
    data: Any = SimpleNamespace(chosen=np.arange(1))
    model: Any = SimpleNamespace(velocity=0, chambers=np.zeros(0, np.int64), signals=1)
    slopes = slopes_of(model, start, data, places, 10.0 ** np.arange(n + len(places)))
    for rates in (slopes.rates, slopes.before):
        rates[:, :n], rates[:, n:] = a, b
    return slopes


def test_a_step_maps_like_the_exponential() -> None:
    """For states and parameters, with the accuracy of a third-order method."""
    random = np.random.default_rng(3)
    turn = random.normal(size=(3, 3))
    modes = np.array([[-60.0, 200.0, 0.0], [-200.0, -60.0, 0.0], [0.0, 0.0, -300.0]])
    a, b = turn @ modes @ np.linalg.inv(turn), random.normal(size=(3, 2))
    slopes = even(a, b)
    map_part(slopes, WIDTH, STEPS)
    whole = expm(WIDTH * STEPS * np.block([[a, b], [np.zeros((2, 5))]]))
    np.testing.assert_allclose(slopes.step, whole[:3], rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("rate", [1e4, 1e6, 1e9])
def test_modes_too_fast_for_a_step_decay_in_it(rate: float) -> None:
    """With a parameter as input, the equilibrium -A⁻¹ B is reached at once."""
    slopes = even(np.array([[-rate, 0.0], [0.0, -1.0]]), np.array([[2.0 * rate], [1.0]]))
    map_part(slopes, WIDTH, STEPS)
    assert abs(slopes.step[0, 0]) < 0.1
    assert slopes.step[0, 2] == pytest.approx(2.0, abs=0.2)
    assert slopes.step[1, 1] == pytest.approx(np.exp(-WIDTH * STEPS), rel=1e-9)


class Moved:
    """The reference machine from a state on, by another integration.

    Args:
        observer: of it.
        frozen: a recording.

    """

    def __init__(self, observer: Observer, frozen: Any) -> None:
        self.kernel, self.frozen = observer.model.kernel, frozen
        self.model = observer.model

    def after(self, z: Array, current: float, place: int = 0, by: float = 0.0) -> Array:
        """Return the states of z after a sample period, a parameter moved."""
        start, n = self.frozen.start, len(self.frozen.start.active)
        par, inputs = self.frozen.par.copy(), np.array([current, 0.0, 0.0, 0.0])
        par[self.model.drift] = z[n]
        par[self.model.supply] += z[n + 1]
        par[place] += by
        signals = np.zeros(len(self.model.signal_names))

        def rates(_: float, x: Array) -> Array:
            full, rate = start.state.copy(), np.zeros(len(start.state))
            full[start.active] = x
            self.kernel.rate(full, rate, par, inputs, signals)
            return rate[start.active]

        span = (0.0, self.frozen.data.period)
        done = solve_ivp(rates, span, z[:n], "Radau", rtol=1e-9, atol=1e-12)
        return np.asarray(done.y[:, -1])


@pytest.mark.parametrize(("every", "median", "most"), [(1, 1e-3, 5e-3), (5, 0.015, 0.2)])
def test_a_jacobian_agrees_with_radau(every: int, median: float, most: float) -> None:
    """Changes of pressure, velocity, position or leakage propagate as computed by Radau.

    At 1000 rows a second and at 200, with a period in several parts.
    """
    fast = recorded({}, "multisine", 3)
    readings = {name: values[::every] for name, values in fast.readings.items()}
    e = replace(fast, period=fast.period * every, current=fast.current[::every], readings=readings)
    observer = Observer(knee_model(), INSTRUMENTS)
    frozen = observer.freeze(e, *observer.model.memory([], []))
    entries, moved = observer.probed(frozen), Moved(observer, frozen)
    names = observer.model.active(frozen.par)
    states = {"pressure_a": 1e3, "pressure_b": 1e3, "velocity": 1e-4, "position": 1e-5}
    chosen = [names.index(n) for n in states]
    scale = np.array([1e5, 1e5, 1e-2, 1e-3])
    leak = next(i for i, p in enumerate(PROBES) if p.name == "probe_outward")
    off = []
    for k in range(100 // every, e.samples - 1, 200 // every):
        z, current = frozen.predicted[k].astype(float), float(e.current[k])
        if abs(z[names.index("velocity")]) < 5e-3:
            continue  # across a standstill, a difference is a secant
        base = moved.after(z, current)
        for name, by in states.items():
            other = z.copy()
            other[names.index(name)] += by
            change = (moved.after(other, current) - base)[chosen] / by / scale
            computed = frozen.jacobians.maps[k][chosen, names.index(name)] / scale
            off.append(np.linalg.norm(computed - change) / np.linalg.norm(change))
        change = moved.after(z, current, observer.model.probes[leak], 1e-8) - base
        change, computed = change[chosen] / 1e-8 / scale, entries.drives[k][chosen, leak] / scale
        off.append(np.linalg.norm(computed - change) / np.linalg.norm(change))
    assert len(off) > 20
    assert np.median(off) < median
    assert np.quantile(off, 0.9) < most


def test_friction_at_creep_counts_by_its_secant() -> None:
    """A velocity uncertain by 1 mm/s decays like one that is faster by 1 mm/s.

    The tangent of friction would give a far faster decay.
    """
    e = recorded({}, "multisine", 3)
    observer = Observer(knee_model(), INSTRUMENTS)
    frozen = observer.freeze(e, *observer.model.memory([], []))
    moved, column = Moved(observer, frozen), observer.model.active(frozen.par).index("velocity")
    secants, tangents = [], []
    for k in range(100, e.samples - 1):
        z, current = frozen.predicted[k].astype(float), float(e.current[k])
        if abs(z[column]) > SLIP / 2.0:
            continue
        computed = frozen.jacobians.maps[k][column, column]
        for width, off in ((SLIP, secants), (SLIP / 100.0, tangents)):
            other = z.copy()
            other[column] += width
            change = (moved.after(other, current) - moved.after(z, current))[column] / width
            off.append(abs(computed - change))
    assert len(secants) >= 5
    assert np.median(secants) < 0.2 * np.median(tangents)


@pytest.mark.slow
def test_an_emptying_chamber_has_finite_differences() -> None:
    """A stopped heavy load empties chambers, whose pressures propagate as computed by Radau.

    With hardly any air, the state of a chamber changes by 100 bar below zero pressure.
    """
    changes = {"load_mass": 300.0, "entrained_air_fraction": 2e-7}
    e = recorded(changes, "steps", 3)
    observer = Observer(knee_model(), INSTRUMENTS)
    par, chan = observer.model.memory([], [])
    fields = list(observer.model.kernel.parameters.names or ())
    par[[fields.index(name) for name in changes]] = list(changes.values())
    frozen, names = observer.freeze(e, par, chan), observer.model.active(par)
    moved = Moved(observer, frozen)
    chambers = [names.index("pressure_a"), names.index("pressure_b")]
    lowest = frozen.predicted[:, chambers].min(axis=1)
    empty = [k for k in range(100, e.samples - 1) if min(lowest[k], lowest[k + 1]) < 1e5]
    assert len(empty) > 400
    off, width = [], frozen.tuning.widths[chambers[0]]
    for k in empty[::6]:
        z, current = frozen.predicted[k].astype(float), float(e.current[k])
        base = moved.after(z, current)
        for column in chambers:
            other = z.copy()
            other[column] += width
            change = (moved.after(other, current) - base)[chambers] / width
            computed = frozen.jacobians.maps[k][chambers, column]
            off.append(np.linalg.norm(computed - change) / max(np.linalg.norm(change), 0.1))
    assert np.median(off) < 8e-4
    assert np.quantile(off, 0.9) < 0.02

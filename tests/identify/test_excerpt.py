"""Excerpts of long recordings, on which candidates are screened."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_emulator.identify.estimation import excerpt
from hil_emulator.identify.estimation.clusters import Clusters
from hil_emulator.identify.estimation.excerpt import Excerpt, excerpt_of
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.windows import first_samples
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.scan import rescored, scan
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, INSTRUMENTS, campaign, knee, knee_model, recorded

LEAK = {"internal_leakage_conductance": 1e-13}
ORDINARY = parameters.ordinary(knee_model())[:3]
CANDIDATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}


def leaking() -> tuple[Fitter, Excerpt]:
    """Return a fit of six seconds of a machine with a leak, and an excerpt."""
    data = [recorded(LEAK, kind, seed, 3.0) for seed, kind in enumerate(("multisine", "steps"))]
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), data)
    fitter.freeze(ORDINARY, np.zeros(3))
    return fitter, excerpt_of(fitter, fitter.fit(ORDINARY, np.zeros(3), 2))


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set the length of an excerpt to 2000 samples."""
    monkeypatch.setattr(excerpt, "ENOUGH", 2000)


@given(st.integers(1, 10**6), st.integers(1, 1000), st.floats(1e-3, 1.0))
def test_windows_are_apart_and_spread(samples: int, length: int, part: float) -> None:
    """Windows do not overlap or exceed the recording, and each equal stretch has one."""
    length = min(length, samples)
    begin = first_samples(samples, length, part)
    assert begin[0] >= 0
    assert begin[-1] + length <= samples
    assert np.all(np.diff(begin) >= length)
    stretch = samples / len(begin)
    into = begin - np.arange(len(begin)) * stretch
    assert np.all((into > -1.0) & (into + length <= stretch + 1e-6))
    assert abs(len(begin) * length - part * samples) <= length


def test_a_window_has_the_innovations_of_the_whole(
    few: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After settling, the innovations of a window are those of the whole recording.

    Base laws have the model's form here, since their differences are independent by window.
    """
    fitter, part = leaking()
    whole = fitter.residual(ORDINARY, part.fit.at)
    assert part.rows is not None
    assert len(part.rows) == 2000 * len(INSTRUMENTS)
    shown = part.fit.residual != 0.0
    weight = part.fitter.batch.weight
    np.testing.assert_allclose(part.fit.residual[shown] / weight, part.of(whole)[shown], atol=0.2)
    assert 0.03 < np.mean(~shown) < 0.08


def test_an_excerpt_stands_for_all_data(few: None) -> None:
    """Statistic, estimate and loss are those of all data."""
    fitter, part = leaking()
    base = fitter.fit(ORDINARY, np.zeros(3), 2)
    leak = CANDIDATES["internal_leakage"]
    (there,), (whole,) = scan(part.fitter, part.fit, [leak]), scan(fitter, base, [leak])
    assert there.statistic == pytest.approx(whole.statistic, rel=0.4)
    assert there.estimate == pytest.approx(whole.estimate, rel=0.1)
    assert part.fit.chi2 == pytest.approx(base.chi2, rel=0.4)
    again = rescored(fitter, base, there)
    assert again.statistic == pytest.approx(whole.statistic, rel=1e-6)
    assert rescored(fitter, base, whole) is whole


@pytest.mark.slow
def test_a_sensor_error_has_the_same_weight(few: None) -> None:
    """Derivatives by sensor errors have the same weight as those by other effects."""
    fitter, part = leaking()
    base = fitter.fit(ORDINARY, np.zeros(3), 2)
    sensors = [c for c in CANDIDATES.values() if c.channel == "pressure_a" and not c.inverse]
    there = {s.coordinate.name: s.information for s in scan(part.fitter, part.fit, sensors)}
    whole = {s.coordinate.name: s.information for s in scan(fitter, base, sensors)}
    visible = [name for name, information in whole.items() if information > 100.0]
    assert len(visible) >= 3
    for name in visible:
        assert there[name] == pytest.approx(whole[name], rel=0.5)


def test_few_data_are_not_divided() -> None:
    """The excerpt of few data is the fit itself, without a copy."""
    fitter, part = leaking()
    assert part.fitter is fitter
    assert part.rows is None
    clusters = Clusters(3, np.arange(4))
    assert part.clusters(clusters) is clusters


@pytest.mark.full(sibling="test_an_excerpt_stands_for_all_data")
@pytest.mark.parametrize(
    ("changes", "name"),
    [
        (LEAK, "internal_leakage"),
        ({"stribeck_friction_excess": 40.0}, "stribeck_friction"),
        ({"transport_delay_time": 1.5e-3}, "transport_delay"),
    ],
)
def test_an_excerpt_finds_the_name_and_all_data_its_value(
    few: None, changes: dict[str, float], name: str
) -> None:
    """A quarter of the data gives the candidates, all data the value."""
    train, other = campaign(changes)
    result = identify(knee(), train, other, cache=CACHE)
    assert [f.name for f in result.effects] == [name]
    assert result.effects[0].value == pytest.approx(next(iter(changes.values())), rel=0.15)

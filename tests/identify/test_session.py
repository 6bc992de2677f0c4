"""The workflow on data of the emulator itself: names, values, and silence where nothing is wrong.

These prove that the machinery is sound; the independent generator proves that the names are.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from hil_emulator.errors import UserError
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.report import report
from hil_emulator.identify.session import Question, identify
from tests.identify.rig_data import CACHE, campaign, knee, without

SLOW = pytest.mark.slow
FULL = pytest.mark.full(sibling="test_one_hidden_effect_is_named_with_its_value")


def found(changes: Mapping[str, float], **extra: object) -> Result:
    """Identify the machine with some effects hidden in it."""
    train, other = campaign(changes, sensors=extra.pop("sensors", None))  # type: ignore[arg-type]
    return identify(knee(), train, other, cache=CACHE, **extra)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("field", "value", "name"),
    [
        pytest.param("internal_leakage_conductance", 1e-13, "internal_leakage", marks=SLOW),
        pytest.param("stribeck_friction_excess", 40.0, "stribeck_friction", marks=FULL),
        pytest.param("transport_delay_time", 1.5e-3, "transport_delay", marks=FULL),
    ],
)
def test_one_hidden_effect_is_named_with_its_value(field: str, value: float, name: str) -> None:
    """The effect in the machine and not in the configuration is named, within 15 %."""
    result = found({field: value})
    assert [f.name for f in result.effects] == [name]
    assert result.effects[0].value == pytest.approx(value, rel=0.15)


@pytest.mark.slow
def test_every_experiment_has_its_estimate() -> None:
    """Of a leak that is the catalogue's, the same; the file has the numbers and the page a picture.

    The interval holds the true value, and is no wider than a tenth of it.
    """
    asked = Question(only=["internal_leakage", "external_leakage"])
    train, other = campaign({"internal_leakage_conductance": 1e-13})
    result = identify(knee(), train, other, asked, cache=CACHE)
    leak = result.effects[0]
    assert leak.interval[0] <= 1e-13 <= leak.interval[1] <= leak.interval[0] + 1e-14
    assert [w.experiment for w in leak.by_experiment] == [e.name for e in (*train, *other)]
    for wanted in leak.by_experiment:
        assert abs(wanted.size - 1.0) < 4.0 * wanted.deviation
    written = result.to_dict()["effects"][0]["by_experiment"]
    assert [w["size"] for w in written] == [w.size for w in leak.by_experiment]
    assert "estimate of each experiment for each effect" in report(result, "a leak")


def test_a_healthy_machine_lacks_nothing() -> None:
    """Ordinary parameters off, drifting null, noise: no name and no unknown effect."""
    assert found({}).verdict == "nothing_missing"


@pytest.mark.slow
def test_a_sensor_competes_on_equal_terms() -> None:
    """A pressure sensor that reads 3 bar too much is named, not an effect of the plant."""
    result = found({}, sensors={"pressure_a": {"offset_value": 3e5}})
    assert [f.name for f in result.effects] == ["pressure_a.offset"]
    assert result.effects[0].value == pytest.approx(3e5, rel=0.1)


@pytest.mark.full(sibling="test_a_sensor_competes_on_equal_terms")
def test_it_works_with_fewer_channels() -> None:
    """Without load cell and supply pressure, leakage is still named and the cell is not."""
    train, other = campaign({"internal_leakage_conductance": 1e-13})
    fewer = [[without(e, "load_force", "supply_pressure") for e in part] for part in (train, other)]
    result = identify(knee(), *fewer, cache=CACHE)
    assert [f.name for f in result.effects] == ["internal_leakage"]
    assert "load_force.offset" in result.unseen


def test_a_reversed_position_is_refused() -> None:
    """Data with a rod that moves against the valve current are refused, with the reason."""
    train, other = campaign({})
    turned = [
        replace(e, readings=e.readings | {"position": 0.08 - e.readings["position"]}) for e in train
    ]
    result = identify(knee(), turned, other, cache=CACHE)
    assert result.verdict == "cannot_examine"
    assert "reverse the sign of position" in result.reason


@pytest.mark.full(sibling="test_a_healthy_machine_lacks_nothing")
def test_noise_gets_no_name() -> None:
    """Random numbers in every channel are no machine."""
    train, other = campaign({})
    random = np.random.default_rng(5)

    def noisy(e):  # type: ignore[no-untyped-def]
        noise = {n: np.mean(v) + np.ptp(v) * random.standard_normal(len(v))
                 for n, v in e.readings.items()}  # fmt: skip
        return replace(e, readings=noise)

    result = identify(knee(), [noisy(e) for e in train], [noisy(e) for e in other], cache=CACHE)
    assert not result.effects


def test_an_effect_that_does_not_exist_is_refused() -> None:
    """A misspelt effect in --only ends in a message with the known ones."""
    train, other = campaign({})
    with pytest.raises(UserError, match="internal_leakage"):
        identify(knee(), train, other, Question(only=["internal_leak"]), cache=CACHE)


@pytest.mark.slow
@pytest.mark.parametrize("moment", [1, pytest.param(4, marks=FULL)])
def test_an_interrupted_search_keeps_what_it_found(moment: int) -> None:
    """Before the first round is complete nothing is known; after it, the first effect is."""
    train, other = campaign({"internal_leakage_conductance": 1e-13})
    lines: list[str] = []

    def receive(words: str) -> None:
        lines.append(words)
        if len(lines) == moment + 1:
            raise KeyboardInterrupt

    result = identify(
        knee(), train, other, Question(only=["internal_leakage"]), report=receive, cache=CACHE
    )
    assert result.interrupted
    assert "interrupted" in result.reason
    assert [f.name for f in result.effects] == ["internal_leakage"] * (moment > 1)
    assert bool(result.gap) == (moment > 1)


@pytest.mark.slow
def test_linear_algebra_keeps_to_one_thread() -> None:
    """Searches side by side do not fight for the cores: small matrices need no threads."""
    train, other = campaign({})
    threads: set[int] = set()

    def receive(_: str) -> None:
        threads.update(p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas")

    with threadpool_limits(limits=2, user_api="blas"):
        identify(knee(), train, other, Question(search=False), report=receive, cache=CACHE)
    assert threads == {1}

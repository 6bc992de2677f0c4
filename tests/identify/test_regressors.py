"""Regressors of free terms along a predicted trajectory."""

import numpy as np
import pytest

from hil_emulator.identify.prediction.free_terms.regressors import Trajectory

PERIOD = 1e-3
TIME = np.arange(20) * PERIOD


@pytest.mark.parametrize(("order", "slope"), [(1, 6.0 * TIME - 3.0 * PERIOD), (2, 6.0)])
def test_rates_are_those_of_the_last_periods(order: int, slope: np.ndarray | float) -> None:
    """Of 3 t^2 the mean rate over the last period, and the second derivative, once they know it."""
    values = Trajectory({"pressure_a": 3.0 * TIME**2}, PERIOD).latest_rate("pressure_a", order)
    expected = np.broadcast_to(slope, values.shape)
    np.testing.assert_allclose(values[order:], expected[order:], rtol=1e-6)
    assert values[0] == 0.0


def test_a_rate_knows_nothing_of_the_next_sample() -> None:
    """Which is predicted from this one's reading, and holds its noise."""
    signal = np.random.default_rng(4).standard_normal(20)
    changed = signal.copy()
    changed[11:] += 1.0
    before, after = (
        Trajectory({"pressure_b": s}, PERIOD).latest_rate("pressure_b", 2)
        for s in (signal, changed)
    )
    np.testing.assert_array_equal(after[:11], before[:11])
    assert not np.allclose(after[11:], before[11:])


def test_what_was_read_is_of_the_sample_before_and_predicted_where_nothing_was() -> None:
    """The error of a right prediction depends on no earlier reading, but on that of now."""
    predicted, read = np.arange(5.0), np.array([10.0, 11.0, np.nan, 13.0, 14.0])
    values = Trajectory({"position": predicted}, PERIOD, {"position": read}).read("position")
    np.testing.assert_array_equal(values, [0.0, 10.0, 11.0, 3.0, 13.0])
    unmeasured = Trajectory({"position": predicted}, PERIOD).read("position")
    np.testing.assert_array_equal(unmeasured, predicted)

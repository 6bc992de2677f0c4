"""Noise that returns is no second witness."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.errors import UserError
from hil_emulator.identify.data_checks.shared_noise import counted
from hil_emulator.identify.measured.experiment import Experiment

RANDOM = np.random.default_rng(4)
NOISE = RANDOM.normal(0.0, 1e4, 2100)


def log(name: str, noise: np.ndarray, tone: float = 0.0) -> Experiment:
    """Return a pressure that moves in its own way, with a given noise."""
    time = np.arange(len(noise)) * 1e-3
    swing = 2e6 * np.sin(RANDOM.uniform(3.0, 30.0) * time) + tone * np.sin(2000.0 * time)
    return Experiment(name, 1e-3, np.zeros(0), {"pressure_a": 8e6 + swing + noise}, digest=name)


def test_experiments_with_one_seed_count_as_one() -> None:
    """The same noise, begun at another moment, is recognised behind another motion."""
    learn, check = counted([log("a", NOISE[:2000]), log("b", NOISE[70:])], [log("c", NOISE[9:])])
    assert [e.copies for e in (*learn, *check)] == [3, 3, 3]
    assert "the noise is that of b, c" in learn[0].notes[-1]


def test_independent_experiments_count_each() -> None:
    """Other noise is other noise, even under a hum that all of them share."""
    several = [log(n, RANDOM.normal(0.0, 1e4, 2000), tone=1e5) for n in "abc"]
    learn, _ = counted(several, [])
    assert [e.copies for e in learn] == [1, 1, 1]
    assert not any(e.notes for e in learn)


def test_a_file_given_twice_is_refused() -> None:
    """Held-out data that were fitted prove nothing."""
    first = log("a", NOISE[:2000])
    with pytest.raises(UserError, match="given twice"):
        counted([first], [replace(first, name="copy of a")])

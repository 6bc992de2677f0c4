"""What the strips show of the past: no spike is lost, memory is constant."""

import numpy as np
import pytest

from hil_emulator.panel.history import COARSE, History
from hil_emulator.panel.strips import Strips
from hil_emulator.protocol.stream import LIVE

TICK = 1e-3


def rows(first: int, values: np.ndarray) -> np.ndarray:
    """Return rows of consecutive ticks from a number on."""
    return np.column_stack([(first + np.arange(len(values))) * TICK, values])


@pytest.mark.parametrize("width", [1, 7, COARSE, 5 * COARSE])
def test_a_bucket_has_the_least_and_the_greatest_value_of_its_ticks(width: int) -> None:
    """As numpy finds them in the whole signal, at every width and across the end of the memory."""
    signal = np.random.default_rng(1).normal(size=3000).astype(np.float32)
    history = History(2, TICK, ticks=4096)
    for part in np.array_split(np.arange(3000), 23):
        history.append(rows(int(part[0]), signal[part]))
    count = 3000 // width
    low, high = history.buckets([1], 0, count, width)
    whole = signal[: count * width].reshape(count, width)
    np.testing.assert_array_equal(low[0], whole.min(axis=1))
    np.testing.assert_array_equal(high[0], whole.max(axis=1))


def test_a_spike_of_one_tick_stays_in_view_for_ten_minutes() -> None:
    """One sample of half a million is seen in a strip of a thousand pixels."""
    history = History(2, TICK)
    signal = np.zeros(600_000)
    signal[123_456] = 1.0
    for part in np.array_split(np.arange(600_000), 100):
        history.append(rows(int(part[0]), signal[part]))
    width = history.width_for(600_000, 1000, 0)
    _, high = history.buckets([1], 0, 600_000 // width, width)
    assert high[0].max() == 1.0
    assert int(np.argmax(high[0])) == 123_456 // width


def test_ticks_that_were_missed_are_empty() -> None:
    """A gap is a gap, not a line, and not what stood there a round before."""
    history = History(2, TICK, ticks=1024)
    history.append(rows(0, np.ones(1000)))
    history.append(rows(1500, np.full(100, 2.0)))
    low, _ = history.buckets([1], 1490, 20, 1)
    assert np.isnan(low[0][:10]).all()
    assert (low[0][10:] == 2.0).all()


def test_a_live_strip_gets_every_tick_once_it_is_whole() -> None:
    """The messages laid over each other are the whole signal, in buckets of one grid."""
    history = History(2, TICK)
    strips = Strips(history)
    signal = np.random.default_rng(2).normal(size=2000).astype(np.float32)
    strips.follow([1], 2.0, 200, 1)
    screen = np.full(400, np.nan, np.float32)
    for part in np.array_split(np.arange(2000), 61):
        history.append(rows(int(part[0]), signal[part]))
        message = strips.news(1)
        kind, columns, count, generation = np.frombuffer(message[:12], "<u2,<u2,<u4,<u4")[0]
        begin, width = np.frombuffer(message[16:32])
        assert (kind, columns, generation) == (LIVE, 1, 1)
        assert width == pytest.approx(0.01)
        low, high = np.frombuffer(message[48 + 8 :], np.float32).reshape(2, count)
        at = round(begin / width)
        screen[at : at + count] = high
        assert (low <= high).all()
    np.testing.assert_array_equal(screen[:200], signal.reshape(200, 10).max(axis=1))

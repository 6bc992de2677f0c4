"""The transducer chain, effect by effect, and the order in which they act."""

import math

import numpy as np
import pytest

from hil_emulator.model.kernel import Kernel, zeros
from hil_emulator.model.layout import named
from hil_emulator.model.sampling import Sensors

PERIOD = 1e-3


class Bench:
    """Sensors on signals that the test sets."""

    def __init__(self, model: Kernel, seed: int = 1, **channels: dict[str, float]) -> None:
        self.vector = zeros(model.signals)
        self.signals = named(self.vector, model.signals)
        self.sensors = Sensors(model, channels, PERIOD, np.random.default_rng(seed))

    def read(self, channel: str, values: np.ndarray, signal: str = "") -> np.ndarray:
        """Return the readings of a channel while its signal takes values tick by tick."""
        index = self.sensors.names.index(channel)
        readings = np.empty(len(values))
        for i, value in enumerate(values):
            self.signals[signal or channel] = value
            self.sensors.sample(self.vector)
            readings[i] = self.sensors.reading[index]
        return readings

    def overrange(self, channel: str) -> int:
        """Return the over-range flag of a channel."""
        return int(self.sensors.overrange[self.sensors.names.index(channel)])


def test_a_perfect_channel_reports_its_signal(model: Kernel) -> None:
    """With every effect off the reading is the signal, bit for bit."""
    values = np.random.default_rng(3).normal(size=50) * 1e5
    assert np.array_equal(Bench(model).read("pressure_a", values), values)


def test_gain_error_and_offset_make_a_straight_line(model: Kernel) -> None:
    """The gain acts before the offset: y = (1 + g) x + o."""
    bench = Bench(model, load_force={"gain_error_relative": 0.02, "offset_value": 30.0})
    assert bench.read("load_force", np.array([0.0, 1000.0])) == pytest.approx([30.0, 1050.0])


def test_gain_error_scales_the_reading(model: Kernel) -> None:
    """A cell that reads 3 % high does so at every load."""
    bench = Bench(model, load_force={"gain_error_relative": 0.03})
    readings = bench.read("load_force", np.array([-2000.0, 1000.0]))
    assert readings == pytest.approx([-2060.0, 1030.0])


def test_offset_shifts_the_reading(model: Kernel) -> None:
    """An unloaded cell with a zero error of -181 N reads it."""
    bench = Bench(model, load_force={"offset_value": -181.0})
    assert bench.read("load_force", np.array([0.0]))[0] == -181.0


def test_nonlinearity_is_odd_and_largest_at_full_scale(model: Kernel) -> None:
    """Half a percent at one span (10 kN), an eighth of a percent of span at half of it."""
    bench = Bench(model, load_force={"nonlinearity_relative": 0.005})
    readings = bench.read("load_force", np.array([1e4, 5e3, -5e3]))
    assert readings == pytest.approx([10050.0, 5012.5, -5012.5])


def test_slope_asymmetry_has_two_slopes(model: Kernel) -> None:
    """Tension reads 1 % high and compression 1 % low."""
    bench = Bench(model, load_force={"slope_asymmetry_relative": 0.01})
    readings = bench.read("load_force", np.array([1000.0, -1000.0]))
    assert readings == pytest.approx([1010.0, -990.0])


def test_crosstalk_adds_a_part_of_the_transverse_force(model: Kernel) -> None:
    """2 % of a transverse force of 500 N are 10 N in the load channel."""
    bench = Bench(model, load_force={"crosstalk_relative": 0.02})
    bench.signals.transverse_force = 500.0
    assert bench.read("load_force", np.array([0.0]))[0] == pytest.approx(10.0)


def test_delay_reports_the_past(model: Kernel) -> None:
    """Two and a half ticks late: half of one old sample, half of the one before."""
    values = np.arange(10.0)
    readings = Bench(model, position={"delay_time": 2.5e-3}).read("position", values)
    assert readings[3:] == pytest.approx(values[3:] - 2.5)
    assert np.all(readings[:2] == 0.0)


def test_noise_has_its_sigma_and_is_white(model: Kernel) -> None:
    """Standard deviation within 3 %, no correlation from tick to tick, normal tails."""
    bench = Bench(model, load_force={"noise_sigma": 16.7})
    readings = bench.read("load_force", np.zeros(10_000))
    assert readings.std() == pytest.approx(16.7, rel=0.03)
    assert abs(readings.mean()) < 4 * 16.7 / 100
    whitened = np.correlate(readings, readings, "full")[10_000:10_020] / (readings @ readings)
    assert np.all(np.abs(whitened) < 0.05)
    assert np.mean(np.abs(readings) > 2 * 16.7) == pytest.approx(0.0455, abs=0.01)


def test_each_channel_has_independent_noise(model: Kernel) -> None:
    """A channel's noise follows from seed and place alone: another channel more changes nothing."""
    bench = Bench(model, 5, position={"noise_sigma": 1.0})
    place = bench.sensors.names.index("position")
    stream = np.random.default_rng(5).spawn(place + 1)[place]
    assert np.array_equal(bench.read("position", np.zeros(300)), stream.standard_normal(300))


def test_noise_follows_its_seed(model: Kernel) -> None:
    """The same seed gives the same readings, another seed others; channels differ."""
    noisy = {"noise_sigma": 1.0}

    def run(seed: int) -> np.ndarray:
        return Bench(model, seed, pressure_a=noisy).read("pressure_a", np.zeros(300))

    assert np.array_equal(run(7), run(7))
    assert not np.array_equal(run(7), run(8))
    bench = Bench(model, pressure_a=noisy, pressure_b=noisy)
    bench.read("pressure_a", np.zeros(1))
    assert bench.sensors.reading[0] != bench.sensors.reading[1]


def test_resolution_rounds_to_steps(model: Kernel) -> None:
    """Readings are whole steps and never more than half a step off."""
    values = np.linspace(-1e5, 1e5, 777)
    readings = Bench(model, pressure_a={"resolution_step": 6.1e3}).read("pressure_a", values)
    assert readings / 6.1e3 == pytest.approx(np.round(readings / 6.1e3), abs=1e-9)
    assert np.abs(readings - values).max() <= 0.5 * 6.1e3 + 1e-6


def test_measuring_range_clips_and_sets_its_flag(model: Kernel) -> None:
    """Beyond an end the reading stays there, and the flag names the end."""
    limits = {"measuring_range_upper": 5000.0, "measuring_range_lower": -5000.0}
    bench = Bench(model, load_force=limits)
    recorded = []
    for value in (-6000.0, 100.0, 6000.0):
        reading = bench.read("load_force", np.array([value]))[0]
        recorded.append((reading, bench.overrange("load_force")))
    assert recorded == [(-5000.0, -1), (100.0, 0), (5000.0, 1)]


def test_hum_is_one_line_of_the_spectrum(model: Kernel) -> None:
    """One second of 50 Hz: all the power in that bin, with the stated amplitude."""
    bench = Bench(model, pressure_a={"hum_amplitude": 2e4})
    spectrum = np.abs(np.fft.rfft(bench.read("pressure_a", np.zeros(1000)))) / 500
    assert np.argmax(spectrum) == 50
    assert spectrum[50] == pytest.approx(2e4, rel=1e-6)
    assert np.delete(spectrum, 50).max() < 1.0


def test_creep_adds_its_part_slowly(model: Kernel) -> None:
    """A held load ends 0.1 % higher, 63 % of that after one time constant."""
    bench = Bench(model, load_force={"creep_relative": 0.001, "creep_time_constant": 1.0})
    readings = bench.read("load_force", np.full(5000, 1000.0))
    assert readings[999] == pytest.approx(1000.0 + (1 - math.exp(-1)), abs=1e-3)
    assert readings[-1] == pytest.approx(1001.0, abs=0.01)


def test_zero_drift_grows_with_time(model: Kernel) -> None:
    """1e-3 of the 10 kN span per second: 10 N after a second, starting at zero."""
    bench = Bench(model, load_force={"zero_drift_rate": 1e-3})
    readings = bench.read("load_force", np.zeros(1001))
    assert readings[0] == 0.0
    assert readings[-1] == pytest.approx(10.0)


def test_velocity_estimator_is_the_mean_of_the_differences(model: Kernel) -> None:
    """S2 eq. 9-10: the mean of n differences quotients over n ticks, not their sum."""
    rng = np.random.default_rng(5)
    position = 0.04 + np.cumsum(rng.normal(size=200)) * 1e-5
    n = 10
    bench = Bench(model, velocity={"velocity_estimator_window": n * PERIOD})
    readings = bench.read("velocity", position, signal="position")
    quotients = np.diff(position) / PERIOD
    means = np.convolve(quotients, np.ones(n) / n, "valid")
    assert readings[n:] == pytest.approx(means, abs=1e-9)


def test_velocity_estimator_trails_by_half_its_window(model: Kernel) -> None:
    """-3 dB at 0.443/window = 44 Hz for 10 ms and a null at 100 Hz; it sees position's steps."""
    bench = Bench(model, velocity={"velocity_estimator_window": 10e-3},
                  position={"resolution_step": 3.5e-6})  # fmt: skip
    t = PERIOD * np.arange(2000)
    gains = []
    for frequency in (5.0, 44.3, 100.0):
        w = 2 * math.pi * frequency
        readings = bench.read("velocity", 1e-2 * np.sin(w * t), signal="position")[1000:]
        fundamental = 2 * np.mean(readings * np.exp(-1j * w * t[1000:]))
        gains.append(abs(fundamental) / (1e-2 * w))
    assert gains[0] == pytest.approx(1.0, abs=0.01)
    assert gains[1] == pytest.approx(math.sqrt(0.5), abs=0.02)
    assert gains[2] < 0.01
    steps = readings * 10e-3 / 3.5e-6
    assert steps == pytest.approx(np.round(steps), abs=1e-6)


def test_over_range_flags_the_clipped_reading_with_noise_inside(model: Kernel) -> None:
    """Noise is clipped too: the chain ends with the range."""
    bench = Bench(model, load_force={"noise_sigma": 100.0, "measuring_range_upper": 5000.0})
    assert bench.read("load_force", np.full(500, 4990.0)).max() == 5000.0

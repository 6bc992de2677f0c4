"""Sensor faults as a controller sees them: in PDOs and emergencies."""

import itertools
import statistics
from typing import Any

import numpy as np
import pytest
from runs import BEGIN, END, PLACES, Run, codes, run, sound, values

CASES: list[tuple[str, str, dict[str, Any]]] = [
    ("load_force", "off", {}),
    ("pressure_b", "wire_break", {}),
    ("pressure_a", "stuck", {}),
    ("pressure_a", "offset", {"value": "3 bar"}),
    ("position", "gain", {"factor": 1.5}),
    ("pressure_b", "drift", {"rate": "20 bar/s"}),
    ("load_force", "noise", {"deviation": "200 N"}),
    ("pressure_b", "hum", {"amplitude": "2 bar", "frequency": "60 Hz"}),
    ("position", "spike", {"height": "10 mm", "probability": 0.2}),
    ("position", "delay", {"time": "20 ms"}),
    ("pressure_a", "dropout", {}),
    ("supply_pressure", "over_range", {}),
    ("pressure_a", "swapped", {"channel": "pressure_b"}),
]


def faulty(kind: str) -> tuple[str, Run]:
    """Return the target and the run of a case."""
    target, _, options = next(case for case in CASES if case[1] == kind)
    return target, run(target, kind, **options)


@pytest.mark.parametrize(("target", "kind", "options"), CASES, ids=lambda v: str(v)[:12])
def test_only_the_faulty_channel_differs_and_its_end_leaves_no_trace(
    target: str, kind: str, options: dict[str, Any]
) -> None:
    """Before and after, every frame is that of the sound rig; meanwhile the other channels are."""
    heard = run(target, kind, **options)
    assert heard[:BEGIN] == sound()[:BEGIN]
    ignored = 0x085  # an emergency is part of some faults
    after = [[f for f in tick if f.can_id != ignored] for tick in heard[END:]]
    assert after == [[f for f in tick if f.can_id != ignored] for tick in sound()[END:]]
    for channel in PLACES:
        if channel not in (target, options.get("channel")):
            assert values(heard, channel) == values(sound(), channel), channel
    assert values(heard, target) != values(sound(), target)


def test_a_sensor_that_is_off_reads_zero_and_is_reported() -> None:
    """The load cell reads 0 N; one emergency reports the range error, one its end."""
    target, heard = faulty("off")
    assert set(values(heard, target)) == {0.0}
    assert codes(heard) == [0xFF10 + 4, 0x0000]


def test_a_broken_wire_of_an_input_without_live_zero_reads_zero() -> None:
    """No current is 0 bar; `test_io_module` has an input of 4 to 20 mA."""
    target, heard = faulty("wire_break")
    assert set(values(heard, target)) == {0.0}
    assert codes(heard) == [0xFF10 + 1, 0x0000]


def test_a_stuck_sensor_keeps_its_reading() -> None:
    """One value for 100 ms while the sound one moves."""
    target, heard = faulty("stuck")
    assert len(set(values(heard, target))) == 1
    assert len(set(values(sound(), target))) > 10


def test_an_offset_adds_to_each_sample() -> None:
    """Three bar more, within half a count of the PDO."""
    target, heard = faulty("offset")
    difference = np.subtract(values(heard, target), values(sound(), target))
    assert difference == pytest.approx(3e5, abs=1e3)


def test_a_wrong_gain_multiplies() -> None:
    """Half as much again."""
    target, heard = faulty("gain")
    assert values(heard, target) == pytest.approx(1.5 * np.array(values(sound(), target)), abs=1e-7)


def test_a_drift_grows_with_time() -> None:
    """20 bar/s are 2 bar after 100 ms."""
    target, heard = faulty("drift")
    difference = np.subtract(values(heard, target), values(sound(), target))
    assert difference == pytest.approx(20e5 * np.arange(100) * 1e-3, abs=1e3)


def test_noise_has_its_deviation() -> None:
    """100 samples of 200 N scatter by 200 N, within what chance allows."""
    target, heard = faulty("noise")
    difference = np.subtract(values(heard, target), values(sound(), target))
    assert 150 < statistics.pstdev(difference) < 260


def test_hum_has_one_line_in_the_spectrum() -> None:
    """Six periods in 100 ms: the Fourier sum has the amplitude at 60 Hz, and nothing elsewhere."""
    target, heard = faulty("hum")
    difference = np.subtract(values(heard, target), values(sound(), target))
    amplitudes = np.abs(np.fft.rfft(difference)) / 50
    assert amplitudes[6] == pytest.approx(2e5, rel=1e-2)
    assert np.delete(amplitudes, 6).max() < 1e3  # half a count of the PDO


def test_spikes_befall_single_samples() -> None:
    """Some samples are 10 mm off, most are right."""
    target, heard = faulty("spike")
    difference = np.subtract(values(heard, target), values(sound(), target))
    assert set(np.round(difference, 6)) == {0.0, 0.01}
    assert 5 < np.count_nonzero(difference) < 40


def test_a_delayed_sensor_shows_the_past() -> None:
    """After 20 ms of its last value it shows what it read 20 ms before."""
    target, heard = faulty("delay")
    late, true = values(heard, target), values(sound(), target)
    assert set(late[:21]) == {true[0]}
    assert late[20:] == true[:-20]


def test_a_dropout_repeats_the_last_sample() -> None:
    """Where a sample differs from the sound one it is the one before it."""
    target, heard = faulty("dropout")
    late, true = values(heard, target), values(sound(), target)
    lost = [k for k in range(100) if late[k] != true[k]]
    assert 20 < len(lost) < 80
    assert all(late[k] == late[k - 1] for k in lost)


def test_over_range_reads_the_end_and_is_reported() -> None:
    """The supply sensor shows 257.8 bar and its emergency; its end is reported too."""
    target, heard = faulty("over_range")
    assert values(heard, target) == pytest.approx([257.8e5] * 100, abs=1e3)
    assert codes(heard) == [0xFF10 + 2, 0x0000]


def test_swapped_sensors_show_each_others_values() -> None:
    """Pressure a is in the place of b, and b in that of a."""
    _, heard = faulty("swapped")
    assert values(heard, "pressure_a") == values(sound(), "pressure_b")
    assert values(heard, "pressure_b") == values(sound(), "pressure_a")


def test_a_ramp_lets_it_grow() -> None:
    """An offset of 10 bar over 100 ms is 5 bar in the middle."""
    heard = run("pressure_a", "offset", value="10 bar", ramp="100 ms")
    difference = np.subtract(values(heard, "pressure_a"), values(sound(), "pressure_a"))
    assert difference == pytest.approx(10e5 * np.arange(100) / 100, abs=1e3)


def test_start_and_duration_count_emulator_time() -> None:
    """An offset from 20 ms on for 30 ms begins and ends in those ticks."""
    heard = run("position", "offset", value="1 mm", start="20 ms", duration="30 ms")
    difference = np.subtract(values(heard, "position"), values(sound(), "position"))
    assert np.flatnonzero(np.abs(difference) > 1e-4).tolist() == list(range(20, 50))


def test_a_condition_decides_when_it_begins() -> None:
    """It begins the tick after the rod has passed its bound, and then stays."""
    bound = values(sound(), "position")[60]
    rising = values(sound(), "position")[59] < bound
    sign = ">=" if rising else "<="
    text = f"position {sign} {bound * 1e3:.6f} mm and time > 150 ms"
    heard = run("position", "offset", value="1 mm", condition=text)
    difference = np.subtract(values(heard, "position"), values(sound(), "position"))
    wrong = np.flatnonzero(np.abs(difference) > 1e-4)
    assert wrong.tolist() == list(range(wrong[0], 100))
    assert 50 <= wrong[0] <= 62


def test_the_seed_decides_the_chances() -> None:
    """The same seed gives the same samples, another one others."""
    runs = [run("position", "dropout", seed=seed) for seed in (3, 3, 4)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_two_faults_of_one_channel_add_up() -> None:
    """The later one acts on what the earlier one left."""
    from rigs import bench, reference

    with bench(reference()) as b:
        b.ticks(5)
        with (
            b.rig.fault("position", "gain", factor=0.0),
            b.rig.fault("position", "offset", value="7 mm"),
        ):
            b.tick()
            assert b.rig.value("position") == pytest.approx(7e-3)
        b.tick()
        assert b.rig.value("position") == pytest.approx(0.04, abs=1e-4)


def test_pairs_of_ticks_are_consecutive() -> None:
    """The script itself misses no sample: the comparison above compares like with like."""
    counters = [f.data[-2:] for tick in sound()[10:] for f in tick if f.can_id == 0x285]
    numbers = [int.from_bytes(c, "little") for c in counters]
    assert all(b - a == 1 for a, b in itertools.pairwise(numbers))

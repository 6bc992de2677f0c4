"""The driver of the valve: ramp, jump over the dead band, loop around the spool, dither."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import record, settle
from reference_machine import pond

from hil_emulator.identify.data_checks.dither import averaged
from hil_emulator.model.plant import Plant

MakePlant = Callable[[dict[str, float]], Plant]


def test_ramp_rises_at_its_rate_and_ends_at_the_set_point(make_plant: MakePlant) -> None:
    """After a step to 5 mA at 0.1 A/s: 2 mA after 20 ms, 5 mA in the end, and no more."""
    plant = make_plant(pond(ramp_rate=0.1))
    plant.inputs.valve_current = 5e-3
    settle(plant, 0.02)
    assert plant.signals.valve_current == pytest.approx(2e-3, rel=1e-3)
    settle(plant, 0.06)
    assert plant.signals.valve_current == pytest.approx(5e-3, rel=1e-6)


def test_dead_band_compensation_undoes_an_overlap(make_plant: MakePlant) -> None:
    """With a jump as wide as the overlap the flows are those of zero lap, in both directions."""
    turbulent = {"valve_critical_reynolds_number": 0.0}
    lapped = turbulent | {"overlap_lap": 2e-3, "dead_band_compensation_jump": 2e-3,
                          "dead_band_compensation_window": 1e-4}  # fmt: skip
    for current in (1e-3, -4e-4):
        flows = []
        for valve in (turbulent, lapped):
            plant = make_plant(pond(**valve))
            plant.inputs.valve_current = current
            settle(plant, 0.02)
            flows.append(float(plant.signals.flow_a))
        assert flows[0] == pytest.approx(flows[1], rel=1e-3)


def test_spool_feedback_removes_a_bias_at_its_bandwidth(make_plant: MakePlant) -> None:
    """A bias falls as exp(s t) with s (1 + 2 D s/w + s²/w²) = -2 pi f; friction's error goes."""
    hertz, bias, w = 5.0, 2e-4, 2 * math.pi * 250.0
    loop = {"spool_feedback_bandwidth": hertz, "spool_feedback_authority": 5e-3}
    plant = make_plant(pond(null_bias_bias=bias, **loop))
    settle(plant, 0.02)
    early = float(plant.signals.spool_position)
    settle(plant, 0.03)
    late = float(plant.signals.spool_position)
    slowest = max(np.roots([1 / w**2, 2 * 0.7 / w, 1.0, 2 * math.pi * hertz]).real)
    assert late / early == pytest.approx(math.exp(slowest * 0.03), rel=5e-3)
    loops = {"threshold_current": 5e-5, "hysteresis_width": 3e-4}
    stuck, moved = make_plant(pond(**loops)), make_plant(pond(**loops, **loop))
    for plant in (stuck, moved):
        plant.inputs.valve_current = 3e-3
        settle(plant, 0.5)
    assert abs(stuck.signals.spool_position - 3e-3) > 1e-4
    assert moved.signals.spool_position == pytest.approx(3e-3, abs=1e-6)


def test_dither_is_a_sine_on_the_current_and_frees_a_sticking_spool(make_plant: MakePlant) -> None:
    """The current is u + a sin(2 pi f t); 20 uA move a spool that else sticks within 25 uA."""
    plant = make_plant(pond(dither_amplitude=2e-4, dither_frequency=100.0))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.0125)  # five quarters of a period
    assert plant.signals.valve_current == pytest.approx(1.2e-3, rel=1e-3)
    means = []
    for amplitude in (0.0, 2e-4):
        plant = make_plant(
            pond(threshold_current=2.5e-5, dither_amplitude=amplitude, dither_frequency=100.0)
        )
        plant.inputs.valve_current = 2e-5
        settle(plant, 0.1)
        rows = []
        for _ in range(50):
            settle(plant, 2e-4)
            rows.append(float(plant.signals.spool_position))
        means.append(sum(rows) / len(rows))
    assert means[0] == 0.0
    assert means[1] == pytest.approx(2e-5, rel=0.1)


@pytest.mark.parametrize(("amplitude", "kept"), [
    (3e-4, set()),
    (1.2e-4, {"hysteresis_width"}),
    (5e-5, {"hysteresis_width", "threshold_current"}),
])  # fmt: skip
def test_averaged_dither_keeps_what_it_does_not_dissolve(amplitude: float, kept: set[str]) -> None:
    """A hysteresis of 0.3 mA from 0.15 mA on, a threshold of 0.1 mA from 0.1 mA on."""
    loops = {"hysteresis_width": 3e-4, "threshold_current": 1e-4}
    changes, (note,) = averaged(pond(**loops, dither_amplitude=amplitude, dither_frequency=150.0))
    assert {name for name in loops if name not in changes} == kept
    assert ("trembles" in note) is ("threshold_current" not in kept)
    assert averaged(pond(**loops)) == ({}, [])


def test_averaged_dither_is_the_mean_of_the_trembling_spool(make_plant: MakePlant) -> None:
    """On a slow ramp up and down the mean position has no loop, as that of the averaged spool."""
    valve = pond(hysteresis_width=3e-4, threshold_current=1e-4, dither_amplitude=3e-4,
                 dither_frequency=150.0)  # fmt: skip
    loops = []
    for changes in ({}, averaged(valve)[0], {"dither_amplitude": 0.0}):
        plant = make_plant({**valve, **changes})
        positions = []
        for current in (*np.linspace(-2e-3, 2e-3, 60), *np.linspace(2e-3, -2e-3, 60)):
            plant.inputs.valve_current = float(current)
            positions.append(np.mean(record(plant, 333, "spool_position")[0]))  # one period
        loops.append(float(np.median((positions[:59:-1] - np.array(positions[:60]))[10:-10])))
    trembling, mean, still = loops
    assert still > 3e-4
    assert trembling == pytest.approx(mean, abs=0.1 * still)

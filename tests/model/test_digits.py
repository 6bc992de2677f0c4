"""Readings as digits: the same numbers as from the rounding of the object dictionary."""

import math

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.device import packed_tpdos
from hil_emulator.model import digits
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.simulation.assembly import compiled


@pytest.mark.parametrize(
    ("value", "shown"),
    [(0.5, 0), (1.5, 2), (-0.5, 0), (-2.5, -2), (126.6, 127), (127.4, 127), (-128.2, -128),
     (1e300, 127), (-math.inf, -128), (math.nan, -128)],
)  # fmt: skip
def test_digits_are_rounded_to_even_and_saturated(value: float, shown: int) -> None:
    """Halves go to even, what is beyond a type is its end, and what is no number its lowest."""
    assert digits.digitise(value, -128.0, 127.0) == shown


def test_a_word_has_its_least_significant_byte_first() -> None:
    """A reading, a wrapped count and a time, each at its place."""
    words = np.array(
        [[0, 0.1, -32768, 32767, 1, 2], [digits.COUNT, 1, 3, 0xFF, 0, 1],
         [digits.TIME, 1, 0, 0xFFFFFF, 3, 3]], dtype=np.float64,
    )  # fmt: skip
    record = np.zeros(6, np.uint8)
    digits.pack(np.array([-25.8]), 254, 0x01020304, words, record)
    assert record.tobytes() == bytes([1, 0xFE, 0xFE, 0x04, 0x03, 0x02])


def test_model_and_device_mean_the_same_by_count_and_time() -> None:
    """Neither imports the other, so that their names for it are compared here."""
    assert (packed_tpdos.COUNT, packed_tpdos.TIME) == (digits.COUNT, digits.TIME)


def test_each_state_of_the_ranges_has_a_different_number() -> None:
    """0 where no channel is at an end of its range."""
    states = [(a, b, c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1)]
    codes = [digits.range_code(np.array(state)) for state in states]
    assert len(set(codes)) == len(states)
    assert codes[states.index((0, 0, 0))] == 0


def test_machine_code_packs_what_the_sensors_report() -> None:
    """A record laid out in the midst of a run shows the next sample, count and time."""
    config = load([shipped("configs/hyq_knee.toml")])
    kernel = compiled(config.effects, cache_folder())
    plant = Plant(kernel, config.plant, config.step)
    sensors = Sensors(kernel, config.sensors, 1e-3, np.random.default_rng(1))
    sensors.sample(plant.signal_vector, plant.path)
    at = sensors.names.index("position")
    sensors.lay_out([(at, 1e-7, -(2**31), 2**31 - 1, 0, 4), (digits.COUNT, 1, 5, 0xFF, 4, 1)], 5)
    sensors.again(0)
    assert int.from_bytes(sensors.record[:4], "little") == round(sensors.reading[at] / 1e-7)
    assert sensors.record[4] == sensors.count + 5 == 6

"""What each effect of the plant alone costs: a step with it on, beside one without it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.config.load import Configuration
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Plant
from hil_emulator.model.stages import SAMPLED
from hil_emulator.simulation.assembly import compiled

_STEPS = 1_000  # integration steps timed at once: short, so that some are undisturbed
_REPEATS = 100  # the best is kept: everything else on the machine can only slow it down


@dataclass(frozen=True)
class EffectCost:
    """The cost of one effect.

    Attributes:
        effect: its name.
        step_us: a step of the actuator with it on, at its typical value [us].
        relative: that over a step without it; both of a model that knows the whole catalogue.

    """

    effect: str
    step_us: float
    relative: float


def measure_effects(
    config: Configuration, cache: Path, say: Callable[[str], None]
) -> list[EffectCost]:
    """Switch on, one at a time, what the configuration leaves off; the dearest first."""
    say("Preparing the model ...")
    model = compiled(config.effects, cache)
    found = [_cost(model, config, effect) for effect in config.effects if _is_off(effect, config)]
    return sorted(found, key=lambda cost: -cost.relative)


def _is_off(effect: Effect, config: Configuration) -> bool:
    value = config.plant.get(effect.field_of(effect.knob), effect.off)
    return effect.stage not in SAMPLED and not is_on(effect, value)


def _cost(model: Kernel, config: Configuration, effect: Effect) -> EffectCost:
    """Measure both in turn, so that what slows the machine slows both."""
    typical = {effect.field_of(effect.knob): effect.knob.typical}
    plants = [Plant(model, config.plant | changes, config.step) for changes in ({}, typical)]
    without, beside = (min(times) for times in zip(
        *([_step_us(plant) for plant in plants] for _ in range(_REPEATS)), strict=True
    ))  # fmt: skip
    return EffectCost(effect.name, beside, beside / without)


def _step_us(plant: Plant) -> float:
    plant.restart()
    begin = time.perf_counter()
    plant.step(_STEPS)
    return (time.perf_counter() - begin) / _STEPS * 1e6

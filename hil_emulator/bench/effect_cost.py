"""Computing time of each effect of the plant: an integration step with the effect and without."""

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
        effect: name of the effect.
        step_us: integration step with the effect at its typical value [us].
        relative: `step_us` over a step without the effect; both models have the whole catalogue.

    """

    effect: str
    step_us: float
    relative: float


def measure_effects(
    config: Configuration, cache: Path, report: Callable[[str], None]
) -> list[EffectCost]:
    """Return the cost of each effect that the configuration leaves off, the highest first."""
    report("Preparing the model ...")
    model = compiled(config.effects, cache)
    costs = [_cost(model, config, effect) for effect in config.effects if _is_off(effect, config)]
    return sorted(costs, key=lambda cost: -cost.relative)


def _is_off(effect: Effect, config: Configuration) -> bool:
    value = config.plant.get(effect.field_of(effect.knob), effect.off)
    return effect.stage not in SAMPLED and not is_on(effect, value)


def _cost(model: Kernel, config: Configuration, effect: Effect) -> EffectCost:
    """Measure with and without the effect in turn, so that other load slows both alike."""
    typical = {effect.field_of(effect.knob): effect.knob.typical}
    plants = [Plant(model, config.plant | changes, config.step) for changes in ({}, typical)]
    without, with_effect = (min(times) for times in zip(
        *([_step_us(plant) for plant in plants] for _ in range(_REPEATS)), strict=True
    ))  # fmt: skip
    return EffectCost(effect.name, with_effect, with_effect / without)


def _step_us(plant: Plant) -> float:
    plant.restart()
    begin = time.perf_counter()
    plant.step(_STEPS)
    return (time.perf_counter() - begin) / _STEPS * 1e6

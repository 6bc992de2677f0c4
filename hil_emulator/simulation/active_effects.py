"""Selection of the effects that can act in a run: on, or switched on by a fault.

An effect that is off changes no bit of the result, but checking a few dozen such effects in every
evaluation takes a quarter of the time. So a run's model is compiled without them.
"""

import dataclasses
from collections.abc import Mapping, Sequence

from hil_emulator.config.load import Configuration
from hil_emulator.faults.plant import FAULTY_PARAMETERS
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.effects.transducer import measuring_range


def acting(config: Configuration) -> Configuration:
    """Return the configuration without the effects that cannot act in a run.

    Its rig computes the same bits. A parameter of a removed effect cannot be set in that rig;
    faults and settings never need one.
    """
    return acting_together([config])[0]


def acting_together(configs: Sequence[Configuration]) -> list[Configuration]:
    """Return configurations without the effects that cannot act in any of them."""
    given = [values for c in configs for values in (c.plant, *c.sensors.values())]
    every = configs[0].effects
    effects = tuple(e for e in every if _can_act(e, given))
    gone = {e.field_of(p) for e in every if e not in effects for p in e.params}
    return [
        dataclasses.replace(
            config,
            effects=effects,
            plant=_without(config.plant, gone),
            sensors={name: _without(values, gone) for name, values in config.sensors.items()},
        )
        for config in configs
    ]


def _can_act(effect: Effect, given: Sequence[Mapping[str, float]]) -> bool:
    knob = effect.field_of(effect.knob)
    if effect is measuring_range:  # every channel reports whether it is within its range
        return True
    if any(effect.field_of(param) in FAULTY_PARAMETERS for param in effect.params):
        return True
    return any(is_on(effect, values.get(knob, effect.off)) for values in given)


def _without(values: Mapping[str, float], gone: set[str]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name not in gone}

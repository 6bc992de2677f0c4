"""What can act in a run: effects that are on, and those that a fault can switch on.

An effect that is off leaves no trace in what is computed, not a bit; but asking a few dozen of them
at every evaluation whether they are on takes a quarter of the time. So a run's model is compiled
without them.
"""

import dataclasses
from collections.abc import Mapping, Sequence

from hil_emulator.config.load import Configuration
from hil_emulator.faults.plant import FAULTY_PARAMETERS
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.effects.transducer import measuring_range


def acting(config: Configuration) -> Configuration:
    """Return the configuration without the effects that cannot act in a run.

    The rig it describes computes the same bits. A parameter of an effect that is gone cannot be
    set in that rig; faults and settings never need one.
    """
    return acting_together([config])[0]


def acting_together(configs: Sequence[Configuration]) -> list[Configuration]:
    """Return configurations that know the same effects without those that can act in none."""
    given = [values for c in configs for values in (c.plant, *c.sensors.values())]
    known = configs[0].effects
    effects = tuple(e for e in known if _can_act(e, given))
    gone = {e.field_of(p) for e in known if e not in effects for p in e.params}
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
    if effect is measuring_range:  # every channel tells whether it is within its range
        return True
    if any(effect.field_of(param) in FAULTY_PARAMETERS for param in effect.params):
        return True
    return any(is_on(effect, values.get(knob, effect.off)) for values in given)


def _without(values: Mapping[str, float], gone: set[str]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name not in gone}

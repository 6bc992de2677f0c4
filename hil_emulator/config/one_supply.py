"""Actuators on one supply: parameters that must agree."""

from collections.abc import Mapping
from dataclasses import replace

from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.layout import supply_params
from hil_emulator.units import show


def on_one_supply(place: str, configs: Mapping[str, Configuration]) -> dict[str, Configuration]:
    """Return the configurations of actuators that share a supply: each knows the others' effects.

    Args:
        place: where the supply is described.
        configs: those actuators' configurations, by name.

    Raises:
        UserError: if they differ in a parameter of the supply.

    """
    effects = _effects_of_all(place, configs)
    first, *others = configs
    for other in others:
        _check_equal(place, effects, {name: configs[name] for name in (first, other)})
    return {
        name: replace(config, effects=effects, supply_mates=tuple(n for n in configs if n != name))
        for name, config in configs.items()
    }


def supply_effects(config: Configuration) -> list[str]:
    """Return which effects of pump, accumulator and lines are on in a configuration."""
    common = supply_params(config.effects)
    knobs = {effect: effect.field_of(effect.knob) for effect in config.effects}
    return [
        effect.name for effect, knob in knobs.items()
        if knob in common and effect.stage.table != "oil"
        and is_on(effect, config.plant.get(knob, effect.off))
    ]  # fmt: skip


def _effects_of_all(place: str, configs: Mapping[str, Configuration]) -> tuple[Effect, ...]:
    """Return the catalogue and every actuator's own effects."""
    union: dict[str, Effect] = {}
    for name, config in configs.items():
        for effect in config.effects:
            all_effects = union.setdefault(effect.name, effect)
            if all_effects.law.__module__ != effect.law.__module__:
                raise UserError(
                    f"{place}: {name}: its effect {effect.name} is not that of the other actuators "
                    "on this supply, which are computed together; rename one of the two"
                )
    return tuple(union.values())


def _check_equal(
    place: str, effects: tuple[Effect, ...], pair: Mapping[str, Configuration]
) -> None:
    """Refuse two actuators that describe different supplies."""
    (first, one), (second, other) = pair.items()
    if one.step != other.step:
        raise UserError(f"{place}: {first} and {second} need the same [rig] step")
    off = {effect.field_of(effect.knob): effect.off for effect in effects}
    for field, param in supply_params(effects).items():
        values = [config.plant.get(field, off.get(field)) for config in (one, other)]
        if values[0] != values[1]:
            stated = ["nothing" if v is None else show(v, param.unit, param.shown) for v in values]
            raise UserError(
                f"{place}: {first} and {second} differ in {field}: {stated[0]} and {stated[1]}; "
                "a supply has it once, so state it in the supply's files"
            )

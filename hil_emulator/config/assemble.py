"""From checked tables to a `Configuration`: parameters of the model, nodes, bus."""

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hil_emulator.config.bench import described
from hil_emulator.config.bus import DEFAULT_BUS, WireSettings, split
from hil_emulator.config.configuration import Configuration
from hil_emulator.config.derived import derived
from hil_emulator.config.layers import Layers
from hil_emulator.config.nodes import UNCONFIGURED, NodeSettings, NodeTable, node_settings
from hil_emulator.config.partners import partner_settings
from hil_emulator.config.plant import fmu_settings
from hil_emulator.config.rated_current import rated_current
from hil_emulator.config.schema import plant_tables
from hil_emulator.config.table import StrictTable
from hil_emulator.errors import UserError
from hil_emulator.model import rating
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.rating import REFERENCE_CURRENT
from hil_emulator.model.stages import SAMPLED


def configuration(
    checked: Any, layers: Layers, files: Sequence[Path], texts: Sequence[str]
) -> Configuration:
    """Return the configuration of checked tables.

    Args:
        checked: an instance of `schema.schema`.
        layers: the tables before the check.
        files: of the layers.
        texts: of the files.

    Raises:
        UserError: if tables contradict each other.

    """
    effects, origin = layers.effects, layers.origin
    rig = checked.rig
    steps = round(rig.tick / rig.step)
    chain = [e for e in effects if e.stage in SAMPLED]
    channels = type(checked.sensors).model_fields
    bus, wire = split(checked.bus)
    nodes = _nodes(checked.node, wire, origin.get(("node",), files[-1]))
    folder = origin.get(("partner",), files[-1]).parent
    partners = tuple(partner_settings(table, folder) for table in checked.partner)
    fmu = fmu_settings(checked.plant, origin.get(("plant",), files[-1]))
    if fmu and rig.not_finite == "reset":
        raise UserError(
            f'{files[-1]}: [rig] not_finite = "reset" needs the built-in plant: an FMU that has '
            "failed stays so"
        )
    canonical = json.dumps(layers.merged, sort_keys=True, default=str).encode()
    rated = rated_current(layers.merged)
    stated = _plant_values(checked, effects, rated or REFERENCE_CURRENT)
    unsaid = _unsaid(checked, stated)
    return Configuration(
        tick_ns=round(rig.tick * 1e9),
        step=rig.tick / steps,
        steps=steps,
        seed=rig.seed,
        late=rig.late,
        not_finite=rig.not_finite,
        sync_period_ns=round(rig.sync_period * 1e9),
        bus=bus or dict(DEFAULT_BUS),
        wire=wire,
        nodes=nodes,
        effects=effects,
        plant=stated | unsaid,
        unsaid=frozenset(unsaid),
        rated_current=rated,
        stated=frozenset(_stated(checked, effects)),
        tolerances=layers.tolerances,
        sensors={name: _effect_values(getattr(checked.sensors, name), chain) for name in channels},
        digest=hashlib.sha256(canonical).hexdigest()[:16],
        files=tuple(files),
        texts=tuple(texts),
        bench=described(checked.bench),
        fmu=fmu,
        partners=partners,
        rotary=rig.motion == "rotary",
        sheet=checked.valve.quantities(stated["valve_gain"]) | checked.cylinder.quantities(),
    )


def _effect_values(
    table: StrictTable, effects: Sequence[Effect], rated: float = REFERENCE_CURRENT
) -> dict[str, float]:
    """Return the parameters of the effects that a table sets, by record field.

    A default that is relative to the rated current [A] is that of the valve.
    """
    return {
        effect.field_of(param): _value(chosen, param, effect.stage.table, rated)
        for effect in effects
        if (chosen := getattr(table, effect.name, None)) is not None
        for param in effect.params
    }


def _value(table: StrictTable, param: Param, name: str, rated: float) -> float:
    """Return a value of a table, NaN if it is absent; a default of the valve at its rating."""
    value = getattr(table, param.name)
    if value is None:
        return math.nan
    by_default = name in rating.TABLES and param.name not in table.model_fields_set
    return float(value) * (rating.scale(param, rated) if by_default else 1.0)


def _plant_values(checked: Any, effects: Sequence[Effect], rated: float) -> dict[str, float]:
    values: dict[str, float] = {}
    for name in plant_tables(effects):
        table = getattr(checked, name)
        for param in PARAMS.get(name, ()):
            values[f"{name}_{param.name}"] = _value(table, param, name, rated)
        on = [e for e in effects if e.stage.table == name]
        values |= _effect_values(table, on, rated)
    values |= checked.valve.gains(values)
    values |= checked.cylinder.areas()
    values |= checked.load.weight(values["load_mass"])
    return values


def _stated(checked: Any, effects: Sequence[Effect]) -> Iterator[str]:
    """Yield the fields of the plant that a file states, rather than a default."""
    for name in plant_tables(effects):
        table = getattr(checked, name)
        yield from (f"{name}_{key}" for key in table.model_fields_set)
        for effect in (e for e in effects if e.stage.table == name):
            if chosen := getattr(table, effect.name, None):
                yield from (f"{effect.name}_{key}" for key in chosen.model_fields_set)


def _unsaid(checked: Any, stated: dict[str, float]) -> dict[str, float]:
    """Return the derived values of a configuration of a whole actuator."""
    if not described(checked.bench).whole:
        return {}
    follows = derived(checked.valve.rated_current, stated, checked.rig.step)
    return {name: value for name, value in follows.items() if name not in stated}


def _nodes(tables: Sequence[NodeTable], wire: WireSettings, file: Path) -> tuple[NodeSettings, ...]:
    nodes = tuple(node_settings(table, file.parent) for table in tables)
    ids = [node.id for node in nodes if node.id != UNCONFIGURED]
    for number in {i for i in ids if ids.count(i) > 1}:
        raise UserError(f"{file}: two nodes have the ID {number}; each node on a bus needs its own")
    for node in nodes:
        if node.bit_rate and wire.bit_rate and node.bit_rate != wire.bit_rate:
            raise UserError(
                f"{file}: node {node.id} has {node.bit_rate / 1e3:g} kbit/s, its bus "
                f"{wire.bit_rate / 1e3:g} kbit/s; one bus has one bit rate"
            )
    return nodes

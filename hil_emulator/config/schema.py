"""The schema, derived from the model's declarations, as pydantic models."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler, create_model

from hil_emulator.config import datasheet
from hil_emulator.config.bench import BenchTable, Kind
from hil_emulator.config.bus import BusTable
from hil_emulator.config.nodes import NodeTable
from hil_emulator.config.partners import PartnerTable
from hil_emulator.config.plant import PlantTable
from hil_emulator.config.rated_current import RatedReader
from hil_emulator.config.table import QuantityReader, StrictTable
from hil_emulator.config.tables import (
    ChannelTable,
    CylinderAside,
    CylinderDatasheet,
    LinesTable,
    LoadTable,
    ModelTable,
    OneSidedCylinder,
    RigTable,
    ValveAside,
    ValveDatasheet,
)
from hil_emulator.model import rating
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.sensors import CHANNELS, Channel
from hil_emulator.model.stages import SAMPLED


def _reader(param: Param, table: str, words: Mapping[str, float] | None = None) -> QuantityReader:
    kind = RatedReader if table in rating.TABLES and rating.depends(param) else QuantityReader
    return kind(param, words or {})


def _field(param: Param, table: str) -> Any:
    return Annotated[float, _reader(param, table)]


@dataclass(frozen=True)
class KnobAlone:
    """An effect's table, for which its knob can stand."""

    effect: Effect

    @property
    def knob(self) -> QuantityReader:
        """Reader of the knob."""
        return _reader(self.effect.knob, self.effect.stage.table, {"off": self.effect.off})

    def __get_pydantic_json_schema__(
        self, core_schema: Any, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return the description of the effect for editors."""
        e = self.effect
        lines = (f"{e.equation}: {e.words}", f"seen in: {e.signature}", f"source: {e.source}",
                f"{e.knob.name}: {self.knob.description}")  # fmt: skip
        whole = handler(core_schema)
        return {"anyOf": [*self.knob.forms, whole], "description": "\n".join(lines)}


def _effect_table(effect: Effect) -> Any:
    """Return the model of one effect: its knob and its shape parameters."""
    knob = Annotated[float, KnobAlone(effect).knob]
    fields: dict[str, Any] = {effect.knob.name: (knob, ...)}
    for param in effect.shape:
        default = param.typical if param.default is None else param.default
        fields[param.name] = (_field(param, effect.stage.table), default)
    return create_model(effect.name, __base__=StrictTable, **fields)


def _optional(effect: Effect) -> Any:
    """Return annotation and default of an effect that a table may set."""
    return (Annotated[_effect_table(effect) | None, KnobAlone(effect)], None)


def _in_channel_unit(effect: Effect, channel: Channel) -> Effect:
    """Return a transducer effect with its quantities in the channel's own unit."""

    def scaled(param: Param) -> Param:
        if param.unit != "span":
            return param
        typical, low, high = (v * channel.span for v in (param.typical, param.low, param.high))
        return replace(
            param, unit=channel.unit, typical=typical, low=low, high=high, shown=channel.shown
        )

    shape = tuple(scaled(p) for p in effect.shape)
    return replace(effect, knob=scaled(effect.knob), shape=shape)


def _base(table: str, kind: Kind) -> type[StrictTable]:
    """Return the base class of a table's model."""
    if table == "valve":
        return ValveDatasheet if kind.needs.get(table) else ValveAside
    if table in ("lines", "load"):
        return LinesTable if table == "lines" else LoadTable
    if table != "cylinder":
        return StrictTable
    if kind.asks(table, "area_ratio"):
        return CylinderDatasheet
    return OneSidedCylinder if kind.needs.get(table) else CylinderAside


MEANINGS = {
    "supply": "Supply pressure, pump, accumulator and pressure line.",
    "tank": "Return line and its pressure.",
    "valve": "Servo valve: rating or gain, spool, metering edges and driver.",
    "driver": "Driver of the valve, on board or apart: ramp, dead band, spool feedback, dither.",
    "lines": "Lines, load-holding and relief valves between valve and cylinder.",
    "cylinder": "Cylinder: areas or diameters, stroke, volumes, leakage, cushions and end stops.",
    "oil": "Oil: stiffness, density, viscosity, temperature and gas.",
    "friction": "Friction of the seals.",
    "load": "Load, its coupling to the rod and what acts on it.",
    "initial": "State at the start.",
    "sensors": "Transducers, one table per channel: [sensors.pressure_a].",
}
"""Meaning of the tables that are made of parameters and effects."""


def _plant_table(table: str, effects: Iterable[Effect], kind: Kind) -> Any:
    """Return the model of one of the plant's tables: parameters, then effects."""
    exclusive = {n for pair in datasheet.ALTERNATIVES.get(table, ()) for side in pair for n in side}
    fields: dict[str, Any] = {}
    for param in PARAMS.get(table, ()):
        unsaid = param.default is None and not kind.asks(table, param.name)
        optional = param.name in exclusive or unsaid
        reader = _reader(param, table)
        annotation = Annotated[float | None, reader] if optional else Annotated[float, reader]
        default = None if optional else ... if param.default is None else param.default
        fields[param.name] = (annotation, default)
    for effect in effects:
        if effect.stage.table == table:
            fields[effect.name] = _optional(effect)
    return create_model(table, __base__=_base(table, kind), __doc__=MEANINGS.get(table), **fields)


def _sensors_table(effects: Iterable[Effect]) -> Any:
    chain = [e for e in effects if e.stage in SAMPLED]
    channels: dict[str, Any] = {}
    for channel in CHANNELS:
        fields = {e.name: _optional(_in_channel_unit(e, channel)) for e in chain}
        model = create_model(channel.name, __base__=ChannelTable, **fields)
        channels[channel.name] = (model, model())
    meaning = MEANINGS["sensors"]
    return create_model("sensors", __base__=StrictTable, __doc__=meaning, **channels)


def plant_tables(effects: Iterable[Effect]) -> list[str]:
    """Return the names of the plant's tables, in the order of the declarations."""
    stages = [e.stage.table for e in effects if e.stage not in SAMPLED]
    return list(dict.fromkeys([*PARAMS, *stages]))


@lru_cache(maxsize=8)
def schema(effects: tuple[Effect, ...], kind: Kind, *, on_bus: bool = False) -> type[StrictTable]:
    """Return the model of a whole configuration; the last eight are kept.

    Args:
        effects: the catalogue.
        kind: of bench.
        on_bus: whether nodes are required.

    """
    fields: dict[str, Any] = {
        "bench": (BenchTable, BenchTable()),
        "rig": (RigTable, RigTable()),
        "model": (ModelTable, ModelTable()),
        "plant": (PlantTable, PlantTable()),
        "bus": (BusTable, BusTable()),
        "node": (list[NodeTable], ... if on_bus else []),
        "partner": (list[PartnerTable], []),
    }
    for table in plant_tables(effects):
        model = _plant_table(table, effects, kind)
        fields[table] = (model, ... if kind.needs.get(table) else model())
    sensors = _sensors_table(effects)
    fields["sensors"] = (sensors, sensors())
    return create_model("configuration", __base__=StrictTable, **fields)

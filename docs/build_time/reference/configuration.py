"""`configuration.md`: tables and keys of a configuration and of a machine."""

from typing import Any

from pydantic import BaseModel

from build_time.reference import keys
from build_time.reference.markdown import code, page, sentence, shown, table, text
from hil_emulator.config import object_map
from hil_emulator.config.bench import KINDS
from hil_emulator.config.bus import DEFAULT_BUS
from hil_emulator.config.machine import ActuatorTable, MachineTable, SupplyTable
from hil_emulator.config.nodes import IdentityTable, NodeTable
from hil_emulator.config.partners import J1939Table, MessageTable, PartnerTable
from hil_emulator.config.schema import plant_tables, schema
from hil_emulator.config.table import TableOfWays
from hil_emulator.model.declare import Effect, Quantity
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.quantities import INPUTS, SIGNALS
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import SAMPLED

_HEAD = """\
Every table and key of a configuration file (TOML). Quantities are text with a unit, such as
`"160 bar"`; any unit of the same dimension is accepted. Later files are laid over earlier ones. A
key without a default may be left out. [Describe your machine](../how_to/machine.md) shows how to
write a file; `hil-emulator schema` writes the JSON Schema of it."""

_EFFECTS = """\
Effects of this table, each off unless it is set: `NAME = "VALUE"` sets the strength alone, a table
`NAME = { KEY = "VALUE" }` the strength with other [parameters](effects.md)."""

_SENSORS = """\
Each table is written `[sensors.CHANNEL]`. A span is the width of the channel's usual measuring
range; in a configuration such values are written in the channel's own unit."""


def write() -> str:
    """Return the page."""
    complete = schema(CATALOGUE, KINDS["actuator"])
    models = {
        n: f.annotation for n, f in complete.model_fields.items() if n not in ("node", "partner")
    }
    plant = plant_tables(CATALOGUE)
    return page(
        "Configuration",
        _HEAD,
        *_section("[bench]", models["bench"], _benches()),
        *_section("[rig]", models["rig"]),
        *_section("[model]", models["model"]),
        *_section("[bus]", models["bus"], _default_bus()),
        *_section("[[node]]", NodeTable),
        *_section("[node.identity]", IdentityTable),
        *_objects(),
        *_section("[[partner]]", PartnerTable),
        *_section("[partner.messages.NAME]", MessageTable),
        *_section("[partner.j1939]", J1939Table),
        *_section("[plant]", models["plant"]),
        *_quantities("[plant.inputs]", "Inputs of the plant, each a key.", INPUTS),
        *_quantities("[plant.outputs]", "Signals of the plant, each a key.", SIGNALS),
        *(part for name in plant for part in _section(f"[{name}]", models[name], *_acting(name))),
        *_sensors(models["sensors"]),
        *_section("A machine of several actuators", MachineTable),
        *_section("[supplies.NAME]", SupplyTable),
        *_section("[[actuator]]", ActuatorTable),
    )


def _section(title: str, model: Any, *further: str) -> list[str]:
    """Return heading, meaning and keys of a table, without its effects."""
    effects = [n for n, f in model.model_fields.items() if _is_effect(f.annotation)]
    listed = keys.keys(model, leave_out=effects) if len(effects) < len(model.model_fields) else ""
    ways = _ways(model) if issubclass(model, TableOfWays) else ""
    return [f"## {title}", sentence((model.__doc__ or "").partition("\n")[0]), listed, ways,
            *further]  # fmt: skip


def _ways(model: type[TableOfWays]) -> str:
    """Return the sentence on alternative keys, of which one set is to be given."""
    optional = tuple(0 for _ in model.groups) in model.ways
    return f"{'If any, give' if optional else 'Give'} {text(model.wanted)}."


def _is_effect(annotation: Any) -> bool:
    """Return whether a field is the table of an effect."""
    names = {effect.name for effect in CATALOGUE}
    inner = getattr(annotation, "__args__", (annotation,))
    return any(isinstance(i, type) and issubclass(i, BaseModel) and i.__name__ in names
               for i in inner)  # fmt: skip


def _acting(name: str) -> list[str]:
    """Return the effects of a table."""
    here = [e for e in CATALOGUE if e.stage.table == name and e.stage not in SAMPLED]
    return [_EFFECTS, _listed(here)] if here else []


def _listed(effects: list[Effect]) -> str:
    rows = [
        (f"[`{e.name}`](effects.md#{e.name})", code(e.knob.name), text(e.knob.display_unit),
         shown(e.off, e.knob), f"{shown(e.knob.low, e.knob)} ... {shown(e.knob.high, e.knob)}",
         text(e.words))
        for e in effects
    ]  # fmt: skip
    return table(("effect", "strength", "unit", "off", "bounds", "meaning"), rows)


def _benches() -> str:
    rows = [
        (code(f'"{kind.name}"'), text(kind.describes.partition(": ")[2] or kind.describes),
         ", ".join(code(f"{t}.{n}") for t, names in kind.needs.items() for n in sorted(names)),
         ", ".join(map(code, kind.options)))
        for kind in KINDS.values()
    ]  # fmt: skip
    header = ("kind", "describes", "required keys", "keys of [bench]")
    return f"What each kind of bench requires:\n\n{table(header, rows)}"


def _default_bus() -> str:
    listed = ", ".join(code(f"{n} = {v!r}".replace("'", '"')) for n, v in DEFAULT_BUS.items())
    return f"All other keys are passed to python-can's `can.Bus`. Without any: {listed}."


def _objects() -> list[str]:
    rows = [(code(name), text(meaning)) for name, meaning in object_map.MEANINGS.items()]
    taken = [(code(kind), ", ".join(map(code, others))) for kind, others in object_map.KEYS.items()]
    return [
        "## [node.map]",
        'Each key is an object, such as `"0x6130:1"`. Its value is the name of a channel or of an '
        "input, a number of digits, or a table of these keys:",
        table(("key", "meaning"), rows),
        "A table has exactly one of these keys, and may have those that follow it:",
        table(("key", "further keys"), taken),
    ]


def _quantities(title: str, meaning: str, quantities: tuple[Quantity, ...]) -> list[str]:
    rows = [(code(q.name), text(q.unit), text(q.meaning)) for q in quantities]
    return [f"## {title}", meaning, table(("key", "unit", "meaning"), rows)]


def _sensors(model: type[BaseModel]) -> list[str]:
    measured = {signal.name: signal.meaning for signal in SIGNALS}
    rows = [
        (code(c.name), text(c.shown), shown(c.span, c), text(measured[c.signal])) for c in CHANNELS
    ]
    chain = [e for e in CATALOGUE if e.stage in SAMPLED]
    channels = table(("channel", "unit", "span", "measures"), rows)
    meaning = sentence(model.__doc__ or "")
    return ["## [sensors]", meaning, _SENSORS, channels, _EFFECTS, _listed(chain)]

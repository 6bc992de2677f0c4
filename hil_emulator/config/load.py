"""From files to a `Configuration`, or to one message with every mistake in it."""

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil_emulator.config import datasheet
from hil_emulator.config.bench import BenchSettings, described, kind_of
from hil_emulator.config.bus import WireSettings, split
from hil_emulator.config.derived import derived
from hil_emulator.config.effect_files import read_effects
from hil_emulator.config.mistakes import describe
from hil_emulator.config.nodes import UNCONFIGURED, NodeSettings, NodeTable, node_settings
from hil_emulator.config.plant import FmuSettings, fmu_settings
from hil_emulator.config.schema import plant_tables, schema
from hil_emulator.config.table import StrictTable
from hil_emulator.config.toml_file import parse_toml, read_text
from hil_emulator.errors import UserError, brief
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.stages import SAMPLED

DEFAULT_BUS = {
    "interface": "socketcand_server",
    "channel": "can0",
    "host": "127.0.0.1",
    "port": 29536,
}
"""A TCP server any process can connect to without root; 29536 is socketcand's port."""


@dataclass(frozen=True)
class Configuration:
    """A whole rig, checked.

    Attributes:
        tick_ns: period of the loop [ns].
        step: integration step [s].
        steps: integration steps per tick.
        seed: seed of the sensor noise.
        late: what a late tick means: "count" it or "stop" the run.
        not_finite: what a state of the model that is not finite means: "stop" the run, or "reset"
            the model.
        sync_period_ns: time that one SYNC stands for under the follow-SYNC clock [ns].
        bus: arguments of `can.Bus`.
        wire: its bit rate, and whether frames take time.
        nodes: the CANopen nodes; none for a bench that only measures.
        effects: the catalogue, with the user's own effects at its end.
        plant: parameters of the plant by record field, SI.
        sensors: transducer parameters by channel and record field, SI.
        digest: digest of what the files say together.
        files: where it comes from.
        texts: what each of them says.
        fmu: what moves in place of the built-in plant, where something does.
        unsaid: fields of `plant` that no file states: they follow from the others.
        bench: what of an actuator it describes; what it need not say of the plant is not a number,
            so that nothing which depends on it has a value.
        supply_mates: names of the other actuators of a machine on its supply.

    """

    tick_ns: int
    step: float
    steps: int
    seed: int
    late: str
    not_finite: str
    sync_period_ns: int
    bus: dict[str, Any]
    wire: WireSettings
    nodes: tuple[NodeSettings, ...]
    effects: tuple[Effect, ...]
    plant: dict[str, float]
    sensors: dict[str, dict[str, float]]
    digest: str
    files: tuple[Path, ...]
    texts: tuple[str, ...]
    bench: BenchSettings
    supply_mates: tuple[str, ...] = ()
    unsaid: frozenset[str] = frozenset()
    fmu: FmuSettings | None = None


Admit = Callable[[Path, bytes], None]
"""Asked before an effect file runs, with its path and content; raises `UserError` to refuse it."""


def load(files: Sequence[Path], *, on_bus: bool = False) -> Configuration:
    """Read and check configuration files, later ones laid over earlier ones.

    The effect files that they name are run.

    Args:
        files: the files.
        on_bus: whether it is a mistake to say nothing of nodes.

    Raises:
        UserError: with every mistake found, each with its place.

    """
    texts = [read_text(file, "configuration") for file in files]
    return load_texts(files, texts, lambda path, content: None, on_bus=on_bus)


def load_texts(
    files: Sequence[Path], texts: Sequence[str], admit: Admit, *, on_bus: bool = False
) -> Configuration:
    """Check the texts of configuration files as if they were there.

    Args:
        files: where the texts come from: what they name is looked for beside them.
        texts: of each file.
        admit: decides which effect files may run.
        on_bus: whether it is a mistake to say nothing of nodes.

    Raises:
        UserError: with every mistake found, each with its place.

    """
    layers = [(f, parse_toml(f, text)) for f, text in zip(files, texts, strict=True)]
    own = [e for file, layer in layers for e in _own_effects(file, layer, admit)]
    effects = (*CATALOGUE, *own)
    merged: dict[str, Any] = {}
    origin: dict[tuple[str, ...], Path] = {}
    for file, layer in layers:
        _lay_over(merged, _with_knobs(layer, effects), file, origin)
    _refuse_machine(merged, origin)
    kind = kind_of(merged)
    model = schema(effects, kind, on_bus=on_bus and kind.whole)
    try:
        checked = model.model_validate(merged)
    except ValidationError as error:
        raise UserError(describe(error, model, merged, origin, files)) from None
    return _configuration(checked, merged, effects, origin, files, texts)


def _refuse_machine(merged: Mapping[str, Any], origin: Mapping[tuple[str, ...], Path]) -> None:
    """Say which files describe one actuator where a machine of several was given."""
    if "actuator" not in merged:
        return
    given = merged["actuator"]
    first = given[0] if isinstance(given, list) and given else {}
    files = first.get("files") if isinstance(first, dict) else None
    named = " ".join(map(str, files)) if isinstance(files, list) else "knee.toml"
    raise UserError(
        f"{origin[('actuator',)]}: describes a machine of several actuators, this command takes "
        f"one: name its files, such as {brief(named)}; followed by those of a supply that it "
        "shares, they describe it alone on that"
    )


def load_whole(files: Sequence[Path]) -> Configuration:
    """Read and check a configuration of a whole actuator, which can be simulated.

    Raises:
        UserError: as `load` does, or if it describes less, or an FMU moves in its place.

    """
    config = whole(load(files))
    if config.fmu:
        raise UserError(
            f"{config.fmu.file.name} moves in place of the built-in plant, which this command "
            "needs: leave the file with [plant] fmu out"
        )
    return config


def whole(config: Configuration) -> Configuration:
    """Return a configuration that describes a whole actuator.

    Raises:
        UserError: if it describes less.

    """
    if not config.bench.whole:
        raise UserError(
            f"{config.files[-1]}: describes {config.bench}; this command simulates the whole "
            'actuator: write kind = "actuator" under [bench], or leave it out, and give the rest'
        )
    return config


def load_rig(files: Sequence[Path]) -> Configuration:
    """Read and check a configuration whose devices go on a bus.

    Raises:
        UserError: as `load_whole` does, or if there is no device.

    """
    return on_bus(load(files, on_bus=True))


def on_bus(config: Configuration) -> Configuration:
    """Return a configuration of a whole actuator that has devices on a bus.

    Raises:
        UserError: if it has none, or describes less.

    """
    whole(config)
    if not config.nodes:
        raise UserError(
            f"{config.files[-1]}: no [[node]]: nothing of it is on a bus; add "
            '[[node]] with id = 5 and eds = "hydraulic_actuator.eds"'
        )
    return config


def _own_effects(file: Path, layer: dict[str, Any], admit: Admit) -> list[Effect]:
    """Import the effect files that a layer names; each defines a tuple EFFECTS."""
    table = layer.get("model")
    named = table.get("effects", []) if isinstance(table, dict) else []
    found: list[Effect] = []
    for name in named if isinstance(named, list) else []:
        path = file.parent / str(name)
        try:
            content = path.read_bytes()
            admit(path, content)
            found += read_effects(path, content)
        except UserError:
            raise
        except (Exception, SystemExit) as error:  # it is anybody's Python
            raise UserError(
                f"{file}: model.effects: {path}: {type(error).__name__}: {error}; an effect file "
                "is Python that declares effects and lists them in EFFECTS"
            ) from None
    return found


def _with_knobs(layer: dict[str, Any], effects: Sequence[Effect]) -> dict[str, Any]:
    """Write `effect = "value"` out as `effect = {knob = "value"}`."""
    knobs = {(e.stage.table, e.name): e.knob.name for e in effects}

    def spelt(table: str, content: object) -> object:
        if not isinstance(content, dict):
            return content
        if table == "sensors":
            return {name: spelt("sensors.", channel) for name, channel in content.items()}
        place = table.rstrip(".")
        return {
            key: {knobs[place, key]: value}
            if (place, key) in knobs and not isinstance(value, dict)
            else value
            for key, value in content.items()
        }

    return {table: spelt(table, content) for table, content in layer.items()}


def _lay_over(
    below: dict[str, Any], above: dict[str, Any], file: Path, origin: dict[tuple[str, ...], Path],
    path: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Merge `above` into `below`; a new way to say a thing displaces the old one."""
    for pair in datasheet.ALTERNATIVES.get(path[0], ()) if len(path) == 1 else ():
        for new, old in (pair, pair[::-1]):
            if new & above.keys() and not old & above.keys():
                for key in old & below.keys():
                    del below[key]
    for key, value in above.items():
        here = (*path, key)
        origin[here] = file
        if isinstance(value, dict) and isinstance(below.get(key), dict):
            _lay_over(below[key], value, file, origin, here)
        elif isinstance(value, dict):
            below[key] = {}
            _lay_over(below[key], value, file, origin, here)
        else:
            below[key] = value


def _effect_values(table: StrictTable, effects: Sequence[Effect]) -> dict[str, float]:
    """Return the parameters of the effects that a table sets, by record field."""
    return {
        effect.field_of(param): getattr(chosen, param.name)
        for effect in effects
        if (chosen := getattr(table, effect.name, None)) is not None
        for param in effect.params
    }


def _plant_values(checked: Any, effects: Sequence[Effect]) -> dict[str, float]:
    values: dict[str, float] = {}
    for name in plant_tables(effects):
        table = getattr(checked, name)
        for param in PARAMS.get(name, ()):
            value = getattr(table, param.name)
            values[f"{name}_{param.name}"] = math.nan if value is None else value
        values |= _effect_values(table, [e for e in effects if e.stage.table == name])
    values |= checked.valve.gains()
    values |= checked.cylinder.areas()
    return values


def _unsaid(checked: Any, said: dict[str, float]) -> dict[str, float]:
    """Return what follows from the values that the configuration of a whole actuator says."""
    if not described(checked.bench).whole:
        return {}
    found = derived(checked.valve.rated_current, said, checked.rig.step)
    return {name: value for name, value in found.items() if name not in said}


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


def _configuration(
    checked: Any,
    merged: dict[str, Any],
    effects: tuple[Effect, ...],
    origin: dict[tuple[str, ...], Path],
    files: Sequence[Path],
    texts: Sequence[str],
) -> Configuration:
    rig = checked.rig
    steps = round(rig.tick / rig.step)
    chain = [e for e in effects if e.stage in SAMPLED]
    channels = type(checked.sensors).model_fields
    bus, wire = split(checked.bus)
    nodes = _nodes(checked.node, wire, origin.get(("node",), files[-1]))
    fmu = fmu_settings(checked.plant, origin.get(("plant",), files[-1]))
    if fmu and rig.not_finite == "reset":
        raise UserError(
            f'{files[-1]}: [rig] not_finite = "reset" needs the built-in plant: an FMU that has '
            "failed stays so"
        )
    canonical = json.dumps(merged, sort_keys=True, default=str).encode()
    said = _plant_values(checked, effects)
    unsaid = _unsaid(checked, said)
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
        plant=said | unsaid,
        unsaid=frozenset(unsaid),
        sensors={name: _effect_values(getattr(checked.sensors, name), chain) for name in channels},
        digest=hashlib.sha256(canonical).hexdigest()[:16],
        files=tuple(files),
        texts=tuple(texts),
        bench=described(checked.bench),
        fmu=fmu,
    )

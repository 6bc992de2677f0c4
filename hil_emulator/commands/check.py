"""`hil-emulator check`: the consequences of a configuration, without a run."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.bus import WireSettings
from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import MachineSettings, load_machine
from hil_emulator.config.object_map import COMMAND_UNITS
from hil_emulator.device.collisions import collisions
from hil_emulator.device.dictionary import UNCONFIGURED
from hil_emulator.device.eds.report import lines
from hil_emulator.device.layout import Binding
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.model.quantities import PARAMS
from hil_emulator.model.sampling import longest_delay
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stability import Bound, required_step, step_bound
from hil_emulator.partners.partner import Partner
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.simulation.active_effects import acting_together
from hil_emulator.simulation.assembly import compiled
from hil_emulator.simulation.machine import by_supply
from hil_emulator.simulation.node_factory import nodes
from hil_emulator.units import show


def check(files: Sequence[Path]) -> None:
    """Validate a configuration; print its bindings, PDO maps and bus loads.

    Raises:
        UserError: for every error of the configuration.

    """
    settings = load_machine(files)
    on_bus: dict[str, list[Node]] = {name: [] for name in settings.buses}
    for actuator in settings.actuators:
        made = nodes(actuator.config, [c.name for c in CHANNELS])
        on_bus[actuator.bus] += made
        _show(actuator.name, actuator.config, made)
        for warning in _of_nodes(made, settings.wires[actuator.bus], actuator.config):
            click.echo(f"warning: {actuator.name}: {warning}")
    for name, there in on_bus.items():
        refuse_collisions(name, there)
        click.echo(_load(name, settings, there))
    for actuator in settings.actuators:
        for warning in warnings(actuator.config):
            click.echo(f"warning: {actuator.name}: {warning}")
    configs = {actuator.name: actuator.config for actuator in settings.actuators}
    for names in by_supply(settings):  # last, because it compiles the model
        for warning in step_warnings({name: configs[name] for name in names}):
            click.echo(f"warning: {warning}")


def refuse_collisions(bus: str, there: Sequence[Node]) -> None:
    """Refuse nodes whose identifiers collide on one bus.

    Raises:
        UserError: names every collision of node-IDs and COB-IDs.

    """
    messages = collisions(there)
    if messages:
        raise UserError("\n".join(f"bus {bus}: {message}" for message in messages))


def _of_nodes(made: Sequence[Node], wire: WireSettings, config: Configuration) -> Iterator[str]:
    """Yield what nodes cannot do for their actuator or on their bus."""
    by_partner = any(s.source in COMMAND_UNITS for p in config.partners for s in p.table.signals)
    if not by_partner and not any(
        b.bound_to.startswith("command ") for node in made for b in node.bindings()
    ):
        yield "no node commands valve_current, so the valve keeps its safe current"
    rate = wire.bit_rate
    for node in made:
        rates = node.dictionary.bit_rates
        if rate and rates and rate not in rates:
            yield f"{near(Path(node.dictionary.source))} does not support {rate / 1e3:g} kbit/s"


def step_warnings(sharing: Mapping[str, Configuration]) -> Iterator[str]:
    """Yield a warning if the step is too long; actuators on one supply count as one system."""
    lean = acting_together(list(sharing.values()))
    with waiting(PREPARING):
        model = compiled(lean[0].effects, cache_folder(), len(lean))
    values = [config.plant for config in lean]
    if lean[0].step <= required_step(model, *values):
        return
    bound = step_bound(model, *values)
    name, config = list(sharing.items())[bound.place]
    shared = ", on its shared supply" if len(lean) > 1 else ""
    yield (
        f"{name}: the integration step of {config.step * 1e6:.3g} us is too wide for this actuator"
        f"{shared}{_reason(bound, config, values[bound.place])}; set [rig] step to "
        f"{widest_step(config.tick_ns, bound.step) * 1e6:.4g} us or less"
    )


def warnings(config: Configuration) -> Iterator[str]:
    """Yield what limits a run, except the step."""
    longest = longest_delay(config.tick_ns * 1e-9)
    settings: Mapping[str, Mapping[str, float]] = {"plant": config.plant, **config.sensors}
    for effect in config.effects:
        knob = effect.field_of(effect.knob)
        if any(state.length > 1 for state in effect.states):
            for place, values in settings.items():
                if values.get(knob, 0.0) > longest:
                    yield (
                        f"{place}: {effect.name} looks back {values[knob] * 1e3:g} ms, but at this "
                        f"tick no further than {longest * 1e3:g} ms"
                    )


def widest_step(tick_ns: int, largest: float) -> float:
    """Return the longest step [s] within `largest` that divides the tick and is a short number."""
    fewest = math.ceil(tick_ns * 1e-9 / largest)
    for count in range(fewest, 4 * fewest):
        step_ns = tick_ns / count
        if step_ns == float(f"{step_ns:.3g}"):
            return step_ns * 1e-9
    return tick_ns * 1e-9 / fewest


def _reason(bound: Bound, config: Configuration, values: Mapping[str, float]) -> str:
    """Return which state moves that fast, and which parameter causes it."""
    reason = f": {bound.state.replace('_', ' ')} is too fast for it"
    named = {f"{t}_{p.name}": (t, p.name, p) for t, ps in PARAMS.items() for p in ps}
    named |= {
        e.field_of(p): (e.stage.table, f"{e.name}.{p.name}", p)
        for e in config.effects for p in e.params
    }  # fmt: skip
    if bound.parameter not in values:  # a usual actuator is not faster
        return reason
    table, name, param = named[bound.parameter]
    value = show(values[bound.parameter], param.unit, param.shown)
    return f"{reason}, by [{table}] {name} = {value} above all"


def _show(name: str, config: Configuration, made: Sequence[Node]) -> None:
    files = ", ".join(near(f) for f in config.files)
    click.echo(f"{name}: {files}: valid (digest {config.digest})\n")
    for node, settings in zip(made, config.nodes, strict=True):
        number = "without a node-ID" if node.node_id == UNCONFIGURED else node.node_id
        click.echo(f"Node {number}, {near(settings.eds)}")
        click.echo(_bindings(node) + "\n")
        click.echo(_pdo_map(node) + "\n")
        for line in lines(node.dictionary.remarks):
            click.echo(f"note: {line}")
        for pdo, group in itertools.groupby(node.unfed(), key=lambda row: row[0]):
            names = ", ".join(f"{entry.where} {entry.name}" for _, entry in group)
            click.echo(
                f"note: {pdo} maps objects without a source, which hold their defaults: {names}"
            )

    if config.partners:
        # imported late: cantools takes half a second, and `run` imports this module
        from hil_emulator.simulation.partner_factory import partners

        for partner in partners(config, [channel.name for channel in CHANNELS]):
            click.echo(f"Partner {partner.name}\n{_messages(partner)}\n")


def _messages(partner: Partner) -> str:
    rows = [
        (f"{m.message.frame_id:X}", m.message.name, "sends", m.message.length, m.how)
        for m in partner.sent
    ]
    rows += [
        (f"{m.message.frame_id:X}", m.message.name, "obeys", m.message.length, m.how)
        for m in partner.obeyed
    ]
    return text_table(("identifier", "message", "", "bytes", "how"), rows)


def _bindings(node: Node) -> str:
    rows = [
        (f"{b.index:04X}:{b.subindex:02X}", b.name, b.type, _one_count(b), b.bound_to)
        for b in node.bindings()
    ]
    return text_table(("object", "name", "type", "one count", "bound to"), rows)


def _one_count(binding: Binding) -> str:
    """Return what one count stands for, and what count 0 does where that is not 0."""
    zero = f", 0 is {binding.offset:g} {binding.unit}" if binding.offset else ""
    return f"{binding.factor:g} {binding.unit}{zero}"


def _pdo_map(node: Node) -> str:
    rows = [
        (
            p.name,
            f"{p.can_id:03X}" if p.exists else "-",
            p.transmission_type,
            f"{p.event_timer_ms} ms" if p.event_timer_ms else "-",
            p.size,
            ", ".join(p.entries),
        )
        for p in node.pdo_map()
    ]
    return text_table(("PDO", "COB-ID", "type", "timer", "bytes", "objects"), rows)


def _load(name: str, settings: MachineSettings, there: Sequence[Node]) -> str:
    config = settings.actuators[0].config
    bits = sum(
        node.bus_load(config.sync_period_ns // 1000, config.tick_ns // 1000) for node in there
    )
    rate = settings.wires[name].assumed_bit_rate
    text = (
        f"Bus load of {name} at most {bits / rate:.0%} of {rate / 1000:g} kbit/s "
        f"(SYNC each {config.sync_period_ns / 1e6:g} ms, set points at the same rate)"
    )
    if bits > rate:
        text += "\nwarning: more than it can carry; lengthen the event timers or raise the bit rate"
    return text

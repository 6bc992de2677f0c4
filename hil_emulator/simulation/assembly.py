"""Assembly of a rig from a configuration: compiled model, plant, sensors, and nodes on a bus."""

import functools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.fmi.importing.supply import FmuSupply
from hil_emulator.model import kernel
from hil_emulator.model.declare import Effect
from hil_emulator.model.plant import Plant, on_one_supply
from hil_emulator.model.sampling import Sensors
from hil_emulator.recording.memory import Recorder
from hil_emulator.simulation.active_effects import acting_together
from hil_emulator.simulation.frame_router import Participant
from hil_emulator.simulation.node_factory import nodes
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort, TimedCanPort


@functools.cache
def compiled(effects: tuple[Effect, ...], cache: Path | None, actuators: int = 1) -> kernel.Kernel:
    """Return the compiled model of a catalogue, cached in the process."""
    return kernel.build(effects, cache, actuators=actuators)


def assemble(
    config: Configuration,
    bus: CanPort,
    cache: Path | None = None,
    recorder: Recorder | None = None,
) -> Rig:
    """Create the rig of a configuration; compiles the model and runs it once.

    The model has only the effects that can act, see `acting`.

    Args:
        config: the rig's description.
        bus: carries its frames.
        cache: folder of compiled models.
        recorder: records every tick; None for no recording.

    Raises:
        UserError: if a node cannot be created from its EDS.

    """
    (rig,) = assemble_together([config], [bus], cache)
    rig.recorder = recorder
    return rig


def assemble_together(
    configs: Sequence[Configuration], buses: Sequence[CanPort], cache: Path | None = None
) -> list[Rig]:
    """Create the rigs of one supply, see `assemble`; they may share a bus."""
    configs = acting_together(configs)
    model = compiled(configs[0].effects, cache, len(configs))
    plants = plants_of(model, configs)
    rigs = [_rig(*parts) for parts in zip(configs, plants, buses, strict=True)]
    for rig in rigs:
        rig.supply_mates = [mate for mate in rigs if mate is not rig]
    return rigs


def plants_of(model: kernel.Kernel, configs: Sequence[Configuration]) -> list[Plant]:
    """Return the plants of one supply: the built-in one, or a single FMU."""
    first = configs[0]
    if not any(config.fmu for config in configs):
        return on_one_supply(model, [config.plant for config in configs], first.step)
    if len(configs) > 1 or first.fmu is None:
        raise UserError("an FMU cannot share a supply with other actuators")
    supply = FmuSupply(model, first.step, first.steps, first.fmu)
    return [Plant(model, first.plant, first.step, supply)]


def _rig(config: Configuration, plant: Plant, bus: CanPort) -> Rig:
    random = np.random.default_rng(config.seed)
    sensors = Sensors(plant.kernel, config.sensors, config.tick_ns * 1e-9, random)
    made: list[Participant] = [*nodes(config, sensors.names)]
    if config.wire.modelled and not isinstance(bus, TimedCanPort):
        bus = TimedCanPort(bus, config.wire)
    if config.partners:
        # imported late: cantools takes half a second
        from hil_emulator.simulation.partner_factory import partners

        made += partners(config, sensors.names)
    return Rig(plant, sensors, made, bus, config.tick_ns, config.steps, None, config.not_finite)

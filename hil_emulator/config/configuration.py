"""A whole rig, checked: what everything else is made from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil_emulator.config.bench import BenchSettings
from hil_emulator.config.bus import WireSettings
from hil_emulator.config.nodes import NodeSettings
from hil_emulator.config.partners import PartnerSettings
from hil_emulator.config.plant import FmuSettings
from hil_emulator.model.declare import Effect


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
        stated: fields of `plant` that a file states.
        tolerances: relative standard deviation of stated values by field, where a file states it.
        bench: what of an actuator it describes; what it need not say of the plant is not a number,
            so that nothing which depends on it has a value.
        partners: nodes on the bus that are not CANopen.
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
    stated: frozenset[str] = frozenset()
    tolerances: Mapping[str, float] = field(default_factory=dict)
    fmu: FmuSettings | None = None
    partners: tuple[PartnerSettings, ...] = ()

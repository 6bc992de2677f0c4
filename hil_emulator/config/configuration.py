"""A whole rig, checked: the input of all assembly."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil_emulator.config.bench import BenchSettings
from hil_emulator.config.bus import WireSettings
from hil_emulator.config.datasheet import SheetQuantity
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
        late: reaction to a late tick: "count" it or "stop" the run.
        rotary: whether 1 m of the model stands for 1 rad.
        not_finite: reaction to a state that is not finite: "stop" the run, or "reset" the model.
        sync_period_ns: time that one SYNC stands for under the follow-SYNC clock [ns].
        bus: arguments of `can.Bus`.
        wire: its bit rate, and whether frames take time.
        nodes: the CANopen nodes; empty for a bench that only measures.
        effects: the catalogue, with the user's own effects at its end.
        plant: parameters of the plant by record field, SI.
        sensors: transducer parameters by channel and record field, SI.
        digest: of the content of all files.
        files: its files.
        texts: text of each file.
        fmu: the FMU that replaces the built-in plant, if there is one.
        unsaid: fields of `plant` that no file states; they are derived from others.
        stated: fields of `plant` that a file states.
        rated_current: current at which the valve is fully open [A], where a file states one.
        tolerances: relative standard deviation of stated values by field, where a file states it.
        sheet: quantities of data sheets that state fields of `plant`, by field.
        bench: the described parts of an actuator; values of the plant that it need not state are
            NaN, and so are all that depend on them.
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
    rated_current: float | None = None
    tolerances: Mapping[str, float] = field(default_factory=dict)
    fmu: FmuSettings | None = None
    partners: tuple[PartnerSettings, ...] = ()
    rotary: bool = False
    sheet: Mapping[str, SheetQuantity] = field(default_factory=dict)

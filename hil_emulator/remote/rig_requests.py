"""Handlers of requests on the rig in the loop, with plain values that others format."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Protocol

from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.faults.active import Faults
from hil_emulator.faults.running import Running
from hil_emulator.model.plant import Plant
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.protocol.base import Request
from hil_emulator.protocol.rig import (
    EndRequest,
    FaultRequest,
    SetRequest,
    SignalsRequest,
    StatusRequest,
)
from hil_emulator.signals.columns import columns
from hil_emulator.signals.inputs import COMMANDS, SETTINGS, setting

Plain = dict[str, Any]
"""Numbers, texts, lists and dictionaries, as `marshal` carries them."""


class Controlled(Protocol):
    """The rig as requests see it."""

    now_ns: int
    slipped_ns: int
    faults: Faults
    wire: TimedWire | None
    nodes: tuple[Node, ...]
    plant: Plant

    def fault(self, target: str, kind: str, /, **options: Any) -> Running:
        """Let something break."""
        ...

    def set(self, name: str, value: float) -> str:
        """Set a condition, SI; return what it waits for, "" for nothing."""
        ...

    def value(self, name: str) -> float:
        """Return a signal's present value, SI."""
        ...


class Counters(Protocol):
    """Frames on a bus since the start."""

    received: int
    sent: int
    dropped: int


class Punctuality(Protocol):
    """How punctual a loop is."""

    ticks: int
    overruns: int


Handlers = Mapping[type[Request], Callable[[Any, Any], Plain]]
"""By request: the function of request and rig that does it and returns the answer's fields."""


def rig_requests(
    bus: Counters | None = None,
    timing: Punctuality | None = None,
    supervisor: Supervisor | None = None,
) -> Handlers:
    """Return the handlers of `protocol.offered.OF_RIG`.

    Args:
        bus: whose frames the status counts, or None.
        timing: whose ticks the status counts, or None.
        supervisor: whose failures the status lists; None for those of an FMU only.

    """
    return {
        StatusRequest: partial(_status, bus, timing, supervisor),
        SignalsRequest: _signals,
        FaultRequest: _fault,
        EndRequest: _end,
        SetRequest: _set,
    }


def _status(
    bus: Counters | None,
    timing: Punctuality | None,
    supervisor: Supervisor | None,
    request: StatusRequest,
    rig: Controlled,
) -> Plain:
    failures = supervisor.failures if supervisor else []
    return {
        "now_ns": rig.now_ns,
        "slipped_ns": rig.slipped_ns,
        "bus_load": rig.wire.load if rig.wire else None,
        "faults": _faults(rig.faults.injected),
        "settings": {name: _present(name, rig) for name in SETTINGS},
        "nodes": [(node.node_id, node.state.name) for node in rig.nodes],
        "bus": bus and (bus.received, bus.sent, bus.dropped),
        "timing": timing and (timing.ticks, timing.overruns),
        "failures": [*failures, *filter(None, [rig.plant.supply.failure])],
    }


def _present(name: str, rig: Controlled) -> float | None:
    """Return the present value of a setting, SI; None where it acts on nothing."""
    if name in (rig.plant.kernel.inputs.names or ()):
        return float(rig.value(name))
    try:
        rig.faults.parameters.require(name)
    except UserError:
        return None
    return rig.faults.parameters.sound(name)


def _faults(injected: Iterable[Running]) -> list[tuple[Any, ...]]:
    return [
        (
            r.number,
            r.fault.target,
            r.fault.kind.name,
            r.fault.arguments,
            r.began_ns,
            r.fault.duration_ns,
        )
        for r in injected
    ]


def _signals(request: SignalsRequest, rig: Controlled) -> Plain:
    units = columns()
    names = request.names or list(units)
    unknown = [name for name in names if name not in units]
    if unknown:
        raise UserError(f"no signal '{brief(unknown[0])}'{did_you_mean(unknown[0], units)}")
    return {"signals": {n: {"value": float(rig.value(n)), "unit": units[n]} for n in names}}


def _fault(request: FaultRequest, rig: Controlled) -> Plain:
    return {"number": rig.fault(request.target, request.kind, **request.options).number}


def _end(request: EndRequest, rig: Controlled) -> Plain:
    number = request.number
    chosen = [r for r in rig.faults.injected if number is None or r.number == number]
    if number is not None and not chosen:
        raise UserError(f"no fault number {number} is injected")
    for running in chosen:
        running.end()
    return {"ended": [r.number for r in chosen]}


def _set(request: SetRequest, rig: Controlled) -> Plain:
    values = {name: setting(name, text) for name, text in request.options.items()}
    # what a node may still refuse comes first, so that a request is obeyed as a whole or not at all
    ordered = sorted(values, key=lambda name: name not in COMMANDS)
    waits = [condition for name in ordered if (condition := rig.set(name, values[name]))]
    return {"set": values, "waits": waits}

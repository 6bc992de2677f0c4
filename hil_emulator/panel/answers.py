"""What the panel asks of the loop beside what the remote control does: a look, frames by hand."""

from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.panel.hand import MasterByHand
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.messages import as_json, messages
from hil_emulator.remote.control_server import ANSWERS, Answers
from hil_emulator.signals.inputs import SETTINGS
from hil_emulator.simulation.loop import Timing
from hil_emulator.simulation.rig import Rig


def answers(hand: MasterByHand, bus: Bus, timing: Timing, supervisor: Supervisor) -> Answers:
    """Return what can be asked of a rig: everything that HTTP requests ask for, and these.

    | request | answers |
    |---|---|
    | look | time, faults, nodes, settings, bus, timing, failures of helper processes or an FMU |
    | messages | what PDOs mean now |
    | send | sends frames as a master does |

    """

    def look(request: dict[str, Any], rig: Rig) -> dict[str, Any]:
        status = ANSWERS["status"](request, rig)
        return status | {
            "nodes": [{"id": n.node_id, "state": n.state.name.lower()} for n in rig.nodes],
            "settings": {name: _present(name, rig) for name in SETTINGS},
            "bus": {"received": bus.received, "sent": bus.sent, "dropped": bus.dropped},
            "timing": {"ticks": timing.ticks, "late": timing.overruns},
            "failures": [*supervisor.failures, *filter(None, [rig.plant.supply.failure])],
        }

    def send(request: dict[str, Any], rig: Rig) -> dict[str, Any]:
        hand.say(Frame(can_id, bytes.fromhex(data)) for can_id, data in request["frames"])
        return {}

    return {**ANSWERS, "look": look, "messages": _messages, "send": send}


def _messages(request: dict[str, Any], rig: Rig) -> dict[str, Any]:
    return {"messages": as_json(messages(rig.nodes))}


def _present(name: str, rig: Rig) -> float | None:
    """Return the present value of a setting, SI; None where it acts on nothing."""
    if name in (rig.plant.kernel.inputs.names or ()):
        return rig.value(name)
    try:
        rig.faults.parameters.require(name)
    except UserError:
        return None
    return rig.faults.parameters.sound(name)

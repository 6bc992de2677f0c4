"""Handlers of the panel's requests to the loop: on the rig, frames to send, meaning of PDOs."""

from hil_emulator.frame import Frame
from hil_emulator.panel.hand import MasterByHand
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.protocol.line import MessagesRequest, SendRequest
from hil_emulator.recording.messages import as_json, messages
from hil_emulator.remote.rig_requests import (
    Counters,
    Handlers,
    Plain,
    Punctuality,
    rig_requests,
)
from hil_emulator.simulation.rig import Rig


def loop_requests(
    hand: MasterByHand, bus: Counters, timing: Punctuality, supervisor: Supervisor | None = None
) -> Handlers:
    """Return the handlers of `protocol.offered.TO_LOOP`.

    Args:
        hand: sends frames.
        bus: whose frames the status counts.
        timing: whose ticks it counts.
        supervisor: whose failures it lists.

    """

    def send(request: SendRequest, rig: Rig) -> Plain:
        hand.send_by_hand(Frame(f.can_id, bytes.fromhex(f.data)) for f in request.frames)
        return {}

    return {**rig_requests(bus, timing, supervisor), SendRequest: send, MessagesRequest: _messages}


def _messages(request: MessagesRequest, rig: Rig) -> Plain:
    return {"messages": as_json(messages(rig.nodes))}

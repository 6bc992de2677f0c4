"""The panel as the loop sees it: shared memory that it fills, a process that it starts."""

import importlib.util
import secrets
from dataclasses import dataclass
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.panel import briefing
from hil_emulator.panel.answers import answers
from hil_emulator.panel.hand import MasterByHand
from hil_emulator.panel.ring import RingWriter
from hil_emulator.panel.tap import PanelTap, WatchedTiming, watched_columns
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.header import header
from hil_emulator.remote.control_server import ControlServer
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.wire_door import FrameDoor

PORT = 29538
"""Where the panel is if that port is free: the next one after the remote control's (assumed)."""
_PROGRAM = "hil_emulator.panel.serve"
_ROLE = (
    "panel",
    "its page works no longer, a recording begun there has ended; start the run again with --panel",
)
"""Name of the process, and what is lost with it."""


def require_server() -> None:
    """Make sure that what the panel needs is there.

    Raises:
        UserError: says what to install.

    """
    if importlib.util.find_spec("websockets") is None:
        raise UserError("--panel needs websockets; pip install 'hil-emulator[panel]'")


@dataclass(frozen=True)
class PanelOptions:
    """How a panel is opened.

    Attributes:
        view_only: whether it only shows.
        port: TCP port on 127.0.0.1; any free one where that is taken.

    """

    view_only: bool = False
    port: int = PORT


class Panel:
    """Makes what the loop needs for its panel; `open` starts the process that serves it.

    Args:
        options: how it is opened.
        bus: what the rig is on.

    Attributes:
        hand: the rig's bus, with what is sent by hand.
        tap: the rig's recorder.
        timing: the timing of its loop.

    """

    def __init__(self, options: PanelOptions, bus: FrameDoor) -> None:
        self._ring = RingWriter()
        self._options = options
        self._server: ControlServer | None = None
        self.hand = MasterByHand(bus)
        self.tap = PanelTap(self._ring)
        self.timing = WatchedTiming(self.tap)

    def open(self, rig: Rig, config: Configuration, bus: Bus, supervisor: Supervisor) -> str:
        """Start the process; return the address of the page, with the token that opens it.

        Args:
            rig: what is shown.
            config: what it is.
            bus: what it is on.
            supervisor: watches the process; the page shows its failures.

        """
        token = secrets.token_urlsafe(16)
        self._server = ControlServer(
            self._options.port,
            _PROGRAM,
            answers(self.hand, bus, self.timing, supervisor),
            shared=[self._ring.fd],
            briefing=self._briefing(rig, config, token),
            role=_ROLE,
        )
        supervisor.watch(self._server.process)
        return f"http://127.0.0.1:{self._server.port}/#{token}"

    def serve(self, rig: Rig) -> None:
        """Answer the requests that have come."""
        assert self._server is not None
        self._server.serve(rig)

    def close(self) -> None:
        """End the process, and wait for the recording that it may be writing."""
        if self._server is not None:
            self._server.close()
        self._ring.close()

    def _briefing(self, rig: Rig, config: Configuration, token: str) -> dict[str, Any]:
        return {
            "token": token,
            "view_only": self._options.view_only,
            "header": header(config, rig.nodes, capture="from the panel"),
            "columns": watched_columns(),
            "bit_rate": config.wire.assumed_bit_rate,
            "machine": briefing.machine(config),
            "eds": {str(n.id): str(n.eds) for n in config.nodes},
        }

"""The panel's part in the loop's process: shared memory, and the process that it starts."""

import importlib.util
import secrets
from dataclasses import dataclass
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.panel import session_info
from hil_emulator.panel.hand import MasterByHand
from hil_emulator.panel.loop_publisher import LoopPublisher, PublishedTiming, published_columns
from hil_emulator.panel.loop_requests import loop_requests
from hil_emulator.panel.ring import RingWriter
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.header import header
from hil_emulator.remote.control_server import ControlServer
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort

PORT = 29538
"""Default port of the panel: the next one after the remote control's (assumed)."""
_PROGRAM = "hil_emulator.panel.serve"
_ROLE = (
    "panel",
    "its page and its recording have ended; start the run again with --panel",
)
"""Name of the process, and the loss if it fails."""


def require_server() -> None:
    """Check that the panel's packages are installed.

    Raises:
        UserError: names what to install.

    """
    if importlib.util.find_spec("websockets") is None:
        raise UserError("--panel needs websockets; pip install 'hil-emulator[panel]'")


@dataclass(frozen=True)
class PanelOptions:
    """Options of a panel.

    Attributes:
        view_only: whether it refuses changes.
        port: TCP port on 127.0.0.1; another free one if it is in use.

    """

    view_only: bool = False
    port: int = PORT


class Panel:
    """The loop's objects for its panel; `open` starts the process that serves it.

    Args:
        options: of the panel.
        bus: of the rig.

    Attributes:
        hand: the rig's bus, with frames sent by hand.
        publisher: the rig's recorder.
        timing: the timing of its loop.

    """

    def __init__(self, options: PanelOptions, bus: CanPort) -> None:
        self._ring = RingWriter()
        self._options = options
        self._server: ControlServer | None = None
        self.hand = MasterByHand(bus)
        self.publisher = LoopPublisher(self._ring)
        self.timing = PublishedTiming(self.publisher)

    def open(self, rig: Rig, config: Configuration, bus: Bus, supervisor: Supervisor) -> str:
        """Start the process; return the address of the page with its token.

        Args:
            rig: to show.
            config: of the rig.
            bus: of the rig.
            supervisor: watches the process; the page shows its failures.

        """
        token = secrets.token_urlsafe(16)
        self._server = ControlServer(
            self._options.port,
            _PROGRAM,
            loop_requests(self.hand, bus, self.timing, supervisor),
            shared=[self._ring.fd],
            briefing=self._session_info(rig, config, token),
            role=_ROLE,
        )
        supervisor.watch(self._server.process)
        return f"http://127.0.0.1:{self._server.port}/#{token}"

    def serve(self, rig: Rig) -> None:
        """Answer the pending requests."""
        assert self._server is not None
        self._server.serve(rig)

    def close(self) -> None:
        """End the process, and wait for its recording."""
        if self._server is not None:
            self._server.close()
        self._ring.close()

    def _session_info(self, rig: Rig, config: Configuration, token: str) -> dict[str, Any]:
        return {
            "token": token,
            "view_only": self._options.view_only,
            "header": header(config, rig.nodes, capture="from the panel"),
            "columns": published_columns(),
            "bit_rate": config.wire.assumed_bit_rate,
            "machine": session_info.machine(config),
            "eds": {str(n.id): str(n.eds) for n in config.nodes},
        }

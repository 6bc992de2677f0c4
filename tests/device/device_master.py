"""Access of a test to a device: a stock master, frames and time."""

from pathlib import Path

import canopen
from simulated_network import NS_PER_MS, SimulatedNetwork

from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

EDS = Path(__file__).parents[2] / "eds" / "hydraulic_actuator.eds"
NODE_ID = 5
SDO_REQUEST = 0x600 + NODE_ID
SDO_ANSWER = 0x580 + NODE_ID
EMCY = 0x080 + NODE_ID
HEARTBEAT = 0x700 + NODE_ID
SYNC = 0x080
RPDO1 = 0x200 + NODE_ID
TPDO1, TPDO2, TPDO3, TPDO4 = (base + NODE_ID for base in (0x180, 0x280, 0x380, 0x480))
CHANNELS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
READINGS = (10.0e6, 2.0e6, 16.0e6, 0.1, 500.0)
SAFE_CURRENT = 0.001


class Master:
    """Access of a test to a device: a stock node, frames, time.

    Attributes:
        network: a `canopen.Network`.
        remote: the stock `canopen.RemoteNode` of the device.

    """

    def __init__(self, network: SimulatedNetwork, eds: Path) -> None:
        self.network = network
        self.remote = network.add_node(NODE_ID, str(eds))

    @property
    def frames(self) -> list[Frame]:
        """Return every frame received since `forget`, oldest first."""
        return [frame for _, frame in self.network.log]

    @property
    def commands(self) -> dict[str, float]:
        """Return the commands in force in the device, in SI."""
        return self.network.commands

    def times_ms(self, can_id: int) -> list[float]:
        """Return the times of all frames with this identifier [ms]."""
        return [ns / NS_PER_MS for ns, frame in self.network.log if frame.can_id == can_id]

    def data(self, can_id: int) -> list[bytes]:
        """Return the data of all frames with this identifier."""
        return [frame.data for frame in self.frames if frame.can_id == can_id]

    def forget(self) -> None:
        """Drop the frames received so far."""
        self.network.log.clear()

    def run(self, milliseconds: int) -> None:
        """Advance the time."""
        for _ in range(milliseconds):
            self.network.tick()

    def send(
        self, can_id: int, data: bytes = b"", *, remote: bool = False, extended: bool = False
    ) -> None:
        """Send one frame on the bus."""
        self.network.tick(Frame(can_id, data, remote, extended))

    def measure(
        self, values: tuple[float, ...] = READINGS, overrange: tuple[int, ...] = (0,) * 5
    ) -> None:
        """Set the readings of the sensors."""
        self.network.measured = Measured(list(values), list(overrange))

    def nmt(self, command: int, node_id: int = NODE_ID) -> None:
        """Send an NMT command."""
        self.send(0x000, bytes([command, node_id]))

    def start(self) -> None:
        """Bring the device to OPERATIONAL and drop the frames received until then."""
        self.nmt(1)
        self.forget()

    def request(self, text: str) -> str:
        """Send a raw SDO request in hexadecimal; return the answer, "" without an answer."""
        before = len(self.data(SDO_ANSWER))
        self.send(SDO_REQUEST, bytes.fromhex(text))
        return " ".join(answer.hex() for answer in self.data(SDO_ANSWER)[before:])

    def abort_code(self, index: int, subindex: int, data: bytes | None = None) -> int:
        """Return the abort code of an upload, or of a download of `data`; 0 for success."""
        try:
            if data is None:
                self.remote.sdo.upload(index, subindex)
            else:
                self.remote.sdo.download(index, subindex, data)
        except canopen.SdoAbortedError as abort:
            return int(abort.code)
        return 0


def booted(node: Node, eds: Path = EDS) -> Master:
    """Return a stock master on a bus with a device that has just booted."""
    network = SimulatedNetwork(node, Measured(list(READINGS), [0] * len(CHANNELS)))
    master = Master(network, eds)
    master.run(1)
    return master

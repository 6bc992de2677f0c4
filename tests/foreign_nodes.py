"""Rigs with nodes of makers' EDS files on the reference machine's bus, and a stock master."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from hil_emulator.config.load import load
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.testing.known_objects import known_objects
from hil_emulator.testing.lockstep_network import LockStepNetwork

TRANSMITTER = """
[FileInfo]
FileName=PT-404.EDS
[DeviceInfo]
VendorName=Example Hydraulics
VendorNumber=0x00000ABC
ProductName=PT-404
ProductNumber=0x404
BaudRate_250=1
BaudRate_500=1
NrOfTXPDO=1
[DummyUsage]
Dummy0005=1
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020194
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1008]
ParameterName=Device name
DataType=0x0009
AccessType=const
DefaultValue=PT-404 250bar
[1017]
ParameterName=Producer heartbeat time
DataType=0x0006
AccessType=rw
DefaultValue=0
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=5
[1018sub0]
ParameterName=Entries
DataType=0x0005
AccessType=const
DefaultValue=4
[1018sub1]
ParameterName=Vendor-ID
DataType=0x0007
AccessType=ro
DefaultValue=0xABC
[1018sub2]
ParameterName=Product code
DataType=0x0007
AccessType=ro
DefaultValue=0x404
[1018sub3]
ParameterName=Revision
DataType=0x0007
AccessType=ro
DefaultValue=0x00010000
[1018sub4]
ParameterName=Serial
DataType=0x0007
AccessType=ro
DefaultValue=
[1800]
ParameterName=TPDO1
ObjectType=0x9
SubNumber=4
[1800sub0]
ParameterName=Entries
DataType=0x0005
AccessType=const
DefaultValue=5
[1800sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=0x40000180 + $NodeID
[1800sub2]
ParameterName=Type
DataType=0x0005
AccessType=rw
DefaultValue=254
[1800sub5]
ParameterName=Event timer
DataType=0x0006
AccessType=rw
DefaultValue=10
[1A00]
ParameterName=TPDO1 mapping
ObjectType=0x9
SubNumber=4
[1A00sub0]
ParameterName=Entries
DataType=0x0005
AccessType=rw
DefaultValue=3
[1A00sub1]
ParameterName=First
DataType=0x0007
AccessType=rw
DefaultValue=0x71300110
[1A00sub2]
ParameterName=Second
DataType=0x0007
AccessType=rw
DefaultValue=0x61500108
[1A00sub3]
ParameterName=Third
DataType=0x0007
AccessType=rw
DefaultValue=0x20900010
[2090]
ParameterName=Temperature
DataType=0x0003
AccessType=ro
PDOMapping=0
DefaultValue=0x00FA
[6131]
ParameterName=AI unit
ObjectType=0x8
CompactSubObj=1
DataType=0x0007
AccessType=rw
DefaultValue=0x004E0000
[6132]
ParameterName=AI digits
ObjectType=0x8
CompactSubObj=1
DataType=0x0005
AccessType=rw
DefaultValue=1
[6150]
ParameterName=AI status
ObjectType=0x8
CompactSubObj=1
DataType=0x0005
AccessType=ro
PDOMapping=1
[7130]
ParameterName=AI input PV
ObjectType=0x8
CompactSubObj=1
DataType=0x0003
AccessType=ro
PDOMapping=1
"""
"""A pressure transmitter as makers describe theirs: CiA 404, PV in 0.1 bar, a temperature in 0.1 K
that its own PDOMapping would not let into the TPDO that carries it."""

ACTUATOR = """
[[node]]
id = 5
eds = "{eds}"
"""


class Plant(NamedTuple):
    """A running rig and a stock master on its bus."""

    emulator: Emulator
    network: LockStepNetwork

    def data(self, can_id: int) -> list[bytes]:
        """Return the data of all frames that the rig has sent with an identifier."""
        frames = self.emulator.recorder.frames
        return [f.data for _, sent, f in frames if sent and f.can_id == can_id]

    def times(self, can_id: int) -> list[int]:
        """Return when they were sent [ms]."""
        frames = self.emulator.recorder.frames
        return [t // 1_000_000 for t, sent, f in frames if sent and f.can_id == can_id]

    def master(self, node_id: int) -> Any:
        """Return the stock master's view of the node that has this node-ID now."""
        nodes = zip(self.emulator.config.nodes, self.emulator.rig.nodes, strict=True)
        (node,) = [(s.eds, n.dictionary) for s, n in nodes if n.node_id == node_id]
        return self.network.add_node(node_id, known_objects(*node))


@contextmanager
def plant(folder: Path, text: str) -> Iterator[Plant]:
    """Yield the reference machine with its own node and those of a text; see TRANSMITTER."""
    (folder / "transmitter.eds").write_text(TRANSMITTER)
    layer = folder / "nodes.toml"
    layer.write_text(ACTUATOR.format(eds=shipped("eds/hydraulic_actuator.eds")) + text)
    emulator = Emulator(load([shipped("configs/hyq_knee.toml"), layer]))
    network = LockStepNetwork(emulator)
    try:
        emulator.tick()
        yield Plant(emulator, network)
    finally:
        network.disconnect()
        emulator.close()

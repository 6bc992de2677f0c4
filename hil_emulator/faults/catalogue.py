"""Every kind of fault: the one table that Python, scenario files and command line share.

The defaults are assumed: clearly visible on the reference machine, and survivable.
"""

from hil_emulator.faults.declare import (
    SPAN,
    SPAN_PER_SECOND,
    TEXT,
    FaultParam,
    Kind,
    Layer,
)
from hil_emulator.model.sensors import CHANNELS

_CHANNELS = tuple(c.name for c in CHANNELS)
_WITH_TWIN = tuple(
    c.name for c in CHANNELS if any(o.unit == c.unit and o.name != c.name for o in CHANNELS)
)

BUS = "bus"
NODE = "node"
MESSAGE = "message"
MESSAGES = (
    "nmt", "sync", "emcy", "sdo", "heartbeat",
    *(f"rpdo{n}" for n in range(1, 5)),
    *(f"tpdo{n}" for n in range(1, 5)),
)  # fmt: skip
"""Names of messages of CiA 301; a COB-ID such as 0x185 names one as well."""

_PLANT = (
    Kind("loss", Layer.PLANT, ("supply",), "the pump stops", (
        FaultParam("pressure", "Pa", "what is left", 1e5, 0.0, 400e5, "bar"),)),
    Kind("droop", Layer.PLANT, ("supply",), "the supply sags", (
        FaultParam("drop", "Pa", "by how much", 40e5, 0.0, 400e5, "bar"),)),
    Kind("leak", Layer.PLANT, ("cylinder",), "oil passes the worn piston seal", (
        FaultParam("conductance", "m^3/(s*Pa)", "further leakage", 2e-12, 0.0, 1e-9),)),
    Kind("friction_jump", Layer.PLANT, ("cylinder",), "the seal or the guide seizes", (
        FaultParam("force", "N", "further Coulomb friction", 500.0, 0.0, 1e5),)),
    Kind("air", Layer.PLANT, ("oil",), "the oil foams", (
        FaultParam("fraction", "1", "further air, volume at 1 atm", 0.05, 0.0, 0.2, "%"),)),
    Kind("stuck", Layer.PLANT, ("valve",), "the spool stays where it is"),
    Kind("clogged", Layer.PLANT, ("valve",), "dirt in the valve's passages", (
        FaultParam("share", "1", "part of the flow that is lost", 0.5, 0.0, 1.0, "%"),)),
    Kind("slow", Layer.PLANT, ("valve",), "varnish brakes the spool", (
        FaultParam("rate", "A/s", "its fastest motion", 0.01, 1e-4, 100.0),)),
)  # fmt: skip

_ELECTRICAL = (
    Kind("open", Layer.ELECTRICAL, ("coil",), "a broken wire: no current"),
    Kind("short", Layer.ELECTRICAL, ("coil",),
         "a short circuit: the driver switches off and reports EMCY 0x2320"),
    Kind("current_limited", Layer.ELECTRICAL, ("coil",), "a weak driver", (
        FaultParam("limit", "A", "the largest current it gives", 1e-3, 0.0, 1.0, "mA"),)),
)  # fmt: skip

_SENSOR = (
    Kind("off", Layer.SENSOR, _CHANNELS, "no signal: reads 0, reported as below its range"),
    Kind("stuck", Layer.SENSOR, _CHANNELS, "keeps the reading it has"),
    Kind("offset", Layer.SENSOR, _CHANNELS, "reads too much", (
        FaultParam("value", SPAN, "by how much", 0.1),)),
    Kind("gain", Layer.SENSOR, _CHANNELS, "multiplies its reading", (
        FaultParam("factor", "1", "by what", 1.2, -10.0, 10.0),)),
    Kind("drift", Layer.SENSOR, _CHANNELS, "wanders off", (
        FaultParam("rate", SPAN_PER_SECOND, "how fast", 0.1),)),
    Kind("noise", Layer.SENSOR, _CHANNELS, "reads with further, normal noise", (
        FaultParam("deviation", SPAN, "standard deviation", 0.02, 0.0),)),
    Kind("spike", Layer.SENSOR, _CHANNELS, "single samples read too much", (
        FaultParam("height", SPAN, "by how much", 0.3),), probability=0.02),
    Kind("delay", Layer.SENSOR, _CHANNELS, "shows what it read before; first what it read last", (
        FaultParam("time", "s", "how long before", 0.02, 0.0, 10.0, "ms"),)),
    Kind("dropout", Layer.SENSOR, _CHANNELS, "single samples are lost: the last one stays",
         probability=0.5),
    Kind("over_range", Layer.SENSOR, _CHANNELS, "at the upper end of its range, and reported"),
    Kind("swapped", Layer.SENSOR, _WITH_TWIN, "plugged into another channel's place", (
        FaultParam("channel", TEXT, "the channel it has changed places with", None),)),
)  # fmt: skip

_BUS = (
    Kind("drop", Layer.BUS, (BUS, MESSAGE), "frames vanish"),
    Kind("delay", Layer.BUS, (BUS, MESSAGE), "frames come late", (
        FaultParam("time", "s", "how late", 0.01, 0.0, 10.0, "ms"),)),
    Kind("duplicate", Layer.BUS, (BUS, MESSAGE), "frames come several times", (
        FaultParam("copies", "1", "further ones", 1.0, 1.0, 100.0),)),
    Kind("corrupt", Layer.BUS, (BUS, MESSAGE), "bits of the data are wrong", (
        FaultParam("bits", "1", "how many", 1.0, 1.0, 64.0),)),
    Kind("reorder", Layer.BUS, (BUS, MESSAGE), "a frame comes after its successor"),
    Kind("wrong_length", Layer.BUS, (BUS, MESSAGE), "frames have another length", (
        FaultParam("length", "1", "bytes of data", 1.0, 0.0, 8.0),)),
    Kind("silence", Layer.BUS, (NODE,), "the node hears, but says nothing"),
    Kind("babbling", Layer.BUS, (BUS,), "a node fills the bus", (
        FaultParam("can_id", "1", "COB-ID of its frames", 1.0, 0.0, 2047.0),
        FaultParam("frames", "1", "how many per tick", 5.0, 1.0, 100.0))),
    Kind("emcy", Layer.BUS, (NODE,), "the node reports an error, and at the end that it is gone", (
        FaultParam("code", "1", "emergency error code", 0x1000, 1.0, 65535.0),)),
    Kind("heartbeat_stop", Layer.BUS, (NODE,), "no heartbeat; all else goes on"),
    Kind("reset", Layer.BUS, (NODE,), "the node restarts, once; its supply has failed"),
    Kind("bus_off", Layer.BUS, (NODE,),
         "the node is off the bus; back again it reports EMCY 0x8140"),
    Kind("interface_down", Layer.BUS, (BUS,), "the cable is unplugged"),
)  # fmt: skip

KINDS = (*_PLANT, *_ELECTRICAL, *_SENSOR, *_BUS)

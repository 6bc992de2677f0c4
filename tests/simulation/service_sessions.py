"""For each service of a node a session in which it acts, by its name in `device/services.py`.

The script of a session lists actions in addition to a set point and a SYNC in each tick. In the
session the service must act while the node is on the fast path, or keep it off the fast path.
"""

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rigs import reference
from session import SYNC, Action, nmt, read, typed, write

from hil_emulator.config.load import Configuration
from hil_emulator.config.object_map import read_map
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped

Script = Mapping[int, Iterable[Action]]

LOOK: Action = ("look",)
SILENT: Action = ("replaced",)
ONLY_SYNC: Action = ("replaced", SYNC)
SHORT_RPDO: Action = ("replaced", Frame(0x205, b"\1"), SYNC)
SET_POINT: Action = ("replaced", Frame(0x205, bytes(4)), SYNC)

machine = functools.cache(reference)


@dataclass(frozen=True)
class ServiceSession:
    """A session in which a service acts.

    Attributes:
        script: actions by tick.
        ticks: length of the session.
        configured: returns the machine; its files are written to a folder.

    """

    script: Script
    ticks: int = 150
    configured: Callable[[Path], Configuration] = lambda folder: machine()


def _requests(*frames: Frame) -> Action:
    return ("requests", *frames)


def _frames(*frames: Frame) -> Action:
    return ("frames", *frames)


def _encoder(folder: Path) -> Configuration:
    """Return the machine with a position sensor of CiA 406 as its only node."""
    (node,) = machine().nodes
    sensor = dataclasses.replace(node, eds=shipped("eds/position_sensor.eds"), commands={})
    return dataclasses.replace(machine(), nodes=(sensor,))


def _with_course(folder: Path) -> Configuration:
    """Return the machine with an object that no TPDO carries on a course."""
    (node,) = machine().nodes
    objects = read_map({
        "0x2000": "valve_current", "0x2010": "pressure_a", "0x2011": "pressure_b",
        "0x2012": "supply_pressure", "0x2020": "position", "0x2030": "load_force",
        "0x2040": "sample_counter", "0x2041": {"ramp": [0, 1000], "time": "100 ms"},
    })  # fmt: skip
    return dataclasses.replace(machine(), nodes=(dataclasses.replace(node, objects=objects),))


def _with_program(folder: Path) -> Configuration:
    """Return the machine with a node that takes a program."""
    (node,) = machine().nodes
    objects = {"1F50": 0xF, "1F51": 0x5, "1F56": 0x7, "1F57": 0x7}
    text = "".join(
        f"[{index}]\nParameterName=Program {index}\nObjectType=0x8\nSubNumber=2\n"
        f"[{index}sub0]\nParameterName=Number\nDataType=0x5\nAccessType=const\nDefaultValue=1\n"
        f"[{index}sub1]\nParameterName=Program {index}\nDataType=0x{kind:X}\nAccessType=rw\n\n"
        for index, kind in objects.items()
    )
    eds = folder / "program.eds"
    eds.write_text(node.eds.read_text().replace("[2000]\n", f"{text}[2000]\n", 1))
    return dataclasses.replace(machine(), nodes=(dataclasses.replace(node, eds=eds),))


def _producing(index: int, cob_id: int) -> Action:
    """Return the action that makes the node produce SYNC or TIME (bit 30)."""
    return _requests(write(index, 0, 1 << 30 | cob_id, 4))


_SEGMENT = Frame(0x605, bytes([0x60, *[0] * 7]))

SESSIONS: dict[str, ServiceSession] = {
    "lss": ServiceSession({  # asks for the node-ID
        20: [_frames(nmt(128))], 25: [_frames(Frame(0x7E5, bytes([4, 1, *[0] * 6])))],
        30: [_frames(Frame(0x7E5, bytes([0x5E, *[0] * 7])))],
        31: [_frames(Frame(0x7E5, bytes([0x5E, *[0] * 7])), nmt(1))],
    }),
    "emergency": ServiceSession({  # an inhibit time of 30 ms holds messages back
        10: [_requests(write(0x1015, 0, 300, 2))], 40: [SHORT_RPDO], 42: [SHORT_RPDO],
        60: [_requests(read(0x1003, 1))], 100: [LOOK],
    }),
    "profile": ServiceSession({  # the position is shown, and no TPDO sends it
        10: [_requests(write(0x1800, 1, 1 << 31 | 0x185, 4), write(0x1801, 1, 1 << 31 | 0x285, 4))],
        40: [LOOK], 60: [LOOK], 80: [_requests(read(0x6004))], 100: [LOOK],
    }, configured=_encoder),
    "sensors": ServiceSession({  # the supply pressure leaves its range and comes back
        30: [("set", "supply_pressure", 300e5)], 35: [LOOK],
        60: [("set", "supply_pressure", 160e5)], 90: [_requests(read(0x2020))], 100: [LOOK],
    }),
    "set_points": ServiceSession({  # a set point of an SDO, and the safe value
        20: [_requests(write(0x2000, 0, 1000, 4))], **{t: [SILENT] for t in range(21, 50)},
        30: [SILENT, LOOK], 60: [_requests(write(0x2001, 0, 2000, 4))], 80: [_frames(nmt(128))],
        90: [_frames(nmt(1))],
    }),
    "courses": ServiceSession(
        {t: [_requests(read(0x2041))] for t in (30, 60, 90)}, configured=_with_course
    ),
    "store": ServiceSession({  # "save", another value, a reset that brings the stored one back
        20: [_requests(write(0x1017, 0, 13, 2), write(0x1010, 1, 0x65766173, 4))],
        40: [_requests(write(0x1017, 0, 7, 2))], 60: [_frames(nmt(129))], 65: [_frames(nmt(1))],
    }),
    "sdo": ServiceSession({  # a segmented upload whose client goes silent for a second
        20: [_requests(read(0x1008), _SEGMENT)], 40: [_requests(read(0x2020))],
        60: [_requests(read(0x1008))],
    }, ticks=1100),
    "heartbeat": ServiceSession({
        20: [_requests(write(0x1017, 0, 7, 2))], 60: [_requests(write(0x1017, 0, 0, 2))],
        90: [_requests(write(0x1017, 0, 1, 2))],
    }),
    "guarding": ServiceSession({  # the master guards twice, then not for the life time of 30 ms
        10: [_requests(write(0x1017, 0, 0, 2), write(0x100C, 0, 15, 2), write(0x100D, 0, 2, 1))],
        30: [_frames(Frame(0x705, remote=True))], 50: [_frames(Frame(0x705, remote=True))],
        100: [_frames(nmt(1))],
    }),
    "consumer": ServiceSession({  # node 6 falls silent
        10: [_requests(write(0x1016, 1, 6 << 16 | 25, 4))],
        30: [_frames(Frame(0x706, b"\5"))], 50: [_frames(Frame(0x706, b"\5"))],
        100: [_frames(nmt(1), Frame(0x706, b"\5"))],
    }),
    "sync": ServiceSession({  # TPDOs of each and of every third SYNC; a SYNC of a wrong length
        10: [_requests(*typed(1, 1))], 30: [_requests(*typed(2, 3))],
        50: [("replaced", Frame(0x80, b"\1"))], 60: [("replaced", SYNC, SYNC)],
        70: [_requests(write(0x1019, 0, 4, 1))], 80: [("replaced", Frame(0x80, b"\2"))],
    }),
    "sync_producer": ServiceSession({
        **{t: [SET_POINT] for t in range(10, 20)},
        20: [_requests(*typed(1, 1), write(0x1006, 0, 3000, 4))], 40: [_producing(0x1005, 0x80)],
        70: [_requests(write(0x1005, 0, 0x80, 4))], 100: [_producing(0x1005, 0x80)],
    }),
    "time": ServiceSession({  # heard, then produced once a second
        20: [_requests(write(0x1012, 0, 1 << 31 | 0x100, 4))],
        40: [_frames(Frame(0x100, bytes([1, 2, 3, 0, 5, 6])))], 50: [_requests(read(0x2042))],
        60: [_producing(0x1012, 0x100)],
    }, ticks=1100),
    "verification": ServiceSession({  # a write of a parameter clears the date
        20: [_requests(write(0x1020, 1, 9000, 4))], 40: [LOOK],
        60: [_requests(write(0x1800, 5, 2, 2))], 80: [LOOK],
    }),
    "programs": ServiceSession({  # a program is written, started and cleared
        20: [_requests(write(0x1F50, 1, 0x64636261, 4), write(0x1F51, 1, 1, 1))], 40: [LOOK],
        60: [_requests(write(0x1F51, 1, 0, 1), write(0x1F51, 1, 3, 1))],
    }, configured=_with_program),
    "pdos": ServiceSession({  # set points come late and stop; a TPDO is sent by request, by change
        **{t: [ONLY_SYNC] for t in (*range(30), *range(50, 80))},
        10: [ONLY_SYNC, _requests(*typed(2, 253))],
        25: [ONLY_SYNC, _frames(Frame(0x285, remote=True))],
        90: [_requests(*typed(2, 255, 0, 50))], 120: [_requests(*typed(2, 254, 3))],
    }),
}  # fmt: skip

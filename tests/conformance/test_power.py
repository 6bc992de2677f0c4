"""The suite tells a broken device from a sound one.

Each test breaks one service of a device that passes everything, and names the cases that notice.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest
from constant_node import make_node, stepper
from suite import own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus
from hil_emulator.device import cob_id, node_guarding, sdo, sdo_block, sdo_segmented
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DataType
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.device.storage import ParameterStore
from hil_emulator.device.sync import SyncConsumer
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.platform.paths import shipped

EDS = shipped("eds/hydraulic_actuator.eds")
NODE = 5
CRASHES = ("AttributeError", "TypeError", "KeyError", "NameError")
"""How a device ends that is not broken as intended: a case that fails of these proves nothing."""


def nothing(*_: Any, **__: Any) -> None:
    """Do nothing, whatever is asked."""


def answering(value: Any) -> Callable[..., Any]:
    """Return a function that always answers the same."""
    return lambda *_, **__: value


def without_subindices(dictionary: Dictionary, index: int, subindex: int = 0) -> Entry:
    """Return an entry, or refuse it with the code that is for objects."""
    found = dictionary.get(index, subindex)
    if found is None:
        raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
    return found


SOUND_RESET = HeartbeatConsumer.reset


def watching_on(consumer: HeartbeatConsumer) -> None:
    """Reset, but go on waiting for the heartbeats that were waited for."""
    waiting = dict(vars(consumer))
    SOUND_RESET(consumer)
    for name in ("_deadlines_ns", "due_ns"):
        setattr(consumer, name, waiting.get(name, getattr(consumer, name)))


@dataclass(frozen=True)
class Breakage:
    """One defect.

    Attributes:
        owner: module or class that is changed.
        name: what of it.
        broken: what is there instead.
        noticed: cases that have to fail.

    """

    owner: Any
    name: str
    broken: Any
    noticed: str


BREAKAGES = {
    "toggle bit ignored": Breakage(
        sdo_segmented, "_check_toggle", lambda command, _: command & 0x10, "2.17"
    ),
    "wrong checksum": Breakage(sdo_block, "crc", answering(1), "2.23 2.24 2.25"),
    "any block size": Breakage(sdo_block, "check_block_size", lambda size: size, "2.26"),
    "any length": Breakage(DataType, "check_length", nothing, "2.8 2.9"),
    "any value": Breakage(Entry, "check", nothing, "2.10 2.11 4.6"),
    "everything writable": Breakage(Entry, "writable", True, "2.3 4.3"),
    "any identifier": Breakage(cob_id, "check_can_id", nothing, "8.10"),
    "absent sub-index taken for an object": Breakage(
        Dictionary, "entry", without_subindices, "2.5 4.5"
    ),
    "no SDO server": Breakage(sdo.SdoServer, "request", nothing, "2.1 9.2"),
    "silent heartbeat": Breakage(Heartbeat, "publish", nothing, "7.102 7.204 7.206 9.3 10.4"),
    "eternal heartbeat": Breakage(Heartbeat, "changed", nothing, "7.103 7.202"),
    "nobody watched": Breakage(HeartbeatConsumer, "expired", answering(False), "5.4 5.5 5.6 7.106"),
    "one node watched twice": Breakage(HeartbeatConsumer, "check", nothing, "7.104"),
    "watching after a reset": Breakage(HeartbeatConsumer, "reset", watching_on, "7.107"),
    "stuck guarding toggle": Breakage(node_guarding, "_TOGGLE", 0, "7.3"),
    "guarding beside heartbeat": Breakage(
        node_guarding, "PRODUCER_HEARTBEAT_TIME", 0x1FFF, "7.205 7.207"
    ),
    "master never lost": Breakage(node_guarding.NodeGuarding, "expired", answering(False), "7.6"),
    "forgetful storage": Breakage(ParameterStore, "_parameters", answering({}), "6.8 6.10 8.2 8.6"),
    "no signature": Breakage(ParameterStore, "check", nothing, "8.1 8.3 8.5 8.7"),
    "no history": Breakage(Emergency, "_record", nothing, "5.6"),
    "no error register": Breakage(Emergency, "_update_register", nothing, "5.5"),
    "any SYNC counter": Breakage(SyncConsumer, "check", nothing, "6.5 6.9"),
    "deaf to SYNC": Breakage(Tpdo, "sync", nothing, "3.6 3.8 6.3 6.4 6.6 9.3"),
    "deaf to requests": Breakage(Tpdo, "request", nothing, "3.3"),
    "no event timer": Breakage(Tpdo, "_on_timer", nothing, "3.5"),
    "no inhibit time": Breakage(PdoParameters, "inhibit_us", 0, "3.4"),
    "mapping unchecked": Breakage(
        PdoParameters, "_check_mapping", nothing, "3.23 3.24 3.25 3.26 3.28 3.31"
    ),
    "inputs received": Breakage(Entry, "receivable", True, "3.28 3.29"),
    "outputs transmitted": Breakage(Entry, "transmittable", True, "3.31 3.32"),
}


@pytest.mark.parametrize("breakage", BREAKAGES.values(), ids=BREAKAGES)
def test_a_defect_is_noticed(breakage: Breakage, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cases that are about a broken service fail."""
    monkeypatch.setattr(breakage.owner, breakage.name, breakage.broken)
    settings = own_channel()
    noticed = set(breakage.noticed.split())
    with Bus(settings) as own, Bus(settings) as peer:
        step = stepper(make_node(EDS, NODE), own)
        results = run_in_lock_step(peer, step, NODE, EDS, only=noticed)
    assert results.outcomes == dict.fromkeys(noticed, "failed")
    crashed = [text for text in results.remarks if any(error in text for error in CRASHES)]
    assert not crashed, crashed

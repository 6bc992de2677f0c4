"""100 kB by SDO block transfer during process data, with a stock client."""

import random
from pathlib import Path

from device_master import CHANNELS, NODE_ID, TPDO1, Master, booted
from edited_eds import added, edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

DOMAIN = 0xF
STORE = 0x2100
SIZE = 100_000


def master_of_a_store(tmp_path: Path) -> Master:
    """Return a master of a device with a DOMAIN object, OPERATIONAL."""
    eds = edited(tmp_path, added(f"{STORE:04X}", DOMAIN))
    node = Node(Dictionary.from_eds(eds, NODE_ID), CHANNELS, {"valve_current": 0.0})
    master = booted(node, eds)
    master.start()
    return master


def test_hundred_kilobytes_pass_during_process_data(tmp_path: Path) -> None:
    """Data downloaded in blocks are uploaded unchanged, and each tick has its TPDO."""
    data = random.Random(100).randbytes(SIZE)
    master = master_of_a_store(tmp_path)
    begin_ns = master.network.now_ns
    with master.remote.sdo.open(STORE, 0, "wb", size=SIZE, block_transfer=True) as stream:
        stream.write(data)
    with master.remote.sdo.open(STORE, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == data
    ticks = (master.network.now_ns - begin_ns) // 1_000_000
    counters = [int.from_bytes(frame[6:8], "little") for frame in master.data(TPDO1)]
    assert len(counters) == ticks > SIZE // 7
    assert counters == [(counters[0] + n) % 0x10000 for n in range(ticks)]

"""100 kB by SDO block transfer to the running emulator, during its process data at 1 kHz."""

import random
from pathlib import Path

import canopen
from test_end_to_end import NODE, Counters, emulator

from hil_emulator.platform.paths import shipped

STORE = 0x2100
SIZE = 100_000
OBJECT = f"[{STORE:04X}]\nParameterName=store\nDataType=0xF\nAccessType=rw\n\n"


def test_no_sample_is_missed_during_a_large_transfer(tmp_path: Path) -> None:
    """A stock master reads back 100 kB, and receives every sample of 1 kHz in each TPDO."""
    eds = tmp_path / "store.eds"
    text = shipped("eds/hydraulic_actuator.eds").read_text()
    eds.write_text(text.replace("[2000]\n", OBJECT + "[2000]\n", 1))
    layer = tmp_path / "store.toml"
    layer.write_text(f'[[node]]\nid = {NODE}\neds = "{eds}"\nsafe_current = "0 mA"\n')
    data = random.Random(100).randbytes(SIZE)
    with emulator(tmp_path, str(layer)) as (port, _):
        network = canopen.Network()
        network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
        try:
            node = network.add_node(NODE, str(eds))
            counters = Counters(network)
            node.nmt.state = "OPERATIONAL"
            with node.sdo.open(STORE, 0, "wb", size=SIZE, block_transfer=True) as stream:
                stream.write(data)
            with node.sdo.open(STORE, 0, "rb", block_transfer=True) as stream:
                assert stream.read() == data
        finally:
            network.disconnect()
    assert counters.missing() == dict.fromkeys(counters.seen, 0)
    assert all(len(samples) > SIZE // 7 // 128 for samples in counters.seen.values())

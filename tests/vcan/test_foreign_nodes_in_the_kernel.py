"""Ten foreign nodes and one actuator on kernel CAN with a master in C, observed by candump."""

import os
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest
from ten_foreign_nodes import ACTUATOR, BIT_RATE, NODES, SYNC_MS, bits, periods_ms, set_up

SECONDS = 20
STRETCH = 5
"""Of all periods, as an emulated processor is slow (assumed)."""
MASTER = Path(__file__).with_name("master.c")
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
PROGRAM = Path(__file__).with_name("nodes_without_hydraulics.py")

pytestmark = [
    pytest.mark.vcan,
    pytest.mark.slow,
    pytest.mark.skipif(not all(map(shutil.which, ("cc", "candump"))), reason="no cc or can-utils"),
]


def test_all_that_was_set_up_is_on_the_bus(tmp_path: Path, socketcan_channel: str) -> None:
    """Every node answers and sends each of its messages; no more load than that of the periods.

    Less is possible: an emulated processor may be late.
    """
    master, log = tmp_path / "master", tmp_path / "candump.log"
    subprocess.run(["cc", "-O1", "-o", str(master), str(MASTER)], check=True)
    setup = "".join(" ".join(map(str, write)) + "\n" for write in set_up(STRETCH))
    arguments = [SECONDS, SYNC_MS * STRETCH, ACTUATOR]
    with (
        log.open("w") as out,
        subprocess.Popen(["candump", "-L", socketcan_channel], stdout=out) as candump,
        subprocess.Popen([sys.executable, str(PROGRAM), socketcan_channel], env=ENVIRONMENT) as run,
    ):
        try:
            while f"{0x700 + NODES[-1]:03X}#00" not in log.read_text():
                assert run.poll() is None
                time.sleep(0.1)
            subprocess.run(
                [str(master), socketcan_channel, *map(str, arguments)],
                input=setup, text=True, check=True, stdout=subprocess.PIPE,
            )  # fmt: skip
        finally:
            run.terminate()
            candump.terminate()
    lengths = defaultdict(list)
    for can_id, data in started(log):
        lengths[can_id].append(bits(can_id, data))
    periods = periods_ms(STRETCH)
    assert set(lengths) == set(periods)
    measured = sum(map(sum, lengths.values())) / SECONDS
    computed = sum(
        sum(each) / len(each) / (periods[can_id] / 1e3) for can_id, each in lengths.items()
    )
    assert 0.0 < measured / BIT_RATE <= 1.02 * computed / BIT_RATE


def started(log: Path) -> list[tuple[int, bytes]]:
    """Return identifier and data of the frames after the nodes were started, in `SECONDS`."""
    rows = [line.split() for line in log.read_text().splitlines()]
    begin = next(float(time[1:-1]) for time, _, text in rows if text == "000#0100")
    frames = [text.split("#") for t, _, text in rows if 0 < float(t[1:-1]) - begin <= SECONDS]
    return [(int(can_id, 16), bytes.fromhex(data)) for can_id, data in frames]

"""Machine code that several processes ask for at once."""

import subprocess
import sys
from pathlib import Path

BEGUN = """
import sys
from pathlib import Path
from hil_emulator.model.kernel import build
from hil_emulator.model.plant import Supply
kernel = build((), Path(sys.argv[1]))
Supply(kernel, 20e-6).step(0)
print(sum(kernel.tick_and_report.stats.cache_misses.values()))
"""


def test_processes_that_start_at_once_compile_once(tmp_path: Path) -> None:
    """On an empty cache one of three compiles, and the others take what it has made."""
    begun = [subprocess.Popen([sys.executable, "-c", BEGUN, str(tmp_path)], stdout=subprocess.PIPE)
             for _ in range(3)]  # fmt: skip
    told = [process.communicate()[0] for process in begun]
    assert sorted(map(int, told)) == [0, 0, 1]

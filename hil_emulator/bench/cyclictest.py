"""How late the system itself is: `cyclictest` of rt-tests, where it is installed."""

import shutil
import subprocess

_LONGEST_US = 20_000  # bins of 1 us; what is later counts as that (assumed)


def lateness_p99_us(duration: float, period_us: int = 1_000, priority: int = 50) -> float | None:
    """Return the p99 of its lateness [us]; None where it is not there or may not run.

    Args:
        duration: how long it measures [s].
        period_us: between its wake-ups, as of the loop's ticks.
        priority: of SCHED_FIFO, as the loop's.

    """
    program = shutil.which("cyclictest")
    if program is None:
        return None
    loops = max(1, round(duration * 1e6 / period_us))
    options = [f"--priority={priority}", f"--interval={period_us}", f"--loops={loops}"]
    told = subprocess.run(
        [program, "--quiet", "--mlockall", f"--histogram={_LONGEST_US}", *options],
        capture_output=True, text=True,
    )  # fmt: skip
    counts = [line.split() for line in told.stdout.splitlines() if line[:1].isdigit()]
    passed = 0
    for lateness, count in counts:
        passed += int(count)
        if passed >= 0.99 * loops:
            return float(lateness)
    return float(_LONGEST_US) if counts else None

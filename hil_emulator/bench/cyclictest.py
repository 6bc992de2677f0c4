"""Wake-up lateness of the operating system, by `cyclictest` of rt-tests if it is installed."""

import shutil
import subprocess

_LONGEST_US = 20_000  # bins of 1 us; the last bin takes all later ones (assumed)


def lateness_p99_us(duration: float, period_us: int = 1_000, priority: int = 50) -> float | None:
    """Return the p99 of the wake-up lateness [us]; None if `cyclictest` is missing or may not run.

    Args:
        duration: length of the measurement [s].
        period_us: time between two wake-ups [us]; the loop's is the default.
        priority: priority under SCHED_FIFO; the loop's is the default.

    """
    program = shutil.which("cyclictest")
    if program is None:
        return None
    loops = max(1, round(duration * 1e6 / period_us))
    options = [f"--priority={priority}", f"--interval={period_us}", f"--loops={loops}"]
    completed = subprocess.run(
        [program, "--quiet", "--mlockall", f"--histogram={_LONGEST_US}", *options],
        capture_output=True, text=True,
    )  # fmt: skip
    counts = [line.split() for line in completed.stdout.splitlines() if line[:1].isdigit()]
    passed = 0
    for lateness, count in counts:
        passed += int(count)
        if passed >= 0.99 * loops:
            return float(lateness)
    return float(_LONGEST_US) if counts else None

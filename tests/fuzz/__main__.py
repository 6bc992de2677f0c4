"""The attacks as studies, from the command line."""

import argparse
import logging
import sys
import time
import warnings


def main() -> int:
    """Run one; exit code 1 if anything has ended in a traceback."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("attack", choices=["requests", "frames"])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    logging.disable(logging.CRITICAL)  # libraries log what they refuse
    warnings.simplefilter("ignore")
    begin = time.monotonic()
    if given.attack == "requests":
        from tests.fuzz.requests import attack

        failed = attack(given.count, given.seed)
    else:
        from tests.fuzz.frames import attack

        failed = attack(given.count, given.seed)
    print(f"{given.count} {given.attack} in {time.monotonic() - begin:.0f} s, {failed} failed")
    return bool(failed)


sys.exit(main())

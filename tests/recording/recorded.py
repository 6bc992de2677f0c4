"""What the controller of the recorded half second does."""

from rigs import START, set_point

from hil_emulator.frame import Frame

TICKS = 500


def script(k: int) -> list[Frame]:
    """Return what the controller sends in tick `k`."""
    if k == 5:
        return [START]
    return [set_point(0.8 if k % 200 < 100 else -0.6)] if k > 10 else []

"""A run before the user's eyes: a status line while it lasts, a summary at its end."""

import select
import signal
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from hil_emulator.bus.bus import Bus
from hil_emulator.simulation.clock import Clock, FollowSync
from hil_emulator.simulation.loop import Ticking, Timing, run
from hil_emulator.simulation.rig import Rig
from hil_emulator.wire.wire import TimedWire

FOREVER = 2**62
"""Ticks of a run without a duration."""

READY = "ready"
"""Said when the first frame, the boot-up message, is out."""

_STATUS_S = 0.5  # between two status lines
_SLIP_NS = 100_000_000  # by which time has slipped further before it is told again (assumed)
_BETWEEN_S = 0.01  # emulator time between two calls of what else there is to do


class Teller(Protocol):
    """Where a run tells how it is."""

    live: bool
    """whether a status line is wanted"""

    def ready(self) -> None:
        """Tell that the first frame is out."""
        ...

    def show(self, status: str) -> None:
        """Show how it stands; never wait."""
        ...

    def warn(self, text: str) -> None:
        """Warn of something; never wait."""
        ...

    def end(self) -> None:
        """Take the status line back."""
        ...


class Terminal:
    """Tells the user's terminal, or the files in its place."""

    def __init__(self) -> None:
        self.live = sys.stderr.isatty()

    def ready(self) -> None:
        """Tell that the first frame is out."""
        print(READY, flush=True)

    def show(self, status: str) -> None:
        """Rewrite the status line, unless the terminal would make the loop wait."""
        if select.select([], [sys.stderr], [], 0)[1]:
            sys.stderr.write(f"\r\x1b[K{status}")
            sys.stderr.flush()

    def warn(self, text: str) -> None:
        """Write a line that stays, unless the terminal would make the loop wait."""
        line = f"warning   {text}"
        if select.select([], [sys.stderr], [], 0)[1]:
            sys.stderr.write(f"\r\x1b[K{line}\n" if self.live else f"{line}\n")
            sys.stderr.flush()

    def end(self) -> None:
        """Take the status line back."""
        if self.live:
            sys.stderr.write("\r\x1b[K")


def keep_running(
    rig: Ticking,
    clock: Clock,
    ticks: int,
    timing: Timing,
    status: Callable[[], str],
    between: Callable[[], None] | None = None,
    stop_when_late: bool = False,
    teller: Teller | None = None,
) -> None:
    """Run in slices until all ticks have passed; Ctrl-C and SIGTERM end it.

    Args:
        rig: what is run.
        clock: when its ticks begin.
        ticks: how many there are.
        timing: takes down how punctual they were.
        status: returns the line to show where one is wanted.
        between: called every few ticks, where there is something else to do.
        stop_when_late: whether a tick that begins a whole period late ends the run.
        teller: where it tells how it is; the terminal without any.

    Raises:
        UserError: for such a tick.

    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    told = teller or Terminal()
    pause = _BETWEEN_S if between else _STATUS_S
    slice_ticks = max(1, round(pause * 1e9 / rig.tick_ns))
    shown, told_ns = 0.0, 0
    try:
        if not isinstance(clock, FollowSync):  # whose nodes boot before the first SYNC
            run(rig, clock, min(1, ticks), timing, stop_when_late)
        told.ready()
        while timing.ticks < ticks:
            run(rig, clock, min(slice_ticks, ticks - timing.ticks), timing, stop_when_late)
            if between:
                between()
            if timing.slipped_ns >= told_ns + _SLIP_NS:
                told_ns = timing.slipped_ns
                told.warn(f"{behind(timing)}: this machine is too slow, or too busy")
            if told.live and time.monotonic() - shown > _STATUS_S / 2:
                shown = time.monotonic()
                told.show(status())
    except KeyboardInterrupt:
        pass
    finally:
        told.end()


def behind(timing: Timing) -> str:
    """Return how far emulator time has fallen behind the wall."""
    return f"{timing.slipped_ns * 1e-9:.3f} s behind the wall"


def traffic(buses: Sequence[Bus]) -> str:
    """Return how many frames went over all buses."""
    received, sent, dropped = (
        sum(getattr(bus, name) for bus in buses) for name in ("received", "sent", "dropped")
    )
    return f"{received} in, {sent} out, {dropped} dropped"


def load(wires: Iterable[TimedWire]) -> str:
    """Return how loaded buses that take time are; "" where none does."""
    return "".join(f"  load {wire.load:.1%}" for wire in wires)


def departures(rigs: Mapping[str, Rig]) -> list[str]:
    """Return which rods left their strokes, and when."""
    return [
        f"stroke    {name} left it at {rig.left_stroke_ns * 1e-9:.3f} s: [cylinder] end_stops are "
        "off, and no cylinder is like that"
        for name, rig in rigs.items()
        if rig.left_stroke_ns is not None
    ]


def summary(
    rig: Ticking,
    timing: Timing,
    buses: Sequence[Bus],
    wires: Iterable[TimedWire] = (),
    remarks: Sequence[str] = (),
) -> str:
    """Return how punctual a run was, what went over the buses and how loaded wires were.

    Args:
        rig: what ran.
        timing: how punctual it was.
        buses: what its frames went over.
        wires: those of them that take time.
        remarks: further lines.

    """
    late = f"{timing.overruns} late, {behind(timing)}" if timing.overruns else "0 late"
    lines = [f"time      {rig.now_ns * 1e-9:.3f} s, {timing.ticks} ticks, {late}"]
    for name, durations in (("lateness", timing.lateness), ("execution", timing.execution)):
        us = durations.summary()
        lines.append(
            f"{name:<9} p50 {us['p50']:.0f} us, p99 {us['p99']:.0f} us, "
            f"p99.9 {us['p999']:.0f} us, max {us['max']:.0f} us"
        )
    lines.append(f"frames    {traffic(buses)}")
    for wire in wires:
        lines.append(f"bus load  {wire.load:.1%} in the last second, {wire.peak:.1%} at most")
    return "\n".join([*lines, *remarks])

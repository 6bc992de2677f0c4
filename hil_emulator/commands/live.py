"""Status line of a run, and the summary at its end."""

import select
import signal
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from hil_emulator.bus.bus import Bus
from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.simulation.clock import Clock, FollowSync
from hil_emulator.simulation.loop import Ticking, Timing, run
from hil_emulator.simulation.rig import Rig

FOREVER = 2**62
"""Ticks of a run without a duration."""

READY = "ready"
"""Line that is printed when the first frame, the boot-up message, has been sent."""

BEHIND = (
    "this machine is too slow, or too busy; the controller may have seen late readings and "
    "time-outs that are not its fault; `hil-emulator run --help` has the remedies"
)
"""Meaning of a delay behind real time, for the warning."""

_STATUS_S = 0.5  # between two status lines
_SLIP_NS = 100_000_000  # further delay after which the warning is repeated (assumed)
_BETWEEN_S = 0.01  # emulator time between two calls of `between`


class StatusOutput(Protocol):
    """Output of a run's status."""

    live: bool
    """whether a status line is wanted"""

    def ready(self) -> None:
        """Report that the first frame has been sent."""
        ...

    def show(self, status: str) -> None:
        """Show the status without waiting."""
        ...

    def warn(self, text: str) -> None:
        """Show a warning without waiting."""
        ...

    def end(self) -> None:
        """Remove the status line."""
        ...


class Terminal:
    """Writes to the user's terminal, or to redirected output."""

    def __init__(self) -> None:
        self.live = sys.stderr.isatty()

    def ready(self) -> None:
        """Report that the first frame has been sent."""
        print(READY, flush=True)

    def show(self, status: str) -> None:
        """Rewrite the status line, unless the terminal would block the loop."""
        if select.select([], [sys.stderr], [], 0)[1]:
            sys.stderr.write(f"\r\x1b[K{status}")
            sys.stderr.flush()

    def warn(self, text: str) -> None:
        """Write a permanent line, unless the terminal would block the loop."""
        line = f"warning   {text}"
        if select.select([], [sys.stderr], [], 0)[1]:
            sys.stderr.write(f"\r\x1b[K{line}\n" if self.live else f"{line}\n")
            sys.stderr.flush()

    def end(self) -> None:
        """Remove the status line."""
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
    teller: StatusOutput | None = None,
) -> None:
    """Run in slices until all ticks have passed; Ctrl-C and SIGTERM end it.

    Args:
        rig: the rig or machine.
        clock: decides when its ticks begin.
        ticks: their number.
        timing: records delay and duration of the ticks.
        status: returns the status line.
        between: called every few ticks.
        stop_when_late: whether a tick that begins a whole period late ends the run.
        teller: output of the status; the terminal without any.

    Raises:
        UserError: for such a tick.

    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    output = teller or Terminal()
    pause = _BETWEEN_S if between else _STATUS_S
    slice_ticks = max(1, round(pause * 1e9 / rig.tick_ns))
    shown, told_ns = 0.0, 0
    try:
        if not isinstance(clock, FollowSync):  # whose nodes boot before the first SYNC
            run(rig, clock, min(1, ticks), timing, stop_when_late)
        output.ready()
        while timing.ticks < ticks:
            run(rig, clock, min(slice_ticks, ticks - timing.ticks), timing, stop_when_late)
            if between:
                between()
            if timing.slipped_ns >= told_ns + _SLIP_NS:
                told_ns = timing.slipped_ns
                output.warn(f"{behind(timing)}: {BEHIND}")
            if output.live and time.monotonic() - shown > _STATUS_S / 2:
                shown = time.monotonic()
                output.show(status())
    except KeyboardInterrupt:
        pass
    finally:
        output.end()


def behind(timing: Timing) -> str:
    """Return how far emulator time is behind real time."""
    return f"{timing.slipped_ns * 1e-9:.3f} s behind real time"


def traffic(buses: Sequence[Bus]) -> str:
    """Return the number of frames on all buses."""
    received, sent, dropped = (
        sum(getattr(bus, name) for bus in buses) for name in ("received", "sent", "dropped")
    )
    return f"{received} in, {sent} out, {dropped} dropped"


def load(wires: Iterable[TimedWire]) -> str:
    """Return the load of buses with modelled timing; "" without any."""
    return "".join(f"  load {wire.load:.1%}" for wire in wires)


def departures(rigs: Mapping[str, Rig]) -> list[str]:
    """Return the actuators whose rods left their strokes, and when."""
    return [
        f"stroke    {name} left it at {rig.left_stroke_ns * 1e-9:.3f} s: [cylinder] end_stops are "
        "off, which is possible for no cylinder"
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
    """Return timing, frames and bus loads of a run as lines.

    Args:
        rig: the rig or machine.
        timing: delay and duration of its ticks.
        buses: the buses of its frames.
        wires: those with modelled timing.
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

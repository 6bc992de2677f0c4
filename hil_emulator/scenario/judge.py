"""All expectations of a scenario, observed while it is played."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from hil_emulator.device.abort import SdoAbort
from hil_emulator.device.entry import Entry
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.frame_watch import AnsweringFrame, SeenFrame, chosen
from hil_emulator.scenario.names import object_of
from hil_emulator.scenario.outcome import Check, Span
from hil_emulator.scenario.watch import LimitedValue, ReachingValue, StayingValue, Watch, check
from hil_emulator.signals.columns import Readings, columns
from hil_emulator.simulation.rig import Rig
from hil_emulator.units import read_as, show, to_si


class Judge:
    """Observes the expectations, as one of the recorders of a rig.

    Args:
        expectations: of the scenario.
        rig: on which it is played.

    Attributes:
        settled: checks that became final since the list was emptied last.

    Raises:
        UserError: for a message or object that the rig lacks.

    """

    def __init__(self, expectations: Sequence[Expect], rig: Rig) -> None:
        self._watches = [(e.after, watch_of(e, rig)) for e in expectations]
        self._open = list(self._watches)
        self._begun_ns: dict[str, int] = {}
        self.settled: list[Check] = []

    def begin(self, now_ns: int, step: str = "") -> None:
        """Let the times of expectations begin: those after a step, or those from the start."""
        self._begun_ns.setdefault(step, now_ns)

    @property
    def checks(self) -> tuple[Check, ...]:
        """The present check of each expectation."""
        return tuple(check(watch, after) for after, watch in self._watches)

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Observe the end of a tick."""
        self._observe(now_ns, lambda watch, now: watch.tick(now))

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Observe frames that the emulator has received or sent."""
        self._observe(now_ns, lambda watch, now: watch.frames(now, frames))

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Conclude: nothing more will happen."""
        for _, watch in self._open:
            watch.end()
        self._settle()

    def spans(self, duration: float) -> Iterable[Span]:
        """Yield where signals are expected, in the time of the scenario [s]."""
        start_ns = self._begun_ns.get("", 0)
        for after, watch in self._watches:
            span = watch.span(duration)
            if span and after in self._begun_ns:
                offset = (self._begun_ns[after] - start_ns) * 1e-9
                begin, end = (min(offset + time, duration) for time in (span.begin, span.end))
                yield replace(span, begin=begin, end=end)

    def _observe(self, now_ns: int, observe: Callable[[Watch, float], None]) -> None:
        changed = False
        for after, watch in self._open:
            begun_ns = self._begun_ns.get(after)
            if begun_ns is not None:
                observe(watch, (now_ns - begun_ns) / 1e9)
                changed = changed or watch.state != "open"
        if changed:
            self._settle()

    def _settle(self) -> None:
        self.settled += [check(watch, after) for after, watch in self._open if _final(watch)]
        self._open = [(after, watch) for after, watch in self._open if not _final(watch)]


def _final(watch: Watch) -> bool:
    return watch.state != "open"


def watch_of(e: Expect, rig: Rig) -> Watch:
    """Return what observes an expectation.

    Raises:
        UserError: for a message or object that the rig lacks.

    """
    if e.frame is not None:
        selected = chosen(e.frame, rig.nodes, e.content)
        if e.after_each is not None:
            return AnsweringFrame(e, selected, chosen(e.after_each, rig.nodes))
        return SeenFrame(e, selected)
    value = _signal(e, rig) if e.signal is not None else _object(e, rig.nodes)
    if e.by is not None:
        return ReachingValue(value, e.start, e.by, e.lasting)
    return StayingValue(value, e.start, e.until)


def _signal(e: Expect, rig: Rig) -> LimitedValue:
    assert e.signal is not None
    assert e.within is not None
    name, unit = e.signal, columns()[e.signal]
    shown, (low, high) = read_as(unit), map(float, e.within)
    return LimitedValue(
        name, lambda: rig.value(name), lambda v: show(v, unit, shown), (low, high), name
    )


def _object(e: Expect, nodes: Sequence[Node]) -> LimitedValue:
    """Return the value of an object, in its unit if the EDS has one."""
    assert e.object is not None
    assert e.within is not None
    number, index, subindex = object_of(e.object)
    for node in nodes:
        entry = node.dictionary.get(index, subindex)
        if number in (None, node.node_id) and entry is not None and entry.type.numeric:
            break
    else:
        raise UserError(f"expect: {e.object}: no node has such an object that is a number")
    limits = [_limit(e.object, bound, entry) for bound in e.within]
    unit = entry.unit

    def read() -> float:
        try:
            return entry.physical(float(node.dictionary.read(index, subindex)))
        except SdoAbort:  # an SDO client gets no value either
            return float("nan")

    def written(value: float) -> str:
        return show(value, unit, read_as(unit)) if unit else f"{entry.digits(value):g}"

    return LimitedValue(f"{e.object} {entry.name}", read, written, (limits[0], limits[1]))


def _limit(name: str, bound: float | str, entry: Entry) -> float:
    """Return a limit: digits of the object, or a quantity."""
    try:
        if isinstance(bound, str) and entry.unit:
            return to_si(bound, entry.unit)
        return entry.physical(float(int(bound, 0)) if isinstance(bound, str) else bound)
    except ValueError as error:
        raise UserError(f"expect: {name}: {error}") from None

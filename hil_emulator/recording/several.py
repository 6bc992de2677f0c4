"""Several recorders of the same ticks: a file, a panel."""

from collections.abc import Iterable, Mapping
from typing import Any

from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.recording.memory import Recorder
from hil_emulator.signals.columns import Readings


class Recorders:
    """Passes each tick to several recorders, in their order.

    Args:
        recorders: at least one.

    """

    def __init__(self, *recorders: Recorder) -> None:
        self._recorders = recorders

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Pass set points, readings and signals at the end of a tick."""
        for recorder in self._recorders:
            recorder.row(now_ns, plant, measured)

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Pass frames."""
        given = list(frames)
        for recorder in self._recorders:
            recorder.bus(now_ns, given, sent=sent)

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Pass an action on the rig."""
        for recorder in self._recorders:
            recorder.event(now_ns, what)

"""Objects whose value is a given function of time, independent of the plant."""

from bisect import bisect_right
from collections.abc import Sequence

from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.entry import Entry


class Course:
    """Values that change linearly from corner to corner.

    Before its first and after its last corner the course holds their values. A repeating course
    restarts at time 0 when it has reached the last corner.

    Args:
        points: time [ns], rising, and value [digits] of each corner; at least one.
        repeat: whether it restarts after the last corner.

    """

    def __init__(self, points: Sequence[tuple[int, float]], *, repeat: bool = False) -> None:
        self._times = [time for time, _ in points]
        self._values = [value for _, value in points]
        self._repeat = repeat and self._times[-1] > 0

    def value(self, now_ns: int) -> float:
        """Return the value at a time."""
        time = now_ns % self._times[-1] if self._repeat else now_ns
        after = bisect_right(self._times, time)
        if after == 0:
            return self._values[0]
        if after == len(self._times):
            return self._values[-1]
        begin, end = self._times[after - 1], self._times[after]
        start, stop = self._values[after - 1], self._values[after]
        return start + (stop - start) * (time - begin) / (end - begin)


class Courses:
    """The objects of a node that follow courses.

    Args:
        courses: by entry, which has to be a number.

    Attributes:
        sources: by (index, sub-index), that a course feeds it.

    """

    def __init__(self, courses: Sequence[tuple[Entry, Course]]) -> None:
        self._followed = [(entry, course, *entry.bounds) for entry, course in courses]
        self.sources = {(entry.index, entry.subindex): "course" for entry, _ in courses}

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: objects on a course change in each tick."""
        return NOW if self.sources else NEVER

    def publish(self, now_ns: int) -> None:
        """Set every object to its present value, within its limits."""
        for entry, course, low, high in self._followed:
            value = min(max(course.value(now_ns), low), high)
            entry.value = round(value) if entry.type.kind == "integer" else value

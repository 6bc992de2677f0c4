"""The sensors of an actuator as an object with memory, read by the loop."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from hil_emulator.model.bound import bound
from hil_emulator.model.digits import NOT_FINITE, WORD_LENGTH
from hil_emulator.model.effects.history import HISTORY
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, fill, length
from hil_emulator.model.plant import NOT_FOLLOWED, Matrix, Memory, Supply
from hil_emulator.model.sensors import CHANNELS

NOTHING: Vector = np.empty(0)

_BLOCK = 256  # samples per block of normal random numbers


class Sensors:
    """The channels of one actuator.

    Args:
        kernel: the compiled model.
        parameters: transducer parameters by channel and field; effects without parameters are off.
        period: time between samples [s].
        random: source of the noise.

    Attributes:
        reading: reading of each channel, SI.
        overrange: -1 at the lower end of a channel's measuring range, +1 at the upper end, else 0.
        ranges: `overrange` of all channels as one number, 0 if no channel is at an end.
        count: number of the last sample, from 0.
        record: the last sample as bytes, see `lay_out`.

    """

    def __init__(
        self,
        kernel: Kernel,
        parameters: Mapping[str, Mapping[str, float]],
        period: float,
        random: np.random.Generator,
    ) -> None:
        self.names = tuple(c.name for c in CHANNELS)
        self._kernel = kernel
        self._period = period
        # a random stream per channel, so that another channel does not change their noise
        self._streams = random.spawn(len(CHANNELS))
        self.parameters = np.concatenate(
            [fill(kernel.channel, kernel.effects, parameters.get(n, {})) for n in self.names]
        )
        self._memory = np.full(len(CHANNELS) * length(kernel.memory), math.nan)
        self._past = np.full(len(CHANNELS) * length(kernel.channel_past), math.nan)
        self.reading = np.zeros(len(CHANNELS))
        self.overrange = np.zeros(len(CHANNELS), np.int64)
        self._normals = np.empty((_BLOCK, len(CHANNELS)))
        self._next = _BLOCK
        self.ranges: int = 0
        self.count = -1
        self._signals, self._path = NOTHING, NOT_FOLLOWED
        self._after: tuple[Sequence[Matrix], int, Callable[[int], int]] | None = None
        self.lay_out([], 0)

    def lay_out(self, words: Sequence[Sequence[float]], length: int) -> None:
        """Set the layout of the record from the next sample on.

        Args:
            words: layout, see `digits.pack`.
            length: number of bytes.

        """
        self.record = bytearray(length)
        self._words = np.array(words, np.float64).reshape(-1, WORD_LENGTH)
        self._bytes = np.frombuffer(self.record, np.uint8)
        self._after = None
        if len(self._signals):
            self._bind(self._signals, self._path)

    def restart(self) -> None:
        """Clear the memory of past samples."""
        self._memory[:] = math.nan
        self._past[:] = math.nan

    def sample(self, signals: Vector, path: Matrix = NOT_FOLLOWED, time_us: int = 0) -> None:
        """Fill `reading`, `overrange`, `ranges` and `record`.

        Args:
            signals: the model's signals, shape (signals,).
            path: quantities of the elements since the last sample, see `Plant.path`; without a
                path they are assumed to change linearly to their present values.
            time_us: time of the sample [us], which the record may show.

        """
        if signals is not self._signals or path is not self._path:
            self._bind(signals, path)
        self.again(time_us)

    def again(self, time_us: int) -> int:
        """Sample the signals and path of the last `sample`; return `ranges`."""
        row = self._next
        if row == _BLOCK:
            row = self._draw()
        self._next = row + 1
        self.count += 1
        self.ranges = self._sense(row, self.count, time_us)
        return self.ranges

    def after(self, supply: Supply, steps: int) -> Callable[[int], int]:
        """Return a function that integrates `steps` steps of a supply, and then samples as `again`.

        It returns `NOT_FINITE` without a sample if a state is not finite. It is valid for one
        layout of the record, until the supply is integrated by another number of steps.
        """
        # reused, because the fast path requests it after each heartbeat
        if self._after is None or self._after[0] is not supply.paths or self._after[1] != steps:
            made = self._passing(supply, steps)
            self._after = supply.paths, steps, made
        return self._after[2]

    def _passing(self, supply: Supply, steps: int) -> Callable[[int], int]:
        """Return the function of `after`."""
        both = supply.step_and_report(steps, self._instruments, self._period)
        if both is None:
            return lambda time_us: self.again(time_us) if supply.step(steps) else NOT_FINITE

        def pass_and_sample(time_us: int) -> int:
            row = self._next
            if row == _BLOCK:
                row = self._next = self._draw()
            ranges = both(row, self.count + 1, time_us)
            if ranges != NOT_FINITE:
                self._next = row + 1
                self.count += 1
                self.ranges = ranges
            return ranges

        return pass_and_sample

    @property
    def _instruments(self) -> tuple[Memory, ...]:
        return (
            self.parameters, self._memory, self._past, self._normals, self.reading, self.overrange,
            self._words, self._bytes,
        )  # fmt: skip

    def _draw(self) -> int:
        """Draw the normal numbers of the next samples; return the row of the first."""
        for channel, stream in enumerate(self._streams):
            self._normals[:, channel] = stream.standard_normal(_BLOCK)
        return 0

    def _bind(self, signals: Vector, path: Matrix) -> None:
        self._signals, self._path = signals, path
        self._sense = bound(
            self._kernel.report, self.parameters, self._memory, self._past, self._normals,
            self._period, self.reading, self.overrange, self._words, self._bytes, signals, path,
            left=(0, 0, 0),
        )  # fmt: skip


def longest_delay(period: float) -> float:
    """Return the longest time that delays and windows can look back [s] at a tick `period`."""
    return (HISTORY - 1) * period

"""Measuring devices: load cells, pressure transmitters (CiA 404)."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.profiles.analogue_input import FIELD_VALUE, SIGNATURES, AnalogueInput
from hil_emulator.errors import UserError

FUNCTION_BLOCKS = range(0x6110, 0x61B0)
"""Parameters and values of the analogue inputs (CiA 404)."""
MAX_INPUTS = 199
"""Sub-indices an object of CiA 404 may use."""


class MeasuringDevice:
    """The analogue inputs of one node.

    Args:
        dictionary: the node's dictionary; each sub-index of 0x6100 is an input.
        channels: names of the sensor channels, in the order of `Measured`.

    Attributes:
        sources: by (index, sub-index), what feeds the inputs' values.
        triggers: one for each input.

    Raises:
        UserError: an input has no process value or no physical unit.

    """

    def __init__(self, dictionary: Dictionary, channels: Sequence[str]) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self._inputs: dict[int, AnalogueInput] = {}
        self._wired: list[tuple[int, AnalogueInput]] = []
        for number in range(1, MAX_INPUTS):
            field = dictionary.get(FIELD_VALUE, number)
            if field is None:
                break
            self._inputs[number] = made = _input(dictionary, number)
            if field.signal in channels:
                self._wired.append((channels.index(field.signal), made))
                for entry in made.shown:
                    self.sources[entry.index, entry.subindex] = f"profile, from {field.signal}"
        self.triggers = [made.trigger for made in self._inputs.values()]
        for index in FUNCTION_BLOCKS:
            if index in dictionary:
                dictionary.watch(index, self)

    def reset(self) -> None:
        """Take over the parameters the dictionary has been reloaded with."""
        for made in self._inputs.values():
            made.reload()

    def written(self, entries: Sequence[Entry]) -> None:
        """Obey signatures and parameters that have come by RPDO; a wrong signature is ignored."""
        for entry in entries:
            if entry.value == SIGNATURES.get(entry.index, entry.value):
                self.changed(entry)
            else:
                entry.value = 0

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Let each input turn its field value into a process value."""
        for position, made in self._wired:
            value = measured.values[position]
            made.measure(measured.overrange[position], valid=math.isfinite(value))

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the commands: a measuring device gives none."""
        return commands

    def check(self, entry: Entry, value: Any) -> None:
        """Let the input refuse a value."""
        if entry.subindex in self._inputs:
            self._inputs[entry.subindex].check(entry, value)

    def changed(self, entry: Entry) -> None:
        """Let the input act on a new value."""
        if entry.subindex in self._inputs:
            self._inputs[entry.subindex].changed(entry)


def _input(dictionary: Dictionary, number: int) -> AnalogueInput:
    for index, what in ((0x6130, "process value"), (0x6131, "physical unit")):
        if dictionary.get(index, number) is None:
            raise UserError(
                f"{dictionary.source}: input {number} of 0x6100 has no {what}; "
                f"add [{index:04X}sub{number:X}] (CiA 404)"
            )
    return AnalogueInput(dictionary, number)

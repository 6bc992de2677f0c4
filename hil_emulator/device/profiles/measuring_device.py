"""Measuring devices: load cells, pressure transmitters (CiA 404)."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.profiles.analogue_input import (
    DECIMAL_DIGITS,
    FIELD_VALUE,
    NET_VALUES,
    PHYSICAL_UNIT,
    PROCESS_VALUES,
    SIGNATURES,
    AnalogueInput,
)
from hil_emulator.device.profiles.physical_unit import si_unit

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
        sources: source of the inputs' values by (index, sub-index).
        triggers: one for each input.

    """

    def __init__(self, dictionary: Dictionary, channels: Sequence[str]) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self._inputs: dict[int, AnalogueInput] = {}
        self._wired: list[tuple[int, AnalogueInput]] = []
        for number in range(1, MAX_INPUTS):
            field = dictionary.number(FIELD_VALUE, number)
            if field is None:
                break
            self._inputs[number] = made = AnalogueInput(dictionary, number)
            if field.signal in channels:
                self._wired.append((channels.index(field.signal), made))
                for entry in made.shown:
                    self.sources[entry.index, entry.subindex] = f"profile, from {field.signal}"
        self.triggers = [made.trigger for made in self._inputs.values()]
        for index in FUNCTION_BLOCKS:
            if index in dictionary:
                dictionary.watch(index, self)

    def reset(self) -> None:
        """Take over the parameters that were reloaded."""
        for made in self._inputs.values():
            made.reload()

    def written(self, entries: Sequence[Entry]) -> None:
        """Apply signatures and parameters received by RPDO; a wrong signature is ignored."""
        for entry in entries:
            if entry.value == SIGNATURES.get(entry.index, entry.value):
                self.changed(entry)
            else:
                entry.value = 0

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Convert the field value of each input to a process value."""
        for position, made in self._wired:
            value = measured.values[position]
            made.measure(measured.overrange[position], valid=math.isfinite(value))

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the commands unchanged; a measuring device has no set point."""
        return commands

    def check(self, entry: Entry, value: Any) -> None:
        """Check a value by the rules of its input."""
        if entry.subindex in self._inputs:
            self._inputs[entry.subindex].check(entry, value)

    def changed(self, entry: Entry) -> None:
        """Apply a new value in its input."""
        if entry.subindex in self._inputs:
            self._inputs[entry.subindex].changed(entry)


def complete(dictionary: Dictionary) -> bool:
    """Return whether there is an input, and each has a process value and a physical unit."""
    numbers = [e.subindex for e in dictionary if e.index == FIELD_VALUE and e.subindex]
    needed = (PROCESS_VALUES[0], PHYSICAL_UNIT)
    return bool(numbers) and all(dictionary.number(i, n) for i in needed for n in numbers)


def shown_directly(dictionary: Dictionary, channels: Sequence[str]) -> list[Entry]:
    """Return the process values that show a channel directly, without a field value."""
    values = (*PROCESS_VALUES, *NET_VALUES)
    return [e for e in dictionary if e.index in values and e.signal in channels]


def scale_by_unit(dictionary: Dictionary, shown: Sequence[Entry]) -> None:
    """Give process values the unit and the decimal digits that their objects state (CiA 404)."""
    for entry in shown:
        coded = dictionary.number(PHYSICAL_UNIT, entry.subindex)
        unit = None if coded is None else si_unit(int(coded.value))
        if unit is None or dictionary.scaled(entry):
            continue
        places = dictionary.number(DECIMAL_DIGITS, entry.subindex)
        whole = entry.type.kind == "integer" and places is not None
        entry.unit = unit[0]
        entry.factor = unit[1] * (10.0 ** -int(places.value) if whole and places else 1.0)

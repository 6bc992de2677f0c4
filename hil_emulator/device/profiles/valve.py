"""Valve drivers: device control, set point and its way to the coil current (CiA 408).

    set point -> conditioning -> ramp -> conditioning -> demand value -> command

The `Signal` of 0x6300:01 is the command, one digit of it `Factor` of the command's SI unit; the
`Signal` of 0x6301:01 is the channel that measures the spool. Without such a channel the valve is
driven open loop, and its actual value is the demand value.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.profiles.conditioning import Conditioning
from hil_emulator.device.profiles.deviation import DeviationMonitor
from hil_emulator.device.profiles.device_state import DeviceState, StateMachine
from hil_emulator.device.profiles.ramp import Ramp
from hil_emulator.device.profiles.record_value import VALUE
from hil_emulator.device.trigger import Trigger

CONTROL_WORD, STATUS_WORD = 0x6040, 0x6041
DEVICE_MODE = 0x6042
ERROR_CODE = 0x604E
SET_POINT, ACTUAL_VALUE = 0x6300, 0x6301
DEMAND_VALUE, REFERENCE_VALUE, HOLD_SET_POINT = 0x6310, 0x6311, 0x6314
PARAMETERS = range(0x6320, 0x6360)

REQUIRED = (
    (CONTROL_WORD, 0), (STATUS_WORD, 0), (DEVICE_MODE, 0), (ERROR_CODE, 0), (SET_POINT, VALUE),
    (ACTUAL_VALUE, VALUE), (DEMAND_VALUE, VALUE), (REFERENCE_VALUE, VALUE), (HOLD_SET_POINT, VALUE),
)  # fmt: skip
"""Objects that this profile requires, by index and sub-index."""

SET_POINT_BY_BUS = 1
"""Device mode that uses 0x6300; in other modes the hold set point applies."""
POSITION_MONITORING = 0x8301
"""Device error code and emergency: the spool does not follow (CiA 408)."""

NS_PER_S = 1e9


class ValveDriver:
    """The profile of a valve driver.

    Args:
        dictionary: the node's dictionary.
        channels: names of the sensor channels, in the order of `Measured`.
        emergency: reports a control deviation.

    Attributes:
        sources: source of status word and values by (index, sub-index).
        triggers: each change of the status word is an event, with and without an event timer.

    """

    def __init__(
        self, dictionary: Dictionary, channels: Sequence[str], emergency: Emergency
    ) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self._emergency = emergency
        self._machine = StateMachine()
        self._control = dictionary.entry(CONTROL_WORD)
        self._mode = dictionary.entry(DEVICE_MODE)
        self._set_point = dictionary.entry(SET_POINT, VALUE)
        self._hold = dictionary.entry(HOLD_SET_POINT, VALUE)
        self._status = self._fed(dictionary.entry(STATUS_WORD))
        self.triggers: Sequence[Trigger] = [Trigger(self._status, delta=1)]
        self._error = self._fed(dictionary.entry(ERROR_CODE))
        self._actual = self._fed(dictionary.entry(ACTUAL_VALUE, VALUE))
        self._demand = self._fed(dictionary.entry(DEMAND_VALUE, VALUE))
        self._reference = self._fed(dictionary.entry(REFERENCE_VALUE, VALUE))
        self._spool = _place(channels, self._actual.signal)
        self._conditioning = Conditioning(dictionary)
        self._ramp = Ramp(dictionary)
        self._monitor = DeviationMonitor(dictionary)
        self._last_ns = 0
        for index in PARAMETERS:
            if index in dictionary:
                dictionary.watch(index, self)

    def reset(self) -> None:
        """Begin in INIT with the parameters of the dictionary."""
        self._machine.reset()
        self._ramp.value = 0.0
        self._reload()

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Update the state, and convert the set point to the command."""
        elapsed, self._last_ns = (now_ns - self._last_ns) / NS_PER_S, now_ns
        self._machine.update(int(self._control.value), operational=operational)
        state = self._machine.state
        if self._machine.repaired:
            self._error.value = 0
            self._emergency.clear(POSITION_MONITORING)
        self._status.value = int(state)
        self._drive(state, elapsed)
        name = self._set_point.signal
        if name not in commands:
            return commands
        return {**commands, name: self._set_point.physical(self._demand.value)}

    def written(self, entries: Sequence[Entry]) -> None:
        """Do nothing; `command` reads control word and set point."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Show the spool's position, and enter a fault state if the spool does not follow."""
        if self._spool is None:
            self._actual.value = self._demand.value
        else:
            actual = measured.values[self._spool] - self._actual.offset
            self._actual.value = _int16(actual / self._actual.factor)
        deviation = self._demand.value - self._actual.value
        controlled = self._machine.state in (DeviceState.HOLD, DeviceState.ACTIVE)
        if self._monitor.exceeded(now_ns, deviation, controlled=controlled):
            self._machine.fail()
            self._status.value = int(self._machine.state)
            self._error.value = POSITION_MONITORING
            self._emergency.raise_error(POSITION_MONITORING, POSITION_MONITORING, ErrorBit.PROFILE)

    def check(self, entry: Entry, value: Any) -> None:
        """Accept any value within the limits of the EDS."""

    def changed(self, entry: Entry) -> None:
        """Apply a new parameter."""
        self._reload()

    def _drive(self, state: DeviceState, elapsed: float) -> None:
        """Set reference and demand value."""
        if state is DeviceState.ACTIVE and self._mode.value == SET_POINT_BY_BUS:
            target = self._conditioning.reference(self._set_point.value)
            reference = self._ramp.follow(target, elapsed)
            demand = self._conditioning.demand(reference)
        else:
            off = state in (DeviceState.INIT, DeviceState.DISABLED, DeviceState.FAULT_DISABLED)
            reference = demand = 0 if off else self._hold.value
            self._ramp.value = float(reference)  # from where ACTIVE begins
        self._reference.value = round(reference)
        self._demand.value = demand

    def _reload(self) -> None:
        for part in (self._conditioning, self._ramp, self._monitor):
            part.reload()

    def _fed(self, entry: Entry) -> Entry:
        self.sources[entry.index, entry.subindex] = "profile"
        return entry


def _place(channels: Sequence[str], name: str) -> int | None:
    return channels.index(name) if name in channels else None


def _int16(value: float) -> int:
    if -0x8000 <= value <= 0x7FFF:
        return round(value)
    return 0x7FFF if value > 0x7FFF else -0x8000  # NaN is shown as the lowest value

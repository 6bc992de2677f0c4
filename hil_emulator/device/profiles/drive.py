"""Drives: state machine, profile velocity, cyclic synchronous velocity and position (CiA 402-2).

Velocity has the unit of its objects, position that of velocity times seconds. If 0x606C or 0x6064
shows a channel, the value is measured; else the drive follows its demand exactly.
The `Signal` of 0x60FF may be a command: then the velocity demand, times its `Factor`, is given to
the plant, and 0 while operation is not enabled.
"""

from collections.abc import Mapping, Sequence

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.profiles.drive_state import HALT, DriveState, DriveStateMachine
from hil_emulator.device.trigger import Trigger

CONTROL_WORD, STATUS_WORD = (0x6040, 0), (0x6041, 0)
MODE, MODE_DISPLAY, SUPPORTED_MODES = 0x6060, 0x6061, 0x6502
CONNECTION_LOST, ERROR_CODE, QUICK_STOP_OPTION = 0x6007, 0x603F, 0x605A
TARGET_VELOCITY, VELOCITY_DEMAND, VELOCITY = 0x60FF, 0x606B, 0x606C
VELOCITY_WINDOW, ZERO_WINDOW = 0x606D, 0x606F
TARGET_POSITION, POSITION_DEMAND, POSITION = 0x607A, 0x6062, 0x6064
ACCELERATION, DECELERATION, QUICK_STOP_DECELERATION = 0x6083, 0x6084, 0x6085
REQUIRED = (CONTROL_WORD, STATUS_WORD)

PROFILE_VELOCITY, CYCLIC_POSITION, CYCLIC_VELOCITY = 3, 8, 9
MODES = frozenset({PROFILE_VELOCITY, CYCLIC_POSITION, CYCLIC_VELOCITY})
"""Supported values of 0x6060; with any other value 0x6061 keeps the previous mode."""
VOLTAGE_ENABLED, REMOTE, TARGET_REACHED, MODE_SPECIFIC = 0x0010, 0x0200, 0x0400, 0x1000
"""Bits of the status word; bit 12 is "speed is 0" in mode 3, "drive follows" in modes 8 and 9."""
LOST_FAULT, LOST_DISABLE, LOST_QUICK_STOP = 1, 2, 3
"""Values of 0x6007: reaction when OPERATIONAL is left with operation enabled."""
COMMUNICATION = 0x7500
"""Error code: communication (CiA 402-2)."""
STAYS_FROM = 5
"""Values of 0x605A from which on QUICK_STOP_ACTIVE is kept after a quick stop."""
NS_PER_S = 1e9


class Drive:
    """The profile of a drive.

    Args:
        dictionary: the node's dictionary.
        channels: names of the sensor channels.
        emergency: reports faults.

    Attributes:
        sources: objects that the profile feeds, by (index, sub-index).
        triggers: each change of the status word is an event.

    """

    def __init__(
        self, dictionary: Dictionary, channels: Sequence[str], emergency: Emergency
    ) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self._dictionary = dictionary
        self._emergency = emergency
        self._machine = DriveStateMachine()
        self._control = dictionary.entry(*CONTROL_WORD)
        self._status = dictionary.entry(*STATUS_WORD)
        self._target_velocity = dictionary.number(TARGET_VELOCITY)
        self._target_position = dictionary.number(TARGET_POSITION)
        self._velocity, self._position = (dictionary.number(n) for n in (VELOCITY, POSITION))
        measured = {e for e in (self._velocity, self._position) if e and e.signal in channels}
        fed = (STATUS_WORD[0], MODE_DISPLAY, ERROR_CODE, VELOCITY_DEMAND, VELOCITY,
               POSITION_DEMAND, POSITION)  # fmt: skip
        for index in fed:
            entry = dictionary.number(index)
            if entry is not None and entry not in measured:
                self.sources[index, 0] = "profile"
        self.triggers: Sequence[Trigger] = [Trigger(self._status, delta=1)]
        self._last_ns = 0
        self._was_operational = False
        self.reset()

    def reset(self) -> None:
        """Begin with the self-test, at rest."""
        self._machine.reset()
        self._demand = 0.0
        self._mode = 0
        self._place = 0.0 if self._position is None else float(self._position.value)

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Follow control word and targets; return the command with the velocity demand."""
        elapsed, self._last_ns = (now_ns - self._last_ns) / NS_PER_S, now_ns
        machine = self._machine
        if self._was_operational and not operational:
            self._connection_lost()
        self._was_operational = operational
        stays = self._number(QUICK_STOP_OPTION, 2) >= STAYS_FROM
        machine.update(int(self._control.value), stopped=self._demand == 0.0, stays=stays)
        if machine.repaired:
            self._show(ERROR_CODE, 0)
            self._emergency.clear(COMMUNICATION)
        if self._number(MODE, PROFILE_VELOCITY) in MODES:
            self._mode = int(self._number(MODE, PROFILE_VELOCITY))
        self._show(MODE_DISPLAY, self._mode)
        self._move(elapsed)
        self._status.value = self._status_word()
        target = self._target_velocity
        if target is None or target.signal not in commands:
            return commands
        return {**commands, target.signal: target.physical(self._demand)}

    def written(self, entries: Sequence[Entry]) -> None:
        """Do nothing; `command` reads control word and targets."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Do nothing; channels are shown unchanged."""

    def _move(self, elapsed: float) -> None:
        """Update the velocity demand and the values derived from it."""
        state = self._machine.state
        before = self._place
        if state is DriveState.OPERATION_ENABLED:
            self._follow(elapsed)
        elif state in (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE):
            self._ramp(0.0, self._number(QUICK_STOP_DECELERATION, 0.0), elapsed)
        else:
            self._demand = 0.0
        if self._place == before:
            self._place += self._demand * elapsed
        self._show(VELOCITY_DEMAND, self._demand)
        self._show(VELOCITY, self._demand)
        self._show(POSITION_DEMAND, self._place)
        self._show(POSITION, self._place)

    def _follow(self, elapsed: float) -> None:
        velocity = 0.0 if self._target_velocity is None else float(self._target_velocity.value)
        if self._mode == CYCLIC_POSITION and self._target_position is not None:
            target = float(self._target_position.value)
            self._demand = (target - self._place) / elapsed if elapsed else 0.0
            self._place = target
        elif self._mode == CYCLIC_VELOCITY:
            self._demand = velocity
        elif self._mode == PROFILE_VELOCITY:
            target = 0.0 if self._control.value & HALT else velocity
            faster = abs(target) > abs(self._demand) and target * self._demand >= 0.0
            rate = self._number(ACCELERATION if faster else DECELERATION, 0.0)
            self._ramp(target, rate, elapsed)

    def _ramp(self, target: float, rate: float, elapsed: float) -> None:
        """Move the demand towards a target; a rate of 0 is no limit."""
        step = rate * elapsed
        change = target - self._demand
        if not rate or abs(change) <= step:
            self._demand = target
        else:
            self._demand += step if change > 0 else -step

    def _connection_lost(self) -> None:
        """Apply 0x6007 when OPERATIONAL is left."""
        if self._machine.state is not DriveState.OPERATION_ENABLED:
            return
        option = self._number(CONNECTION_LOST, 0)
        if option == LOST_FAULT:
            self._machine.fail()
            self._show(ERROR_CODE, COMMUNICATION)
            self._emergency.raise_error(COMMUNICATION, COMMUNICATION, ErrorBit.PROFILE)
        elif option == LOST_DISABLE:
            self._machine.state = DriveState.SWITCH_ON_DISABLED
        elif option == LOST_QUICK_STOP:
            self._machine.state = DriveState.QUICK_STOP_ACTIVE

    def _status_word(self) -> int:
        state = self._machine.state
        word = int(state) | VOLTAGE_ENABLED | REMOTE
        if state is not DriveState.OPERATION_ENABLED:
            return word
        velocity = self._demand if self._velocity is None else float(self._velocity.value)
        if self._mode in (CYCLIC_POSITION, CYCLIC_VELOCITY):
            return word | MODE_SPECIFIC
        if self._mode == PROFILE_VELOCITY:
            target = 0.0 if self._target_velocity is None else float(self._target_velocity.value)
            if abs(velocity - target) <= self._number(VELOCITY_WINDOW, 0.0):
                word |= TARGET_REACHED
            if abs(velocity) <= self._number(ZERO_WINDOW, 0.0):
                word |= MODE_SPECIFIC
        return word

    def _number(self, index: int, missing: float) -> float:
        entry = self._dictionary.number(index)
        return missing if entry is None else float(entry.value)

    def _show(self, index: int, value: float) -> None:
        """Write a value to an object that the profile feeds, saturated to its type."""
        if (index, 0) in self.sources:
            entry = self._dictionary.entry(index)
            shown = min(max(value, entry.type.low), entry.type.high)
            entry.value = shown if entry.type.kind == "real" else round(shown)

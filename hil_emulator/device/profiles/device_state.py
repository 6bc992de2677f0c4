"""The device control state machine of a valve (CiA 408, objects 0x6040 and 0x6041).

| state | R M H D | output |
|---|---|---|
| INIT | 1 0 0 0 | power stage off |
| DISABLED | 1 0 0 1 | power stage off |
| HOLD | 1 0 1 1 | hold set point |
| ACTIVE | 1 1 1 1 | set point |
| FAULT_DISABLED | 0 0 0 1 | power stage off |
| FAULT_HOLD | 0 0 1 1 | hold set point |

The control word requests a state with its bits D, H, M; the machine makes one transition per tick.
So the words 0x08, 0x09, 0x0B, 0x0F activate the valve, and 0x0F alone does, too. A rising bit R
resets a fault. ACTIVE also needs NMT OPERATIONAL; without it, the machine returns to HOLD.
"""

from enum import IntEnum

DISABLED_BIT, HOLD_BIT, ACTIVE_BIT, READY_BIT = 0x01, 0x02, 0x04, 0x08


class DeviceState(IntEnum):
    """States, with the status word's bits R, M, H, D."""

    INIT = 0x8
    DISABLED = 0x9
    HOLD = 0xB
    ACTIVE = 0xF
    FAULT_DISABLED = 0x1
    FAULT_HOLD = 0x3


_LADDER = (DeviceState.INIT, DeviceState.DISABLED, DeviceState.HOLD, DeviceState.ACTIVE)
_FAULT = {DeviceState.HOLD: DeviceState.FAULT_HOLD, DeviceState.ACTIVE: DeviceState.FAULT_HOLD}
_REPAIRED = {
    DeviceState.FAULT_HOLD: DeviceState.HOLD,
    DeviceState.FAULT_DISABLED: DeviceState.DISABLED,
}


class StateMachine:
    """The state machine of a valve.

    Attributes:
        state: the state.
        repaired: whether the last `update` has reset a fault.

    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin in INIT."""
        self.state = DeviceState.INIT
        self.repaired = False
        self._control = 0

    def update(self, control: int, *, operational: bool) -> None:
        """Make one transition towards the state that the control word requests.

        Args:
            control: the control word.
            operational: whether the node is in NMT OPERATIONAL.

        """
        rising = control & ~self._control
        self._control = control
        self.repaired = False
        if self.state in _LADDER:
            here, wanted = _LADDER.index(self.state), _wanted(control, operational=operational)
            self.state = _LADDER[here + (wanted > here) - (wanted < here)]
        elif rising & READY_BIT:
            self.repaired = True
            self.state = _REPAIRED[self.state]
        elif self.state is DeviceState.FAULT_HOLD and not control & HOLD_BIT:
            self.state = DeviceState.FAULT_DISABLED

    def fail(self) -> None:
        """Enter the fault state of the present state."""
        if self.state in _LADDER:
            self.state = _FAULT.get(self.state, DeviceState.FAULT_DISABLED)


def _wanted(control: int, *, operational: bool) -> int:
    """Return the requested state's rank; each bit also needs the bits of the lower states."""
    if not control & DISABLED_BIT:
        return 0
    if not control & HOLD_BIT:
        return 1
    return 3 if control & ACTIVE_BIT and operational else 2

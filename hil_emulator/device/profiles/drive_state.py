"""The power drive state machine (CiA 402-2, objects 0x6040 and 0x6041).

| state | status word, masked by 0x6F |
|---|---|
| NOT_READY | 0x00 |
| SWITCH_ON_DISABLED | 0x40 |
| READY_TO_SWITCH_ON | 0x21 |
| SWITCHED_ON | 0x23 |
| OPERATION_ENABLED | 0x27 |
| QUICK_STOP_ACTIVE | 0x07 |
| FAULT_REACTION_ACTIVE | 0x0F |
| FAULT | 0x08 |

Bits 0 to 3 of the control word are a command; a rising bit 7 resets a fault. One transition is made
per tick, so that 0x0F alone leads from READY_TO_SWITCH_ON to OPERATION_ENABLED.
"""

from enum import IntEnum

ENABLE_VOLTAGE, QUICK_STOP = 0x02, 0x04
COMMAND_MASK, FAULT_RESET, HALT = 0x0F, 0x80, 0x100
SHUTDOWN, SWITCH_ON, ENABLE_OPERATION = 0x06, 0x07, 0x0F
_SHUTDOWN_MASK = 0x07


class DriveState(IntEnum):
    """States, with their status word."""

    NOT_READY = 0x00
    FAULT = 0x08
    FAULT_REACTION_ACTIVE = 0x0F
    QUICK_STOP_ACTIVE = 0x07
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    SWITCH_ON_DISABLED = 0x40


_POWERED = (DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)


class DriveStateMachine:
    """The state machine of a drive.

    Attributes:
        state: the state.
        repaired: whether the last `update` has reset a fault.

    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin with the self-test."""
        self.state = DriveState.NOT_READY
        self.repaired = False
        self._control = 0

    def update(self, control: int, *, stopped: bool, stays: bool) -> None:
        """Make the transition that is due, if any.

        Args:
            control: the control word.
            stopped: whether the drive stands still, which ends a quick stop and a fault reaction.
            stays: whether QUICK_STOP_ACTIVE is kept at standstill (0x605A from 5 on).

        """
        rising = control & ~self._control
        self._control = control
        self.repaired = False
        state = self.state
        if state is DriveState.NOT_READY:
            self.state = DriveState.SWITCH_ON_DISABLED
        elif state is DriveState.FAULT_REACTION_ACTIVE:
            self.state = DriveState.FAULT if stopped else state
        elif state is DriveState.FAULT:
            if rising & FAULT_RESET:
                self.repaired = True
                self.state = DriveState.SWITCH_ON_DISABLED
        elif not control & ENABLE_VOLTAGE:
            self.state = DriveState.SWITCH_ON_DISABLED
        elif state is DriveState.QUICK_STOP_ACTIVE:
            self._after_quick_stop(control, stopped=stopped, stays=stays)
        elif not control & QUICK_STOP:
            quick = state is DriveState.OPERATION_ENABLED
            self.state = DriveState.QUICK_STOP_ACTIVE if quick else DriveState.SWITCH_ON_DISABLED
        else:
            self._climb(control)

    def fail(self) -> None:
        """Begin the reaction to a fault."""
        if self.state not in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE):
            self.state = DriveState.FAULT_REACTION_ACTIVE

    def _after_quick_stop(self, control: int, *, stopped: bool, stays: bool) -> None:
        if stays and control & COMMAND_MASK == ENABLE_OPERATION:
            self.state = DriveState.OPERATION_ENABLED
        elif stopped and not stays:
            self.state = DriveState.SWITCH_ON_DISABLED

    def _climb(self, control: int) -> None:
        """Make one transition towards the state that the command requests."""
        if control & _SHUTDOWN_MASK == SHUTDOWN:
            self.state = DriveState.READY_TO_SWITCH_ON
        elif self.state in _POWERED:
            wanted = 2 if control & COMMAND_MASK == ENABLE_OPERATION else 1
            here = _POWERED.index(self.state)
            self.state = _POWERED[here + (wanted > here) - (wanted < here)]

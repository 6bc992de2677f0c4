"""Electrical faults of the current through the valve's coil."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from hil_emulator.device.emergency import ErrorBit
from hil_emulator.faults.declare import EmergencyCode, FaultKind, FaultParam, Layer
from hil_emulator.faults.strength import Change

SHORT_CIRCUIT = 0x2320
"""Emergency error code: current at the device's output (CiA 301 table 26, class 23xx)."""


@dataclass(frozen=True)
class CoilFaultKind(FaultKind):
    """A kind of fault of the coil or of its driver."""

    layer = Layer.ELECTRICAL
    begin: Callable[..., Change]


def coil_fault(
    *params: FaultParam, emergency: EmergencyCode | None = None
) -> Callable[[Callable[..., Change]], CoilFaultKind]:
    """Declare the decorated function as a fault of the coil."""

    def declare(begin: Callable[..., Change]) -> CoilFaultKind:
        return CoilFaultKind(begin, ("coil",), params, emergency=emergency)

    return declare


@coil_fault()
def open_() -> Change:
    """A broken wire: no current."""
    return lambda current, s: current * (1.0 - s)


@coil_fault(emergency=EmergencyCode(SHORT_CIRCUIT, ErrorBit.CURRENT))
def short() -> Change:
    """A short circuit: the driver switches off and reports EMCY 0x2320."""
    return lambda current, s: current * (1.0 - s)


@coil_fault(FaultParam("limit", "A", "largest current of the driver", 1e-3, 0.0, 1.0, "mA"))
def current_limited(limit: float) -> Change:
    """A weak driver."""

    def limited(current: float, s: float) -> float:
        left = limit / s if s else math.inf
        return max(-left, min(left, current))

    return limited


KINDS = (open_, short, current_limited)

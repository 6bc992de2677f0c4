"""Check whether a rig has the target of a fault."""

from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.faults.active import Faults
from hil_emulator.faults.fault import Fault
from hil_emulator.faults.frames import BusFaultKind
from hil_emulator.faults.objects import ObjectFaultKind
from hil_emulator.faults.plant import PlantFaultKind


def ensure_possible(
    chosen: Fault, faults: Faults, nodes: tuple[Node, ...], takes_time: bool
) -> None:  # fmt: skip
    """Refuse a fault whose target the rig lacks.

    Args:
        chosen: the fault.
        faults: of the rig.
        nodes: of the rig.
        takes_time: whether frames take time on its bus.

    Raises:
        UserError: for a missing node, timed bus, parameter or object.

    """
    ids = [node.node_id for node in nodes]
    if chosen.node is not None and chosen.node not in ids:
        present = ", ".join(map(str, ids))
        raise UserError(f"fault {chosen.target}: no node {chosen.node}; there are {present}")
    if isinstance(chosen.kind, BusFaultKind) and chosen.kind.needs_time and not takes_time:
        raise UserError(
            f"fault {chosen.kind.name}: this bus takes no time; give it "
            '[bus] timing = "modelled" and bit_rate = "500 kbit/s"'
        )
    if isinstance(chosen.kind, PlantFaultKind):
        faults.parameters.require(chosen.kind.parameter)
    if isinstance(chosen.kind, ObjectFaultKind) and not faults.targeted(chosen):
        raise UserError(f"fault {chosen.target}: no node has such an object that is a number")

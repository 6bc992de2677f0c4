"""What can be set during a run: conditions of the surroundings, and the set point itself."""

from hil_emulator.errors import UserError
from hil_emulator.units import to_si

SETTINGS = {"supply_pressure": "Pa", "external_force": "N", "valve_current": "A"}
"""Settings with their SI units. The valve current is written into the node's set point object, as
an SDO client does: it is in force while the node is OPERATIONAL, until the next RPDO."""


def setting(name: str, value: object) -> float:
    """Return the value of a setting in SI.

    Raises:
        UserError: for an unknown setting or a wrong unit.

    """
    if name not in SETTINGS:
        raise UserError(f"no setting '{name}'; there are {', '.join(SETTINGS)}")
    try:
        return to_si(value, SETTINGS[name])
    except ValueError as error:
        raise UserError(f"{name}: {error}") from None

"""Every parameter, state, input and signal that all actuators share."""

from hil_emulator.model.constants import REFERENCE_TEMPERATURE
from hil_emulator.model.declare import SETTING, Param, Quantity, factor, within

PARAMS: dict[str, tuple[Param, ...]] = {
    "supply": (
        Param("pressure", "Pa", "supply pressure, absolute", 160e5, 1e5, 700e5, "bar",
              source="public HyQ bench scripts"),
        Param("volume", "m^3", "volume of the pressure line at the pump", 1e-3, 1e-5, 1.0, "l",
              default=1e-3, spread=factor(3.0)),
        Param("pump_speed", "rad/s", "speed of the pump's shaft", 157.08, 1.0, 1000.0, "rpm",
              default=157.08, source="1500 rpm of a motor with four poles at 50 Hz, assumed",
              spread=factor(1.1)),
    ),
    "tank": (
        Param("pressure", "Pa", "return pressure, absolute", 1e5, 0.0, 50e5, "bar", default=1e5,
              source="public HyQ bench script: 1 bar", spread=factor(2.0)),
    ),
    "valve": (
        Param("gain", "m^3/(s*A*Pa^0.5)", "valve gain K_v (S1 eq. 3.8)", 6.68e-6, 1e-12, 1.0,
              source="7.5 l/min at 10 mA over 70 bar, the whole valve", tolerance=0.10),
        Param("natural_frequency", "Hz", "natural frequency of the spool", 250.0, 1.0, 1000.0,
              source="S1 3.3.1", tolerance=0.10),
        Param("damping_ratio", "1", "damping ratio of the spool", 0.7, 0.1, 3.0, default=0.7,
              source="0.5 to 0.9 in public HyQ scripts; 0.7 puts -3 dB at the natural frequency",
              spread=factor(1.35), tolerance=0.15),
        Param("critical_reynolds_number", "1", "Reynolds number at which an edge would pass as "
              "much by its laminar as by its turbulent flow; 0: turbulent at any", 14.7, 0.0,
              1000.0, default=14.7,
              source="sharp edge: creeping flow through a slit (Wuest 1954, in Merritt 1967) has "
                     "C_d² = (pi/128) Re, which is 0.6² there; a rounded or "
                     "worn edge has other ones, and a model by the root alone has 0",
              spread=factor(3.0), power=1.5),
        Param("slot_per_ampere", "m/A", "height of an edge's slot per ampere of spool travel",
              0.025, 1e-4, 1.0, default=0.025, source="0.25 mm at the rated current, assumed",
              spread=factor(2.0)),
        Param("laminar_width", "Pa", "least pressure difference below which the integration takes "
              "an edge for laminar, whatever its Reynolds number", 1e5, 1e3, 20e5, "bar",
              default=1e5, source="exact to 0.1 % at 20 us behind a wide edge", spread=SETTING,
              difference=True),
    ),
    "lines": (
        Param("closed", "1", "command to the shut-off valves: 0 open, 1 closed", 0.0, 0.0, 1.0,
              default=0.0, spread=SETTING),
        Param("block_volume", "m^3", "oil between the line and the holding valves of a chamber",
              1e-5, 1e-7, 1e-2, "ml", default=1e-5, spread=factor(2.0)),
        Param("passage_gain", "m^3/(s*Pa^0.5)", "flow through open holding valves over the root of "
              "their pressure drop", 1.5e-7, 1e-9, 1e-3, default=1.5e-7,
              source="7 bar at 7.5 l/min, assumed", spread=factor(2.0)),
        Param("laminar_width", "Pa", "an eighth of the drop at which their laminar and their "
              "turbulent loss are equal", 2e5, 1e3, 50e5, "bar", default=2e5, spread=factor(2.0),
              difference=True),
    ),
    "cylinder": (
        Param("piston_area", "m^2", "cap-side area A_p", 2.0106e-4, 1e-6, 4.0, "cm^2",
              source="bore 16 mm"),
        Param("area_ratio", "1", "annulus area over piston area (alpha)", 0.61, 0.05, 1.0,
              source="S1 3.4"),
        Param("stroke", "m", "stroke L_c", 0.08, 1e-3, 10.0, "mm",
              source="Hoerbiger LB6 1610 0080"),
        Param("dead_volume_a", "m^3", "volume of chamber a and its line at x = 0",
              3e-6, 1e-8, 1.0, "ml", tolerance=0.10),
        Param("dead_volume_b", "m^3", "volume of chamber b and its line at x = L_c",
              3e-6, 1e-8, 1e-1, "ml", tolerance=0.10),
    ),
    "oil": (
        Param("bulk_modulus", "Pa", "bulk modulus of the oil without free air", 1.3e9, 1e8, 3e9,
              "MPa", source="S1 3.1.1", tolerance=0.15),
        Param("density", "kg/m^3", "density", 850.0, 500.0, 1500.0, default=850.0, source="S1 3.1",
              spread=factor(1.05)),
        Param("kinematic_viscosity", "m^2/s", "kinematic viscosity at 40 °C", 46e-6, 1e-6, 1e-3,
              "mm^2/s", default=46e-6, source="ISO 3448: VG 46; VG 22 to 100 are usual",
              spread=factor(2.0)),
        Param("temperature", "K", "temperature of the oil; every parameter holds at 40 °C",
              REFERENCE_TEMPERATURE, 243.15, 393.15, "degC", default=REFERENCE_TEMPERATURE,
              source="S1 3.3.2: the cooler switches on at some 40 °C", spread=within(15.0)),
    ),
    "friction": (
        Param("transition_velocity", "m/s", "velocity that dry friction opposes as much as a bend "
              "of the seals by the presliding distance", 1e-3, 1e-5, 0.1, "mm/s", default=1e-3,
              spread=factor(3.0)),
        Param("presliding_distance", "m", "dry friction over the stiffness of the seals that hold "
              "a rod at rest", 2e-5, 1e-7, 10.0, "um", default=2e-5,
              source="assumed: 100 N over 5e6 N/m, of 1e5 to 1e7 N/m; pads of a friction damper "
                     "bend by millimetres", spread=factor(10.0)),
    ),
    "load": (
        Param("mass", "kg", "mass M_l moved by the rod", 50.0, 0.1, 1e5, source="S1 Fig. 3.14",
              tolerance=0.02),
        Param("coupling_damping", "s/m", "relative growth of the force between rod and load "
              "with the speed of their stretch", 1.0, 0.0, 20.0, default=1.0, spread=factor(2.0)),
    ),
    "initial": (
        Param("position", "m", "position at the start", 0.04, 0.0, 10.0, "mm", default=0.04,
              spread=SETTING),
    ),
}  # fmt: skip
"""Parameters that every actuator has, by configuration table."""

STATES = (
    Quantity("spool_position", "A", "spool position u_v as the current that holds it there"),
    Quantity("spool_speed", "A/s", "its rate of change"),
    Quantity("pressure_a", "Pa", "pressure in the cap-side chamber, continued below vapour"),
    Quantity("pressure_b", "Pa", "pressure in the rod-side chamber, continued below vapour"),
    Quantity("position", "m", "position of the rod"),
    Quantity("velocity", "m/s", "velocity of the rod"),
)

FRICTION_STATES = (Quantity("seal_bend", "1", "bend of the seals over the presliding distance"),)
"""Changes only with dry friction."""

SUPPLY_STATES = (Quantity("pump_pressure", "Pa", "pressure at the pump over the set pressure"),)
"""Changes only with a pump."""

HOLDING_STATES = (
    Quantity("block_excess_a", "Pa", "pressure before the holding valves over that of chamber a"),
    Quantity("block_excess_b", "Pa", "pressure before the holding valves over that of chamber b"),
)
"""Change only with load-holding valves."""

COUPLING_STATES = (
    Quantity("stretch", "m", "position of the rod over that of the load"),
    Quantity("stretch_speed", "m/s", "its rate of change"),
)
"""Change only with an elastic or loose part between rod and load."""

ALL_STATES = (
    *STATES, *FRICTION_STATES, *SUPPLY_STATES, *HOLDING_STATES, *COUPLING_STATES,
)  # fmt: skip
"""States of every actuator, without those of its effects."""

INPUTS = (
    Quantity("valve_current", "A", "set point of the coil current"),
    Quantity("external_force", "N", "further force against the load"),
    Quantity("transverse_force", "N", "force across the load cell, seen by its cross-talk alone"),
    Quantity("wall_shift", "m", "displacement of the wall from its distance"),
)

HELD = (
    *INPUTS,
    Quantity("late_current", "A", "set point that acts at the end of a tick"),
    Quantity("early_current", "A", "set point that acts from its begin on"),
    Quantity("arrival", "1", "steps of the tick after which the late one acts"),
    Quantity("temperature", "K", "temperature of the oil"),
    Quantity("viscosity", "1", "viscosity over that at the reference temperature"),
    Quantity("gas_pressure", "Pa", "pressure below which gas governs a chamber's stiffness"),
    Quantity("per_gas_pressure", "1/Pa", "one over that; 0 without gas"),
    Quantity("start_pressure_a", "Pa", "pressure of chamber a at the beginning of the call"),
    Quantity("start_pressure_b", "Pa", "the same of chamber b"),
    Quantity("per_start_pressure_a", "1/Pa", "one over it"),
    Quantity("per_start_pressure_b", "1/Pa", "the same of chamber b"),
    Quantity("gas_expansion_a", "1", "volume of gas over that at 1 atm, at this pressure"),
    Quantity("gas_expansion_b", "1", "the same of chamber b"),
    Quantity("gas_stride", "1", "factor on it where the pressure is higher by a stride"),
    Quantity("transition", "A*Pa^0.5", "opening times root of drop where an edge turns turbulent"),
)
"""Values that are constant during a call of the integrator."""

SIGNALS = (
    Quantity("spool_position", "A", "spool position u_v as the current that holds it there"),
    Quantity("spool_speed", "A/s", "rate of change of the spool position"),
    Quantity("pressure_a", "Pa", "pressure in the cap-side chamber"),
    Quantity("pressure_b", "Pa", "pressure in the rod-side chamber"),
    Quantity("position", "m", "position of the rod"),
    Quantity("velocity", "m/s", "velocity of the rod"),
    Quantity("valve_current", "A", "current that drives the spool"),
    Quantity("supply_pressure", "Pa", "pressure at the valve's port s"),
    Quantity("tank_pressure", "Pa", "pressure at the valve's port t"),
    Quantity("port_pressure_a", "Pa", "pressure at the valve's port a"),
    Quantity("port_pressure_b", "Pa", "pressure at the valve's port b"),
    Quantity("block_pressure_a", "Pa", "pressure before the holding valves of chamber a"),
    Quantity("block_pressure_b", "Pa", "pressure before the holding valves of chamber b"),
    Quantity("port_flow_a", "m^3/s", "flow out of the valve's port a"),
    Quantity("port_flow_b", "m^3/s", "flow into the valve's port b"),
    Quantity("flow_a", "m^3/s", "flow q_a into chamber a"),
    Quantity("flow_b", "m^3/s", "flow q_b out of chamber b"),
    Quantity("supply_flow", "m^3/s", "flow into the valve's port s"),
    Quantity(
        "tank_flow",
        "m^3/s",
        "flow into the return line, from the valve's port t and through "
        "relief valves at the chambers",
    ),
    Quantity("leakage_flow", "m^3/s", "flow past the piston from a to b"),
    Quantity("cross_relief_flow", "m^3/s", "flow through relief valves from a to b"),
    Quantity("port_relief_flow", "m^3/s", "flow through valves from both chambers to the tank"),
    Quantity("bulk_modulus_a", "Pa", "effective bulk modulus in chamber a"),
    Quantity("bulk_modulus_b", "Pa", "effective bulk modulus in chamber b"),
    Quantity("volume_a", "m^3", "volume of chamber a"),
    Quantity("volume_b", "m^3", "volume of chamber b"),
    Quantity("cushion_pressure_a", "Pa", "pressure at the end of chamber a, cushioned or not"),
    Quantity("cushion_pressure_b", "Pa", "pressure at the end of chamber b, cushioned or not"),
    Quantity("pressure_rate_a", "Pa/s", "rate of change of pressure a"),
    Quantity("pressure_rate_b", "Pa/s", "rate of change of pressure b"),
    Quantity("acceleration", "m/s^2", "acceleration of the rod"),
    Quantity("hydraulic_force", "N", "f_h = A_p (p_a - alpha p_b)"),
    Quantity("friction_force", "N", "f_f, against the motion"),
    Quantity("stop_force", "N", "force of the cylinder's ends on the rod"),
    Quantity("load_force", "N", "force f between rod and load"),
    Quantity("resisting_force", "N", "force of the surroundings against the load"),
    Quantity("valve_loss", "W", "power turned into heat in the valve"),
    Quantity("leakage_loss", "W", "power turned into heat by the cylinder's leakage"),
    Quantity("relief_loss", "W", "power turned into heat by valves at the cylinder"),
    Quantity("line_loss", "W", "power that lines and holding valves take and do not give on"),
    Quantity("load_position", "m", "position of the load"),
    Quantity("load_velocity", "m/s", "velocity of the load"),
    Quantity("load_acceleration", "m/s^2", "acceleration of the load"),
    Quantity("transverse_force", "N", "force across the load cell"),
    Quantity("outward_flow", "m^3/s", "leakage out of both chambers"),
    Quantity("pilot_flow", "m^3/s", "flow from s to t past the metering edges"),
    Quantity("pump_pressure", "Pa", "pressure at the pump"),
    Quantity("pump_flow", "m^3/s", "flow that the pump displaces"),
    Quantity("pump_leakage_flow", "m^3/s", "leakage inside the pump"),
    Quantity("relief_flow", "m^3/s", "flow through the relief valve"),
    Quantity("return_flow", "m^3/s", "flow back to the reservoir, from valve, relief and pump"),
    Quantity("pump_power", "W", "power that displacing the pump's flow takes"),
    Quantity("pump_friction_loss", "W", "power turned into heat by the pump's friction"),
    Quantity("shaft_power", "W", "power that the pump's shaft takes"),
    Quantity("shaft_torque", "N*m", "torque at the pump's shaft"),
    Quantity("supply_power", "W", "power that enters the valve: P = q p (S1 eq. 3.2)"),
    Quantity("load_power", "W", "power that the rod gives to the load"),
    Quantity("friction_loss", "W", "power turned into heat by friction"),
    Quantity("efficiency", "1", "load power over shaft power while both are positive, else 0"),
    Quantity("viscosity", "m^2/s", "kinematic viscosity of the oil"),
    Quantity("oil_temperature", "K", "temperature of the oil"),
    Quantity("rod_mass", "kg", "mass that moves ahead of the load cell"),
    Quantity("gas_pressure", "Pa", "pressure below which gas governs a chamber's stiffness"),
)

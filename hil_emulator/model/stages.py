"""The stages at which effects compose, in the order of the balances."""

from hil_emulator.model.declare import Acts, Stage

SPOOL = "spool"
FLOW_A = "flow into chamber a"
FLOW_B = "flow out of chamber b"
FLOWS = (FLOW_A, FLOW_B)
LEAKAGE = "leakage from a to b"
NULL_FLOW = "flow from s to t"
PISTON = "force on the piston"
LOAD = "force on the load"
RETURN = "return pressure"
SUPPLY = "supply pressure"
"""Names of the balances, of the position of the spool, of flows, forces and pressures."""

# once per tick
set_point = Stage(
    "set_point", "valve", ("set_point", "period"), "set point that is on its way to the driver",
    "A", "chain", balances=(SPOOL,),
)  # fmt: skip
late_set_point = Stage(
    "late_set_point", "valve", ("set_point", "period"), "set point that acts when the tick ends",
    "A", "chain", balances=(SPOOL,),
)  # fmt: skip
early_set_point = Stage(
    "early_set_point", "valve", ("set_point", "period"), "set point that acts until it arrives",
    "A", "chain", balances=(SPOOL,),
)  # fmt: skip
arrival = Stage(
    "arrival", "valve", ("period",), "when it reaches the driver, from the tick's begin on", "s",
    "sum", balances=(SPOOL,),
)  # fmt: skip
# once per call of the integrator
temperature = Stage(
    "temperature", "oil", ("temperature",), "temperature of the oil", "K", "chain", balances=(),
)  # fmt: skip
viscosity = Stage(
    "viscosity", "oil", ("viscosity", "temperature"),
    "viscosity over that at the reference temperature", "1", "chain", balances=(),
)  # fmt: skip
gas_pressure = Stage(
    "gas_pressure", "oil", (), "pressure below which gas makes a chamber softer than oil does",
    "Pa", "sum", balances=FLOWS,
)  # fmt: skip
gas_expansion = Stage(
    "gas_expansion", "oil", ("pressure",), "volume of a chamber's gas over that at 1 atm", "1",
    "sum", repeated=True, balances=FLOWS,
)  # fmt: skip
gas_expansion_acts = Acts(gas_expansion)

# supply and tank
supply = Stage(
    "supply", "supply", ("pump_pressure",), "pressure at the valve's port s", "Pa", "chain",
    balances=(SUPPLY,),
)  # fmt: skip
tank = Stage(
    "tank", "tank", ("port_pressure",), "pressure at the valve's port t", "Pa", "chain",
    balances=(*FLOWS, RETURN),
)  # fmt: skip
pilot_flow = Stage(
    "pilot_flow", "supply", ("port_s", "port_t"), "flow from s to t outside the edges", "m^3/s",
    "sum", balances=(NULL_FLOW,),
)  # fmt: skip
line_flow = Stage(
    "line_flow", "supply", ("drawn",), "flow out of the pump's node", "m^3/s", "chain",
    balances=(SUPPLY,),
)  # fmt: skip
line_rates = Stage(
    "line_rates", "supply", ("pump_pressure", "drawn", "viscosity"), "rates of the supply line", "",
    "rates", balances=(SUPPLY,),
)  # fmt: skip
source = Stage(
    "source", "supply", ("pump_pressure",), "flow that pumps displace", "m^3/s", "sum",
    balances=(SUPPLY,),
)  # fmt: skip
source_acts = Acts(source)
relief = Stage(
    "relief", "supply", ("pump_pressure",), "flow of relief valves", "m^3/s", "sum",
    balances=(SUPPLY,),
)  # fmt: skip
pump_loss = Stage(
    "pump_loss", "supply", ("pump_pressure", "viscosity"), "leakage of pumps", "m^3/s", "sum",
    balances=(SUPPLY,),
)  # fmt: skip
full_flow = Stage(
    "full_flow", "supply", (), "flow that pumps displace at full stroke", "m^3/s", "sum",
    balances=(),
)  # fmt: skip
pump_drag = Stage(
    "pump_drag", "supply", ("pump_pressure", "full_flow", "viscosity"),
    "power that friction takes in pumps", "W", "sum", balances=(),
)  # fmt: skip
capacity = Stage(
    "capacity", "supply", ("pump_pressure",), "capacity of accumulators", "m^3/Pa", "sum",
    balances=(SUPPLY,),
)  # fmt: skip
return_rates = Stage(
    "return_rates", "tank", ("returned",), "rates of the return line", "", "rates",
    balances=(RETURN,),
)  # fmt: skip

# driver of the valve
driver = Stage(
    "driver", "driver", ("current", "spool_position"), "current that the driver commands", "A",
    "chain", balances=(SPOOL,),
)  # fmt: skip

# valve
command = Stage(
    "command", "valve", ("current", "port_s"), "current that drives the spool", "A", "chain",
    balances=(SPOOL,),
)  # fmt: skip
pilot = Stage(
    "pilot", "valve", ("bandwidth_factor", "port_s"), "relative speed of the spool", "1", "chain",
    balances=(SPOOL,),
)  # fmt: skip
spool_force = Stage(
    "spool_force", "valve", ("deviation", "spool_position", "valve_drop"),
    "driving force of the spool, as a deviation of current", "A", "chain", balances=(SPOOL,),
)  # fmt: skip
spool = Stage(
    "spool", "valve", ("spool_speed", "bandwidth_factor"), "speed of the spool", "A/s", "chain",
    balances=(SPOOL,),
)  # fmt: skip
spool_reach = Stage(
    "spool_reach", "valve", ("spool_position",), "position that the housing leaves the spool", "A",
    "chain", repeated=True, balances=(SPOOL,),
)  # fmt: skip
travel = Stage(
    "travel", "valve", ("travel", "spool_speed"), "spool travel that the edges see", "A", "chain",
    balances=(SPOOL,),
)  # fmt: skip
edge_sa = Stage(
    "edge_sa", "valve", ("opening",), "travel of the edge P-A past its port", "A", "chain",
    balances=(SPOOL, FLOW_A),
)  # fmt: skip
edge_at = Stage(
    "edge_at", "valve", ("opening",), "travel of the edge A-T past its port", "A", "chain",
    balances=(SPOOL, FLOW_A),
)  # fmt: skip
edge_sb = Stage(
    "edge_sb", "valve", ("opening",), "travel of the edge P-B past its port", "A", "chain",
    balances=(SPOOL, FLOW_B),
)  # fmt: skip
edge_bt = Stage(
    "edge_bt", "valve", ("opening",), "travel of the edge B-T past its port", "A", "chain",
    balances=(SPOOL, FLOW_B),
)  # fmt: skip
edge_sa_acts, edge_at_acts = Acts(edge_sa), Acts(edge_at)
edge_sb_acts, edge_bt_acts = Acts(edge_sb), Acts(edge_bt)
metering = Stage(
    "metering", "valve", ("opening", "travel"), "opening of one metering edge", "A", "chain",
    repeated=True, balances=(SPOOL, *FLOWS, NULL_FLOW),
)  # fmt: skip
edge_law = Stage(
    "edge_law", "valve", ("flow", "turbulence"), "flow through one metering edge", "m^3/s",
    "chain", repeated=True, balances=(*FLOWS, NULL_FLOW),
)  # fmt: skip
edge_law_acts = Acts(edge_law)

kept_drop = Stage(
    "kept_drop", "lines", ("drop",), "pressure difference over an edge from the supply", "Pa",
    "chain", repeated=True, balances=FLOWS,
)  # fmt: skip

# between valve and cylinder
line_a = Stage(
    "line_a", "lines", ("pressure", "chamber"), "pressure at port a of the valve", "Pa", "chain",
    balances=(FLOW_A,),
)  # fmt: skip
line_b = Stage(
    "line_b", "lines", ("pressure", "chamber"), "pressure at port b of the valve", "Pa", "chain",
    balances=(FLOW_B,),
)  # fmt: skip
line_flow_a = Stage(
    "line_flow_a", "lines", ("drawn",), "flow that the line to chamber a delivers", "m^3/s",
    "chain", balances=(FLOW_A,),
)  # fmt: skip
line_flow_b = Stage(
    "line_flow_b", "lines", ("drawn",), "flow that the line from chamber b takes", "m^3/s",
    "chain", balances=(FLOW_B,),
)  # fmt: skip
cylinder_line_rates = Stage(
    "cylinder_line_rates", "lines",
    ("port_a", "port_b", "block_a", "block_b", "port_flow_a", "port_flow_b", "chamber_a",
     "chamber_b", "chamber_rate_a", "chamber_rate_b", "viscosity"),
    "rates of the lines between valve and cylinder", "", "rates", balances=FLOWS,
)  # fmt: skip
holding = Stage(
    "holding", "lines", ("opening", "side"), "opening of the valves that hold a chamber's load: "
    "0 closed, 1 open; side 1 for a, -1 for b", "1", "chain", repeated=True, balances=FLOWS,
)  # fmt: skip
holding_acts = Acts(holding)
holding_rates = Stage(
    "holding_rates", "lines", ("block_a", "block_b", "pressure_a", "pressure_b"),
    "rates of the load-holding valves", "", "rates", balances=FLOWS,
)  # fmt: skip
cross_relief = Stage(
    "cross_relief", "lines", ("pressure_a", "pressure_b"), "flow through relief valves from a to b",
    "m^3/s", "sum", balances=(LEAKAGE,),
)  # fmt: skip
port_relief = Stage(
    "port_relief", "lines", ("pressure", "tank_pressure"),
    "flow through valves from one chamber to the return line", "m^3/s", "sum", repeated=True,
    balances=FLOWS,
)  # fmt: skip

# chambers
vapour = Stage(
    "vapour", "oil", ("pressure", "continued"), "pressure in a chamber", "Pa", "chain",
    repeated=True, balances=FLOWS,
)  # fmt: skip
oil = Stage(
    "oil", "oil",
    ("bulk_modulus", "pressure", "volume", "temperature", "change", "expansion"),
    "effective bulk modulus in a chamber", "Pa", "chain", repeated=True, balances=FLOWS,
)  # fmt: skip
heat = Stage(
    "heat", "oil", ("loss",), "rates of the oil's temperature", "", "rates", balances=(),
)  # fmt: skip
cross_leakage = Stage(
    "cross_leakage", "cylinder", ("pressure_a", "pressure_b", "viscosity"),
    "flow from chamber a to b", "m^3/s", "sum", balances=(LEAKAGE,),
)  # fmt: skip
outward_leakage = Stage(
    "outward_leakage", "cylinder", ("pressure", "viscosity"), "flow from one chamber outwards",
    "m^3/s", "sum", repeated=True, balances=FLOWS,
)  # fmt: skip

port_area = Stage(
    "port_area", "cylinder", ("area", "left"), "area of the piston that a chamber's port reaches, "
    "over the way left to its end", "m^2", "chain", repeated=True, balances=FLOWS,
)  # fmt: skip
cushion_a = Stage(
    "cushion_a", "cylinder", ("pressure",), "pressure at the end of chamber a", "Pa", "chain",
    balances=(PISTON,),
)  # fmt: skip
cushion_b = Stage(
    "cushion_b", "cylinder", ("pressure",), "pressure at the end of chamber b", "Pa", "chain",
    balances=(PISTON,),
)  # fmt: skip
cushion_flow_a = Stage(
    "cushion_flow_a", "cylinder", ("left", "viscosity"), "flow from the end of chamber a to its "
    "port", "m^3/s", "sum", balances=(FLOW_A,),
)  # fmt: skip
cushion_flow_b = Stage(
    "cushion_flow_b", "cylinder", ("left", "viscosity"), "flow from the end of chamber b to its "
    "port", "m^3/s", "sum", balances=(FLOW_B,),
)  # fmt: skip
cushion_rates = Stage(
    "cushion_rates", "cylinder",
    ("left_a", "left_b", "velocity", "pressure_rate_a", "pressure_rate_b", "bulk_modulus_a",
     "bulk_modulus_b", "viscosity"),
    "rates of the oil trapped at the ends", "", "rates", balances=(PISTON, *FLOWS),
)  # fmt: skip

# rod and load
friction = Stage(
    "friction", "friction", ("velocity", "position", "viscosity", "scale"),
    "friction force of the seals that is continuous in velocity", "N", "sum", balances=(PISTON,),
)  # fmt: skip
dry_friction = Stage(
    "dry_friction", "friction", ("velocity", "position", "pressure_a", "pressure_b"),
    "level of the friction force that depends only on the direction", "N", "sum",
    balances=(PISTON,),
)  # fmt: skip
dry_friction_acts = Acts(dry_friction)
friction_direction = Stage(
    "friction_direction", "friction", ("direction", "velocity", "way"),
    "direction of dry friction, -1 to 1", "1", "chain", balances=(PISTON,),
)  # fmt: skip
friction_scale = Stage(
    "friction_scale", "friction", ("scale", "direction", "velocity", "position"),
    "factor on the friction force", "1", "chain", balances=(PISTON,),
)  # fmt: skip
stop = Stage(
    "stop", "cylinder", ("position", "velocity"), "force of the cylinder's ends on the rod", "N",
    "sum", balances=(PISTON,),
)  # fmt: skip
inertia = Stage(
    "inertia", "cylinder", ("position",), "mass that moves ahead of the load cell", "kg", "sum",
    balances=(PISTON,),
)  # fmt: skip
coupling = Stage(
    "coupling", "load", (), "compliance between rod and load", "m/N", "sum", balances=(LOAD,),
)  # fmt: skip
coupling_acts = Acts(coupling)
play = Stage(
    "play", "load", ("stretch",), "stretch that carries force", "m", "chain", balances=(LOAD,),
)  # fmt: skip
load = Stage(
    "load", "load", ("position", "velocity", "wall_shift"),
    "force of the surroundings against the load", "N", "sum", balances=(LOAD,),
)  # fmt: skip
load_inertia = Stage(
    "load_inertia", "load", ("position",), "mass in addition to the constant mass", "kg", "sum",
    balances=(LOAD,),
)  # fmt: skip

# joints that the load turns about
joint_angle = Stage(
    "joint_angle", "load", ("position",), "angle of a joint", "rad", "sum", balances=(),
)  # fmt: skip
joint_lever = Stage(
    "joint_lever", "load", ("position",), "way of the rod per angle", "m", "sum", balances=(),
)  # fmt: skip
joint_lever_slope = Stage(
    "joint_lever_slope", "load", ("position",), "change of the lever per way of the rod", "1",
    "sum", balances=(),
)  # fmt: skip
joint_inertia = Stage(
    "joint_inertia", "load", (), "moment of inertia about a joint", "kg*m^2", "sum", balances=(),
)  # fmt: skip
joint_mass_moment = Stage(
    "joint_mass_moment", "load", (), "mass times distance from a joint", "kg*m", "sum",
    balances=(),
)  # fmt: skip
joint_carries = Stage(
    "joint_carries", "load", (), "distance to a joint that the load carries", "m", "sum",
    balances=(),
)  # fmt: skip

# sensors
element = Stage(
    "element", "sensors", ("quantity", "interval"), "quantity that a sensing element has followed",
    "span", "chain", balances=(),
)  # fmt: skip
element_acts = Acts(element)
transducer = Stage(
    "transducer", "sensors", ("reading", "span", "neighbour", "differenced", "period", "normal"),
    "reading of one channel", "span", "chain", balances=(),
)  # fmt: skip

CONTINUOUS = (
    temperature, viscosity, gas_pressure, gas_expansion, supply, tank, pilot_flow,
    line_flow, line_rates, source, relief, pump_loss, full_flow, pump_drag, capacity,
    return_rates, driver, command, pilot, spool_force, spool, spool_reach, travel, edge_sa, edge_at,
    edge_sb, edge_bt, metering, edge_law, kept_drop, line_a, line_b, line_flow_a, line_flow_b,
    cylinder_line_rates, holding, holding_rates, cross_relief, port_relief, vapour, oil, heat,
    cross_leakage, outward_leakage, port_area, cushion_a, cushion_b, cushion_flow_a, cushion_flow_b,
    cushion_rates, friction, dry_friction, friction_direction, friction_scale, stop, inertia,
    coupling, play, load, load_inertia, joint_angle, joint_lever, joint_lever_slope, joint_inertia,
    joint_mass_moment,
    joint_carries,
)  # fmt: skip
TICKED = (set_point, late_set_point, early_set_point, arrival)
SAMPLED = (element, transducer)
ACTS = (
    gas_expansion_acts, source_acts, dry_friction_acts, holding_acts, coupling_acts, element_acts,
    edge_sa_acts, edge_at_acts, edge_sb_acts, edge_bt_acts, edge_law_acts,
)  # fmt: skip

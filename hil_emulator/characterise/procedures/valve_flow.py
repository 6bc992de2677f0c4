"""Flow of the valve against its current, in the circuit of S1 Fig. 3.4.

Ports a and b are joined through a flow meter, so both metering edges share the pressure drop:
dp_n2 = p_s - p_t = 2 dp_n1 (S1 eq. 3.7). The slope of the flow curve beyond the lap is the valve
gain K_v = q_n/(u_n sqrt(dp_n1)) (S1 eq. 3.8).
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE

NOMINAL_DROP = 70e5
"""Supply minus tank pressure of the data sheet [Pa] (public HyQ bench scripts)."""
_TO_LITRES = 6e4  # m³/s -> l/min


def flow_curve(bench: Bench) -> tuple[Series, Series]:
    """Return current [A] and flow through the meter [m³/s] over one slow triangle."""
    tank = bench.value("tank_pressure")
    changes = bench.off("supply", "tank") | bench.joined()
    stand = bench.stand(changes | {"supply_pressure": tank + NOMINAL_DROP})
    rated = bench.rated_current
    ramp = np.concatenate(
        [np.linspace(0, 1, 1000), np.linspace(1, -1, 2000), np.linspace(-1, 0, 1000)]
    )
    record = stand.drive(rated * ramp)
    return record.signals["spool_position"], record.signals["leakage_flow"]


def _gain(edges: Edges, current: Series, flow: Series, sign: float) -> float:
    """Return K_v from the slope between 20 % and 90 % of the full opening on one side."""
    share = (sign * current - edges.overlap) / (edges.rated - edges.overlap)
    used = (share > 0.2) & (share < 0.9)
    slope = np.polyfit(edges.each_in_series(current[used]), flow[used], 1)[0]
    return float(slope / np.sqrt(NOMINAL_DROP / 2.0))


def run(bench: Bench) -> BenchResult:
    """Measure the flow curve."""
    current, flow = flow_curve(bench)
    rated, edges = bench.rated_current, Edges.of(bench)
    both = [_gain(edges, current, flow, sign) for sign in (1.0, -1.0)]
    root = bench.value("valve_gain") * math.sqrt(NOMINAL_DROP / 2.0)
    # hysteresis and threshold may prevent the full opening of the spool
    reached = min(0.99 * rated, float(current.max()))
    whole = edges.in_series(rated)
    nominal = float(np.interp(reached, *_rising(current, flow))) * whole / edges.in_series(reached)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Ports a and b joined through a flow meter, p_s - p_t = 70 bar, the current on a slow "
            "triangle over the rated range. The valve gain is the slope of the flow curve between "
            "20 % and 90 % of the full opening, mean of both directions."
        ),
        columns={
            "current": column("mA", current * 1e3),
            "flow": column("l/min", flow * _TO_LITRES),
            "gain law": column("l/min", root * edges.each_in_series(current) * _TO_LITRES),
        },
        comparisons=[
            Comparison("valve gain K_v", "m³/(s A √Pa)", bench.value("valve_gain"),
                       "configured, S1 eq. 3.8", float(np.mean(both)), 1e-3, Agreement.CONFIGURED),
            Comparison("flow at rated current, 70 bar", "l/min", root * whole * _TO_LITRES,
                       "configured; HyQ: 7.5, S1 3.3 and bench scripts", nominal * _TO_LITRES,
                       0.01, Agreement.CONFIGURED),
        ],
        notes=[
            f"The opening at null adds {bench.null_opening / rated:.1%} to the flow at the rated "
            "current."
        ],
    )  # fmt: skip


def _rising(current: Series, flow: Series) -> tuple[Series, Series]:
    order = np.argsort(current, kind="stable")
    return current[order], flow[order]


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw flow against current."""
    axes = figure.add_subplot()
    axes.plot(result["current"], result["flow"], color=BLUE, linewidth=3, label="emulated valve")
    axes.plot(result["current"], result["gain law"], "--", color=BLACK, linewidth=1,
              label="edges as configured")  # fmt: skip
    look.label(axes, "spool position as current [mA]", "flow a to b [l/min]",
               "Flow curve at 70 bar valve pressure drop")  # fmt: skip
    look.legend(axes)


TEST = Procedure("valve-flow", "Flow of the valve against current", run, draw, Chapter.VALVE, 1)

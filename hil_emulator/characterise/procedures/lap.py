"""Flow of the valve about null with underlap, zero lap and overlap (S1 Fig. 3.3).

Ports a and b are joined through a flow meter. An edge that opens by u passes K_v u sqrt(dp), so

    underlap u_0   inside |u| < u_0 both edges of a port are open: 2 K_v u sqrt(dp), twice the gain
    zero lap       K_v u sqrt(dp) throughout
    overlap u_0    0 inside, K_v (|u| - u_0) sqrt(dp) beyond

(Merritt 1967, open, critical and closed centre), in turbulent flow. Laminar flow through such
narrow edges is smaller.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.valve_flow import NOMINAL_DROP, flow_curve
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Comparison,
    DocumentFigure,
    Series,
    column,
)
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, GREEN, VERMILION

_LAPS: Mapping[str, tuple[str, ...]] = {
    "underlap": ("underlap_lap",), "zero lap": (), "overlap": ("overlap_lap",),
}  # fmt: skip
_WIDTH = 0.01  # of each lap, part of the rated current
_SWEEP = np.linspace(-4.0, 4.0, 321)  # currents, in laps
_HELD = 0.02  # each current [s]
_QUICK = 250.0  # lowest natural frequency of the spool, which must settle in that time [Hz]
_BEYOND = 0.1  # part of the full opening from which on the flow curve shows the dead band
_ABSENT = "half of the dead band, as configured: the valve has no overlap beyond its clearance."
_TO_LITRES = 6e4  # m³/s -> l/min


def ideal_flow(name: str, current: Series) -> Series:
    """Return the flow of a lap relative to an edge opened by one lap; current in laps."""
    size, sign = np.abs(current), np.sign(current)
    if name == "underlap":
        return np.asarray(np.where(size < 1.0, 2.0 * current, sign * (size + 1.0)))
    return np.asarray(sign * np.maximum(0.0, size - 1.0) if name == "overlap" else current)


def _flow(bench: Bench, width: float, fields: tuple[str, ...]) -> Series:
    """Return the flow through the meter [m³/s] at each current of the sweep."""
    changes = bench.off("supply", "tank", "valve") | bench.joined()
    supply = {"supply_pressure": bench.value("tank_pressure") + NOMINAL_DROP}
    quick = max(_QUICK, bench.value("valve_natural_frequency"))
    turbulent = {"valve_critical_reynolds_number": 0.0, "valve_natural_frequency": quick}
    stand = bench.stand(changes | supply | turbulent | dict.fromkeys(fields, width))
    middle = 0.5 * (supply["supply_pressure"] + bench.value("tank_pressure"))
    stand.plant.state.pressure_a = stand.plant.state.pressure_b = middle
    ticks = round(_HELD / stand.period)
    record = stand.drive(np.repeat(_SWEEP * width, ticks))
    return record.signals["leakage_flow"][ticks - 1 :: ticks]


def _slope(flow: Series, near: NDArray[np.bool_]) -> float:
    return float(np.polyfit(_SWEEP[near], flow[near], 1)[0])


def _configured(bench: Bench) -> list[Comparison]:
    """Compare half of the valve's dead band with the extrapolated start of its flow curve."""
    edges = Edges.of(bench)
    half = edges.overlap - edges.underlap - edges.clearance
    if edges.overlap == 0.0 or half <= 0.0:
        return []
    current, flow = flow_curve(bench)
    starts = []
    for sign in (1.0, -1.0):
        # fitted near the start, because the passages bend the rest of the curve
        open_by = sign * current - edges.beyond(_BEYOND)
        near = (open_by > 0.0) & (open_by < 3.0 * _BEYOND * (edges.rated - edges.overlap))
        slope, offset = np.polyfit(current[near], flow[near], 1)
        starts.append(-offset / slope)
    measured = 0.5 * float(starts[0] - starts[1])
    return [
        Comparison("half of the dead band, as configured", "uA", half * 1e6,
                   "overlap less the opening of the clearance", measured * 1e6, 0.02,
                   Agreement.CONFIGURED)
    ]  # fmt: skip


def run(bench: Bench) -> BenchResult:
    """Sweep the current about null with each lap."""
    width = _WIDTH * bench.rated_current
    flows = {name: _flow(bench, width, fields) for name, fields in _LAPS.items()}
    unit = bench.value("valve_gain") * width * (0.5 * NOMINAL_DROP) ** 0.5
    inside, beyond = np.abs(_SWEEP) < 0.9, _SWEEP > 1.1
    gains = {n: _slope(q, inside) / _slope(q, beyond) for n, q in flows.items()}
    slope, offset = np.polyfit(_SWEEP[beyond], flows["overlap"][beyond], 1)
    configured = _configured(bench)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Ports a and b joined through a flow meter, p_s - p_t = 70 bar; the edges given an "
            "underlap, no lap and an overlap of 1 % of the rated current in turn."
        ),
        columns={"current": column("%", _SWEEP * _WIDTH * 1e2)}
        | {name: column("l/min", flow * _TO_LITRES) for name, flow in flows.items()}
        | {
            f"{name}, straight edges": column("l/min", ideal_flow(name, _SWEEP) * unit * _TO_LITRES)
            for name in _LAPS
        },
        comparisons=[
            Comparison(f"flow gain at null over that beyond the lap, {name}", "1", wanted,
                       "Merritt 1967", gains[name], 0.01, Agreement.DERIVED)
            for name, wanted in (("underlap", 2.0), ("zero lap", 1.0))
        ]
        + [
            Comparison("half of the dead band, imposed overlap of 1 %", "uA", width * 1e6,
                       "as imposed", float(-offset / slope) * width * 1e6, 0.01,
                       Agreement.CONFIGURED),
            *configured,
        ],
        inapplicable=[] if configured else [_ABSENT],
        figures=[
            DocumentFigure(
                "S1 Fig. 3.3", "zero lap for the valve, and underlap and overlap; no widths",
                "the three shapes for straight edges, with an assumed lap",
            )
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw flow against current for each lap."""
    axes = figure.add_subplot()
    for name, colour in zip(_LAPS, (BLUE, GREEN, VERMILION), strict=True):
        axes.plot(result["current"], result[name], color=colour, linewidth=3, label=name)
        axes.plot(result["current"], result[f"{name}, straight edges"], "--", color=BLACK,
                  linewidth=1)  # fmt: skip
    shapes = "shapes of S1 Fig. 3.3" if result.figures else "straight edges"
    axes.plot([], [], "--", color=BLACK, linewidth=1, label=shapes)
    look.label(axes, "current [% of rated]", "flow a to b [l/min]", "Flow about null at 70 bar")
    look.legend(axes)


TEST = Procedure("lap", "Flow about null with three laps", run, draw, Chapter.VALVE, 5)

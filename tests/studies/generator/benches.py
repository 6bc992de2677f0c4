"""The benches of the blind test: the machine of a data sheet, and how it is recorded.

Their machines differ in every ratio that matters (valve to oil column, friction to push, dead to
swept volume), their loggers in rate, noise and resolution: rules must not grow around one of them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

CONFIGS = Path(__file__).parents[3] / "configs"


@dataclass(frozen=True, eq=False)
class Bench:
    """A machine as its data sheet has it, and its instruments.

    Attributes:
        name: "" for the first one.
        config: the same machine for the product.
        sheet: parameters of `plant.Machine`, SI.
        period: between two rows of its logger [s].
        noise: standard deviation of each channel, SI.
        steps: least significant bit of each channel, where there is a converter, SI.
        gain: of its position controller [A/m].
        lead: current over wanted speed that the controller adds [A s/m].
        bends: force at which a load cell of another law bends [N].
        way: motions over those of the first bench.
        slowness: durations of motions and delays over those of the first bench.
        strange: whether base laws take any form, and numbers that no sheet states any value.

    """

    name: str
    config: Path
    sheet: Mapping[str, float]
    period: float
    noise: tuple[float, ...]
    steps: tuple[float, ...]
    gain: float
    lead: float
    bends: float
    way: float = 1.0
    slowness: float = 1.0
    strange: bool = False

    @property
    def middle(self) -> float:
        """Middle of the stroke [m]."""
        return 0.5 * self.sheet["stroke"]

    def over(self, other: "Bench") -> Mapping[str, float]:
        """Return the scales of this machine over those of another, by what is measured in them."""
        area, flow, push, way = (self._scale(n) / other._scale(n)
                                 for n in ("area", "flow", "push", "stroke"))  # fmt: skip
        return {"area": area, "flow": flow, "force": push, "length": way, "current": 1.0,
                "speed": flow / area, "time": self.slowness / other.slowness, "pressure": 1.0,
                "ratio": 1.0}  # fmt: skip

    def _scale(self, what: str) -> float:
        sheet = self.sheet
        flow = sheet["kv"] * math.sqrt(sheet["supply"])
        derived = {"flow": flow, "push": sheet["area"] * sheet["supply"]}
        return derived.get(what) or sheet[what]


FIRST = Bench(
    "", CONFIGS / "hyq_knee.toml",
    {
        "supply": 160e5, "tank": 1e5, "kv": 6.681e-6, "wv": 2 * np.pi * 250.0, "zv": 0.7,
        "area": 2.0106e-4, "alpha": 0.61, "stroke": 0.08, "va": 3e-6, "vb": 3e-6, "beta": 1.3e9,
        "mass": 50.0, "viscous": 1000.0, "coulomb": 100.0, "load_viscous": 500.0,
        "clearance": 28e-6, "air": 0.001,
    },
    1e-3, (3e4, 3e4, 3e4, 1e-5, 15.0), (6.1e3, 6.1e3, 6.1e3, 3.5e-6, 2.44), 0.35, 8e-3, 300.0,
)  # fmt: skip
"""The knee of the reference machine."""

AXIS = Bench(
    "axis", Path(__file__).with_name("axis.toml"),
    {
        "supply": 210e5, "tank": 2e5, "kv": 40e-3 / 60.0 / 0.01 / math.sqrt(35e5),
        "wv": 2 * np.pi * 90.0, "zv": 0.8, "area": 0.25 * np.pi * 0.04**2,
        "alpha": 1.0 - (22.0 / 40.0) ** 2, "stroke": 0.2, "va": 25e-6, "vb": 20e-6,
        "beta": 1.4e9, "mass": 120.0, "viscous": 2000.0, "coulomb": 400.0,
        "load_viscous": 800.0, "clearance": 20e-6, "air": 0.002, "spool_rate": 1.0,
        "usual_flow": 9e-5,
    },
    2e-3, (1.5e4, 1.5e4, 1.5e4, 5e-6, 40.0), (610.0, 610.0, 610.0, 5e-6, 1.22), 0.25, 8e-3, 2500.0,
    way=2.0, slowness=1.5,
)  # fmt: skip
"""A test axis; its numbers are those of `axis.toml`."""

CRANE = Bench(
    "crane", Path(__file__).with_name("crane.toml"),
    {
        "supply": 250e5, "tank": 4e5, "kv": 100e-3 / 60.0 / 0.01 / math.sqrt(35e5),
        "wv": 2 * np.pi * 60.0, "zv": 0.6, "area": 0.25 * np.pi * 0.11**2,
        "alpha": 1.0 - (70.0 / 110.0) ** 2, "stroke": 0.9, "va": 1200e-6, "vb": 1100e-6,
        "beta": 1.0e9, "mass": 8000.0, "viscous": 7000.0, "coulomb": 4500.0,
        "load_viscous": 4000.0, "clearance": 50e-6, "air": 0.003, "spool_rate": 0.4,
        "usual_flow": 2e-4,
    },
    5e-3, (2e4, 2e4, 2e4, 1e-4, 250.0), (1e4, 1e4, 1e4, 1e-4, 75.0), 0.08, 0.05, 25e3,
    way=2.0, slowness=6.0,
)  # fmt: skip
"""The boom of a crane; its numbers are those of `crane.toml`."""

STRANGERS = tuple(
    replace(bench, name=f"stranger-{bench.name}" if bench.name else "stranger", strange=True)
    for bench in (FIRST, AXIS, CRANE)
)
"""The same three from other makers."""

BENCHES = {bench.name: bench for bench in (FIRST, AXIS, CRANE, *STRANGERS)}

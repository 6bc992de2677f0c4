"""The catalogue: every effect the model knows, one file per place in the equations.

The tuple below is the order in which effects act at their stage.
"""

from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import (
    coupling,
    cushion,
    cylinder,
    driver,
    edges,
    element,
    friction,
    guides,
    heat,
    line_waves,
    lines,
    load,
    oil,
    single_edges,
    supply,
    transducer,
    valve,
)

CATALOGUE: tuple[Effect, ...] = (
    *supply.EFFECTS,
    *driver.EFFECTS,
    *valve.EFFECTS,
    *edges.EFFECTS,
    *single_edges.EFFECTS,
    *lines.EFFECTS,
    *line_waves.EFFECTS,
    *oil.EFFECTS,
    *heat.EFFECTS,
    *cylinder.EFFECTS,
    *cushion.EFFECTS,
    *friction.EFFECTS,
    *coupling.EFFECTS,
    *load.EFFECTS,
    *guides.EFFECTS,
    *element.EFFECTS,
    *transducer.EFFECTS,
)

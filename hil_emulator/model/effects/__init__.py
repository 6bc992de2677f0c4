"""The catalogue: every effect the model knows, one file per place in the equations.

The tuple below is the order in which effects act at their stage.
"""

from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import cylinder, friction, load, oil, transducer, valve

CATALOGUE: tuple[Effect, ...] = (
    *valve.EFFECTS,
    *oil.EFFECTS,
    *cylinder.EFFECTS,
    *friction.EFFECTS,
    *load.EFFECTS,
    *transducer.EFFECTS,
)

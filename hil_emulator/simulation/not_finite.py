"""What a run ends with whose plant has failed: its state lost, or an FMU that gave up."""

from hil_emulator.errors import UserError


class NotFiniteError(UserError):
    """A state of the model has become infinite or no number: the run has ended, not been refused.

    Args:
        now_ns: the tick in which it was seen [ns].
        state: which one; the first of several.

    """

    exit_code = 1

    def __init__(self, now_ns: int, state: str) -> None:
        super().__init__(
            f"at {now_ns * 1e-9:.3f} s the model's {state} is not finite any more; `check` tells "
            "whether the integration step is too wide, an effect of one's own may be the reason"
        )


class PlantFailedError(UserError):
    """What moved in place of the built-in plant has failed; the nodes have stayed on the bus."""

    exit_code = 1
